"""An FMU container that fmu-manipulation-toolbox makes of the archive, run by fmpy as one FMU."""

import shutil
import tempfile
from pathlib import Path

from by_container import simulate
from fmu_manipulation_toolbox.assembly import Assembly
from shared import read_task


def main() -> None:
    task = read_task()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(task.archive, folder)
        assembly = Assembly(task.archive.name, default_step_size=task.step, fmu_directory=folder)
        assembly.make_fmu(filename="container.fmu")
        simulate(task, folder / "container.fmu")


if __name__ == "__main__":
    main()
