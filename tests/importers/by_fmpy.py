"""fmpy by hand, as its users write it: all outputs read, all inputs written, all components stepped."""

import time

import fmpy
from fmpy.fmi2 import FMU2Slave
from shared import Task, finish, read_task


class Wired:
    """All components, instantiated and initialised; connections grouped by the pair of components they join."""

    def __init__(self, task: Task) -> None:
        self.fmus: dict[str, FMU2Slave] = {}
        self.references: dict[str, dict[str, int]] = {}
        for name, path in task.files.items():
            self._load(name, path)
        self.pairs: dict[tuple[str, str], tuple[list[int], list[int]]] = {}
        for source, output, target, variable in task.connections:
            outputs, inputs = self.pairs.setdefault((source, target), ([], []))
            outputs.append(self.references[source][output])
            inputs.append(self.references[target][variable])

    def _load(self, name, path) -> None:
        description = fmpy.read_model_description(str(path))
        fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(str(path)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        self.fmus[name] = fmu
        self.references[name] = {v.name: v.valueReference for v in description.modelVariables}

    def exchange(self, targets) -> None:
        """Pass outputs on to the inputs of ``targets``; all are read before any is written."""
        values = [
            (target, inputs, self.fmus[source].getReal(outputs))
            for (source, target), (outputs, inputs) in self.pairs.items()
            if target in targets
        ]
        for target, inputs, read in values:
            self.fmus[target].setReal(inputs, read)

    def step(self, names, begin: float, step: float) -> None:
        for name in names:
            self.fmus[name].doStep(currentCommunicationPoint=begin, communicationStepSize=step)

    def read(self, name: str, variables) -> list[float]:
        return self.fmus[name].getReal([self.references[name][v] for v in variables])

    def close(self) -> None:
        for fmu in self.fmus.values():
            fmu.terminate()
            fmu.freeInstance()


def main() -> None:
    task = read_task()
    wired = Wired(task)
    begun = time.perf_counter()
    for number in range(task.count):
        wired.exchange(wired.fmus)
        wired.step(wired.fmus, number * task.step, task.step)
    seconds = time.perf_counter() - begun
    finish(task, "fmpy", wired.read(task.shown, task.position), seconds)
    wired.close()


if __name__ == "__main__":
    main()
