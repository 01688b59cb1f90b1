"""FMUs in model exchange, held in the hand and integrated by SciPy: alone, or a robot of them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tautwire.fmus.packaging import RobotFmus

Array = NDArray[np.float64]
AXES = "xyz"


class Model:
    """An instance in initialization mode, with variables by name."""

    def __init__(self, path: Path, folder: str, start_time: float = 0.0) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.is_fmi_2 = self.description.fmiVersion == "2.0"
        self.fmu: Any = (FMU2Model if self.is_fmi_2 else FMU3Model)(
            guid=self.description.guid,
            unzipDirectory=folder,
            modelIdentifier=self.description.modelExchange.modelIdentifier,
            instanceName=path.stem,
        )
        self.fmu.instantiate(loggingOn=True)
        if self.is_fmi_2:
            self.fmu.setupExperiment(startTime=start_time)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start_time)
        self.state_count = len(self.description.derivatives)
        self.indicator_count = self.description.numberOfEventIndicators
        self.state_names = [unknown.variable.derivative.name for unknown in self.description.derivatives]

    def get(self, *names: str) -> list[float]:
        read = self.fmu.getReal if self.is_fmi_2 else self.fmu.getFloat64
        return list(read([self.references[name] for name in names]))

    def set(self, values: Mapping[str, float]) -> None:
        write = self.fmu.setReal if self.is_fmi_2 else self.fmu.setFloat64
        write([self.references[name] for name in values], list(values.values()))

    def run(self) -> None:
        """Go on to continuous time."""
        self.fmu.exitInitializationMode()
        (self.fmu.newDiscreteStates if self.is_fmi_2 else self.fmu.updateDiscreteStates)()
        self.fmu.enterContinuousTimeMode()

    def states(self) -> Array:
        return self._numbers(self.fmu.getContinuousStates, self.state_count)

    def nominals(self) -> Array:
        return self._numbers(self.fmu.getNominalsOfContinuousStates, self.state_count)

    def rates(self) -> Array:
        get = self.fmu.getDerivatives if self.is_fmi_2 else self.fmu.getContinuousStateDerivatives
        return self._numbers(get, self.state_count)

    def indicators(self) -> Array:
        return self._numbers(self.fmu.getEventIndicators, self.indicator_count)

    def go_to(self, time: float, states: Array) -> None:
        self.fmu.setTime(time)
        numbers = np.ascontiguousarray(states)
        self.fmu.setContinuousStates(numbers.ctypes.data_as(fmpy.fmi2.POINTER(fmpy.fmi2.c_double)), self.state_count)

    def _numbers(self, get: Callable[..., Any], count: int) -> Array:
        numbers = np.empty(count)
        get(numbers.ctypes.data_as(fmpy.fmi2.POINTER(fmpy.fmi2.c_double)), count)
        return numbers


@contextmanager
def in_model_exchange(path: Path, start_time: float = 0.0) -> Iterator[Model]:
    """An instance in initialization mode; its folder goes with it."""
    folder = fmpy.extract(str(path))
    model = Model(path, folder, start_time)
    try:
        yield model
    finally:
        model.fmu.freeInstance()
        shutil.rmtree(folder)


@dataclass(frozen=True)
class CoupledModels:
    """A robot's platform, then its cables, whose outputs are the inputs of each other; the cables take winch speeds."""

    platform: Model
    cables: Sequence[Model]
    speeds: Callable[[float], Array]

    @property
    def models(self) -> list[Model]:
        return [self.platform, *self.cables]

    def states(self) -> Array:
        return np.concatenate([model.states() for model in self.models])

    def go_to(self, time: float, states: Array) -> None:
        """Set time, states and inputs."""
        parts = np.split(states, np.cumsum([model.state_count for model in self.models])[:-1])
        for model, part in zip(self.models, parts, strict=True):
            model.go_to(time, part)
        for number, (cable, speed) in enumerate(zip(self.cables, self.speeds(time), strict=True), start=1):
            suffix = f"_{number}" if "position_1.x" in self.platform.references else ""
            motion = [f"{name}{{}}.{axis}" for name in ("position", "velocity") for axis in AXES]
            values = self.platform.get(*(name.format(suffix) for name in motion))
            cable.set({**dict(zip((n.format("") for n in motion), values, strict=True)), "winch_speed": speed})
            force = cable.get(*(f"force.{axis}" for axis in AXES))
            self.platform.set({f"force_{number}.{axis}": part for axis, part in zip(AXES, force, strict=True)})

    def rates(self, time: float, states: Array) -> Array:
        self.go_to(time, states)
        return np.concatenate([model.rates() for model in self.models])

    def run(self, times: Array, relative: float = 1e-12) -> Array:
        """Position of the platform at ``times`` (N, 3), by DOP853."""
        for model in self.models:
            model.run()
        scales = np.concatenate([model.nominals() for model in self.models])
        span, start = (times[0], times[-1]), self.states()
        solution = solve_ivp(self.rates, span, start, "DOP853", times, rtol=relative, atol=relative * scales)
        shown = []
        for time, states in zip(times, solution.y.T, strict=True):
            self.go_to(float(time), states)
            shown.append(self.platform.get(*(f"position.{axis}" for axis in AXES)))
        return np.array(shown)


@contextmanager
def coupled_models(fmus: RobotFmus, speeds: Callable[[float], Array]) -> Iterator[CoupledModels]:
    """All FMUs of a robot without winches in initialization mode; ``speeds`` gives those of the ropes at a time."""
    with ExitStack() as stack:
        platform, *cables = (stack.enter_context(in_model_exchange(path)) for path in (fmus.platform, *fmus.cables))
        yield CoupledModels(platform, cables, speeds)
