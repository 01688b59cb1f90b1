"""fmpy by hand, components in turn (Gauss-Seidel): cables step on the motion that the platform has at the step's end.

``input_time`` tells the cables so; the platform's forces hold at the start of its step, as without it.
"""

import time

from by_fmpy import Wired
from shared import finish, read_task


def main() -> None:
    task = read_task()
    wired = Wired(task)
    first = ("driver", "platform")
    second = [name for name in task.files if name not in first]
    stamps = {name: [wired.references[name]["input_time"]] for name in second}
    begun = time.perf_counter()
    wired.exchange(wired.fmus)
    for number in range(task.count):
        wired.step(first, number * task.step, task.step)
        for name, reference in stamps.items():
            wired.fmus[name].setReal(reference, [(number + 1) * task.step])
        wired.exchange(second)
        wired.step(second, number * task.step, task.step)
        wired.exchange(first)
    seconds = time.perf_counter() - begun
    finish(task, "fmpy", wired.read(task.shown, task.position), seconds)
    wired.close()


if __name__ == "__main__":
    main()
