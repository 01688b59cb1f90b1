"""ecos through ecospy on the archive's system structure, the winches set from outside before every step."""

import os
import time

from ecospy import EcosSimulation
from ramps import winches
from shared import finish, read_task


def main() -> None:
    task = read_task()
    simulation = EcosSimulation(ssp_path=str(task.components_only), step_size=task.step)
    simulation.init(parameter_set="values")
    drives = {
        output: f"{target}::{variable}" for source, output, target, variable in task.connections if source == "driver"
    }
    begun = time.perf_counter()
    for number in range(task.count):
        for output, value in winches(number * task.step).items():
            simulation.set_real(drives[output], value)
        simulation.step()
    seconds = time.perf_counter() - begun
    finish(task, "ecospy", [simulation.get_real(f"{task.shown}::{name}") for name in task.position], seconds)
    simulation.terminate()
    simulation.free()
    # TBB crashes in one exit of a thousand, in its hwloc, when all is done.
    os._exit(0)


if __name__ == "__main__":
    main()
