"""libcosim through libcosimpy: its fixed-step algorithm, FMUs added and wired by hand."""

import time

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
from shared import Task, finish, read_task

NANOSECONDS = 1e9


def references(execution: CosimExecution, index: int) -> dict[str, int]:
    """Value references of a slave, by name."""
    return {v.name.decode(): v.reference for v in execution.slave_variables(index)}


def simulate(task: Task, execution: CosimExecution, index: int) -> None:
    """Take all steps and write the position of the slave ``index``."""
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    named = references(execution, index)
    begun = time.perf_counter()
    if not execution.step(task.count):
        raise RuntimeError("a step failed")
    seconds = time.perf_counter() - begun
    finish(task, "libcosimpy", observer.last_real_values(index, [named[name] for name in task.position]), seconds)


def main() -> None:
    task = read_task()
    execution = CosimExecution.from_step_size(round(task.step * NANOSECONDS))
    slaves = {name: CosimLocalSlave(fmu_path=str(path), instance_name=name) for name, path in task.files.items()}
    indices = {name: execution.add_local_slave(slave) for name, slave in slaves.items()}
    named = {name: references(execution, index) for name, index in indices.items()}
    for source, output, target, variable in task.connections:
        execution.connect_real_variables(
            indices[source], named[source][output], indices[target], named[target][variable]
        )
    simulate(task, execution, indices[task.shown])


if __name__ == "__main__":
    main()
