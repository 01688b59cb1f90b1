"""FMUs held in the hand: one instance, called through fmpy alone."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from numpy.typing import NDArray


class Hand:
    """An instance with variables by name."""

    def __init__(self, path: Path, folder: str) -> None:
        description = fmpy.read_model_description(str(path))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.description = description
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=path.stem,
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()

    def get(self, *names: str) -> list[float]:
        return self.fmu.getReal([self.references[name] for name in names])

    def names(self, causality: str) -> list[str]:
        return [variable.name for variable in self.description.modelVariables if variable.causality == causality]

    def jacobian(self) -> NDArray[np.float64]:
        """Partial derivatives of all outputs, by rows, with respect to all inputs."""
        unknowns, knowns = ([self.references[name] for name in self.names(each)] for each in ("output", "input"))
        return np.array([self.fmu.getDirectionalDerivative(unknowns, [known], [1.0]) for known in knowns]).T

    def set(self, **values: float) -> None:
        """Dots in names are written as double underscores."""
        names = [name.replace("__", ".") for name in values]
        self.fmu.setReal([self.references[name] for name in names], list(values.values()))

    def run(self) -> None:
        self.fmu.exitInitializationMode()

    def step(self, time: float, step: float) -> None:
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=step)


@contextmanager
def in_hand(path: Path) -> Iterator[Hand]:
    """An instance in initialization mode; its folder goes with it."""
    folder = fmpy.extract(str(path))
    hand = Hand(path, folder)
    try:
        yield hand
    finally:
        hand.fmu.freeInstance()
        shutil.rmtree(folder)
