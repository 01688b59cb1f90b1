"""CoFmuPy, its default Jacobi master.

It steps what feeds a loop (the driver) before the loop and passes the values on at once, one step early for inputs
that hold at the start: the driver lags by a step. Its inputs are 0 unless the configuration gives start values.
"""

import time

from cofmupy import Coordinator
from fmpy import read_model_description
from shared import Task, finish, read_task


def start_values(path) -> dict[str, float]:
    """Start values of an FMU's inputs."""
    variables = read_model_description(str(path)).modelVariables
    return {v.name: float(v.start) for v in variables if v.causality == "input" and v.start is not None}


def configuration(task: Task) -> dict:
    """The task in CoFmuPy's words."""
    given = {name: start_values(path) for name, path in task.files.items()} | {"driver": {"lead": -task.step}}
    return {
        "fmus": [
            {"id": name, "name": name, "path": str(path), "initialization": given[name]}
            for name, path in task.files.items()
        ],
        "connections": [
            {
                "source": {"id": source, "variable": output, "unit": ""},
                "target": [{"id": target, "variable": variable, "unit": ""}],
            }
            for source, output, target, variable in task.connections
        ],
        "cosim_method": "jacobi",
    }


def main() -> None:
    task = read_task()
    coordinator = Coordinator()
    coordinator.start(configuration(task))
    begun = time.perf_counter()
    for _ in range(task.count):
        coordinator.do_step(task.step)
    seconds = time.perf_counter() - begun
    finish(task, "cofmupy", [coordinator.get_variable((task.shown, name))[0] for name in task.position], seconds)


if __name__ == "__main__":
    main()
