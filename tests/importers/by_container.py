"""An FMU container by fmu-manipulation-toolbox with all FMUs in it, run by fmpy as one FMU."""

import shutil
import tempfile
import time
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmu_manipulation_toolbox.assembly import AssemblyNode
from ramps import winches
from shared import Task, finish, read_task


def build(task: Task, folder: Path) -> Path:
    """Pack the components into one FMU."""
    node = AssemblyNode("container.fmu", task.step, auto_link=False, auto_input=False, auto_output=False)
    files = {name: path.name for name, path in task.files.items()}
    for name, path in task.files.items():
        shutil.copy(path, folder)
        node.add_fmu(files[name])
    for source, output, target, variable in task.connections:
        node.add_link(files[source], output, files[target], variable)
    for name in task.position:
        node.add_output(files[task.shown], name, name)
    node.make_fmu(folder)
    return folder / node.name


def simulate(task: Task, path: Path) -> None:
    """Step the container; winches that it leaves open are set before every step."""
    description = fmpy.read_model_description(str(path))
    references = {v.name: v.valueReference for v in description.modelVariables}
    identifier = description.coSimulation.modelIdentifier
    fmu = FMU2Slave(
        guid=description.guid, unzipDirectory=fmpy.extract(str(path)), modelIdentifier=identifier, instanceName="all"
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    driven = [name for name in winches(0.0) if name in references]
    begun = time.perf_counter()
    for number in range(task.count):
        now = number * task.step
        if driven:
            values = winches(now)
            fmu.setReal([references[name] for name in driven], [values[name] for name in driven])
        fmu.doStep(currentCommunicationPoint=now, communicationStepSize=task.step)
    seconds = time.perf_counter() - begun
    finish(task, "fmu_manipulation_toolbox", fmu.getReal([references[name] for name in task.position]), seconds)
    fmu.terminate()
    fmu.freeInstance()


def main() -> None:
    task = read_task()
    with tempfile.TemporaryDirectory() as folder:
        simulate(task, build(task, Path(folder)))


if __name__ == "__main__":
    main()
