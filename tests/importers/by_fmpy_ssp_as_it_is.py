"""fmpy's simulate_ssp on the archive, nothing done about its zeros: every input is 0 in the first step."""

import time

from fmpy.ssp.simulation import simulate_ssp
from ramps import winches
from shared import finish, read_task


def main() -> None:
    task = read_task()
    # A system connector's value reaches the component one step after it was asked for.
    drives = {name: lambda now, name=name: winches(now + task.step)[name] for name in winches(0.0)}
    begun = time.perf_counter()
    rows = simulate_ssp(str(task.archive), stop_time=task.stop - 0.5 * task.step, step_size=task.step, input=drives)
    seconds = time.perf_counter() - begun
    # A row bears the time at the start of the step whose end it shows.
    finish(task, "fmpy", [rows[-1][f"{task.shown}.{name}"] for name in task.position], seconds)


if __name__ == "__main__":
    main()
