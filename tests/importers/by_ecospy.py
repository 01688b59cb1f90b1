"""ecos through ecospy: its fixed-step algorithm, FMUs added and wired by hand."""

import os
import time

from ecospy import EcosSimulation, EcosSimulationStructure
from shared import finish, read_task


def main() -> None:
    task = read_task()
    with EcosSimulationStructure() as structure:
        for name, path in task.files.items():
            structure.add_model(name, str(path))
        for source, output, target, variable in task.connections:
            structure.make_real_connection(f"{source}::{output}", f"{target}::{variable}")
        simulation = EcosSimulation(structure=structure, step_size=task.step)
    simulation.init()
    begun = time.perf_counter()
    simulation.step(task.count)
    seconds = time.perf_counter() - begun
    finish(task, "ecospy", [simulation.get_real(f"{task.shown}::{name}") for name in task.position], seconds)
    simulation.terminate()
    simulation.free()
    # TBB crashes in one exit of a thousand, in its hwloc, when all is done.
    os._exit(0)


if __name__ == "__main__":
    main()
