"""A controller FMU of any tool: variables matched to the robot's signals by name, stepped at the sample period."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from fmpy.model_description import ModelDescription, ScalarVariable
from numpy.typing import NDArray

from ..cosimulation.robot_wiring import ORIENTATION_AXES
from ..errors import InputError
from ..fmus.component import INSTANCE_TYPES, Component, VariableBlock
from ..fmus.fmi_binding import is_real_scalar, type_name
from ..fmus.fmu_archive import read_model_description
from ..fmus.fmu_variables import INPUT_TIME, MIDDLE_TIME
from ..fmus.variable_units import unit_of
from ..name_suggestions import suggest_name
from ..robot.schema import AXES

Array = NDArray[np.float64]


class ControllerFmuError(InputError):
    """A controller FMU does not fit a robot; ``variable`` is the one in question, None where it is the whole FMU."""

    def __init__(self, path: Path, variable: str | None, problem: str, hint: str) -> None:
        super().__init__(str(path), f"cannot be a controller: {problem}", hint)
        self.path = path
        self.variable = variable
        self.args = (path, variable, problem, hint)


class Sample(NamedTuple):
    """A controller's sample at ``time`` (s): measured and expected pose and tensions, and ``speeds`` (n,) to come."""

    time: float
    period: float
    measured: Sequence[float]
    expected: Array
    speeds: Array


class ControllerFmu:
    """A controller FMU; ``inputs`` and ``outputs`` are its matched variables with the robot's signals.

    ``period`` is the sample period in s that it is made for, None where it may be any.

    It is loaded at its first sample: a run in a worker process loads it there.

    Raises ControllerFmuError where a variable does not match, ArchiveError where the file is not an FMU.
    """

    def __init__(self, path: Path, cable_count: int, is_rigid: bool = False) -> None:
        self.path, self.is_rigid = path, is_rigid
        description = read_model_description(path)
        if description.fmiVersion not in INSTANCE_TYPES or description.coSimulation is None:
            problem = f"it is FMI {description.fmiVersion}, or not for co-simulation"
            raise ControllerFmuError(path, None, problem, "export it as FMI 2.0 or 3.0 co-simulation")
        variables: list[ScalarVariable] = description.modelVariables
        self.period = _stated_period(description)
        self._signals = _input_signals(cable_count, is_rigid)
        self.inputs = _matched(path, variables, "input", self._signals)
        speeds, rates = (_numbered(name, cable_count) for name in ("winch_speed", "winch_acceleration"))
        self.outputs = _matched(path, variables, "output", [*speeds, *rates])
        missing = [name for name in speeds if name not in self.outputs.values()]
        if missing:
            names = [variable.name for variable in variables if variable.causality == "output"]
            hint = f"rename {suggest_name(missing[0], names)}" if names else "give it outputs"
            raise ControllerFmuError(path, missing[0], f"it has no output {missing[0]}", hint)
        by_signal = {signal: name for name, signal in self.outputs.items()}
        has_rates = all(name in by_signal for name in rates)
        self._output_names = [by_signal[name] for name in (*speeds, *(rates if has_rates else ()))]
        self._loaded: tuple[Component, VariableBlock, VariableBlock] | None = None

    def speeds(self, sample: Sample) -> Array:
        """The demanded winch speeds (n,) in m/s, by one step of the FMU; raises ComponentError where it fails."""
        values = dict(zip(self._signals, [*sample.measured, *sample.expected, *sample.speeds], strict=True))
        component, inputs, outputs = self._loaded or self._load()
        inputs.values[:] = [values[signal] for signal in self.inputs.values()]
        if self._loaded is None:
            _initialize(component, inputs)
            self._loaded = component, inputs, outputs
        if inputs.count:
            component.write(inputs)
        component.step(sample.time, sample.period)
        component.read(outputs)
        if not np.all(np.isfinite(outputs.values)):
            component.raise_not_finite(outputs)
        count = sum(signal.startswith("reference_winch_speed") for signal in self._signals)
        speeds, rates = outputs.values[:count], outputs.values[count:]
        result: Array = speeds + sample.period * rates if len(rates) else speeds.copy()
        return result

    def close(self) -> None:
        """Free the FMU's instance; the next sample loads it anew."""
        if self._loaded is not None:
            self._loaded[0].close()
            self._loaded = None

    def _load(self) -> tuple[Component, VariableBlock, VariableBlock]:
        component = Component("controller", self.path)
        return component, component.block(list(self.inputs)), component.block(self._output_names)


def _stated_period(description: ModelDescription) -> float | None:
    """The sample period in s that an FMU is made for: its parameter ``period`` where that has one value, else None."""
    for variable in description.modelVariables:
        if variable.name == "period" and variable.causality == "parameter" and is_real_scalar(variable):
            bounds = {variable.start, variable.min, variable.max}
            start = variable.start if len(bounds) == 1 and unit_of(variable) == "s" else None
            return None if start is None else float(start)
    return None


def _initialize(component: Component, inputs: VariableBlock) -> None:
    """Initialize a controller with its first inputs, and free it where that fails."""
    try:
        component.initialize(0.0, {})
        component.write(inputs)
        component.run()
    except BaseException:
        component.close()
        raise


def _numbered(name: str, cable_count: int) -> list[str]:
    return [f"{name}_{number}" for number in range(1, cable_count + 1)]


def _input_signals(cable_count: int, is_rigid: bool) -> list[str]:
    """Names of the signals that a controller may have as inputs: measured ones, then those of the reference."""
    orientation = [f"orientation_{part}" for part in ORIENTATION_AXES] if is_rigid else []
    measured = [*(f"position_{axis}" for axis in AXES), *orientation, *_numbered("tension", cable_count)]
    return [
        *measured,
        *(f"reference_{name}" for name in measured),
        *_numbered("reference_winch_speed", cable_count),
    ]


def _matched(path: Path, variables: Sequence[ScalarVariable], causality: str, signals: Sequence[str]) -> dict[str, str]:
    """Signals by the variables of a causality; outputs may also be others, inputs may not."""
    by_letters = {_letters(signal): signal for signal in signals}
    result: dict[str, str] = {}
    for variable in variables:
        if variable.causality != causality or variable.name in (INPUT_TIME, MIDDLE_TIME):
            continue
        signal = by_letters.get(_letters(variable.name))
        if signal is None:
            if causality == "output":
                continue
            hint = f"rename it, to {suggest_name(variable.name, signals)}"
            raise ControllerFmuError(path, variable.name, f"its input {variable.name} is no signal of the robot", hint)
        if not is_real_scalar(variable):
            problem = f"{variable.name} is {type_name(variable)}, not a scalar Real or Float64"
            raise ControllerFmuError(path, variable.name, problem, "change its type")
        if signal in result.values():
            raise ControllerFmuError(path, variable.name, f"{variable.name} is {signal} a second time", "rename one")
        result[variable.name] = signal
    return result


def _letters(name: str) -> str:
    """The words of a name in lower case, joined by underscores."""
    return "_".join("".join(character.lower() if character.isalnum() else " " for character in name).split())
