"""Sources of inputs beside a controller: loads on the platform, none, several together, and a view of all columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..array_validation import validate_array
from ..cosimulation import InputSource, Port
from ..cosimulation.robot_wiring import PLATFORM
from ..errors import ArgumentError
from ..fmus.fmu_archive import read_model_description
from ..fmus.fmu_slots import SlotError
from ..fmus.packaging import RobotFmus
from ..robot.schema import AXES

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SampledLoad:
    """A load on the platform as a zero-order hold: ``loads`` (N, 3) in N or N m, each held to the next sample.

    Where the platform ``has_rates`` as inputs, each value is followed by its rate, which is zero.
    """

    loads: Array
    has_rates: bool = True

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        load = self.loads[index]
        input_values = np.column_stack([load, np.zeros(3)]).ravel() if self.has_rates else load
        return input_values, input_values


@dataclass(frozen=True)
class ZeroInput:
    """``count`` inputs that stay zero."""

    count: int

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        return np.zeros(self.count), np.zeros(self.count)


@dataclass(frozen=True)
class JoinedSources:
    """Concatenates the inputs of several sources."""

    sources: tuple[InputSource, ...]

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        pairs = [source.interval(index, time, step, outputs) for source in self.sources]
        return np.concatenate([start for start, _ in pairs]), np.concatenate([end for _, end in pairs])


@dataclass(frozen=True)
class AllColumnsSource:
    """A source that is shown all recorded columns, NaN where no FMU has the output; ``indices`` are the others'."""

    source: InputSource
    indices: tuple[int, ...]
    count: int

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        columns = np.full(self.count, np.nan)
        columns[list(self.indices)] = outputs
        return self.source.interval(index, time, step, columns)


def external_loads(
    caller: str, fmus: RobotFmus, count: int, force: ArrayLike | None, moment: ArrayLike | None
) -> tuple[tuple[SampledLoad, ...], tuple[Port, ...]]:
    """External force and moment (N, 3) on the platform as sources of inputs, and their ports; empty without a load.

    Raises SlotError where a user's platform has no inputs for them, ArgumentError for an invalid array.
    """
    sources: tuple[SampledLoad, ...] = ()
    ports: tuple[Port, ...] = ()
    for name, load, unit in (("external_force", force, "N"), ("external_moment", moment, "N m")):
        if load is None:
            continue
        where = f"{caller}: {name}"
        if name == "external_moment" and not fmus.is_rigid:
            raise ArgumentError(where, load, "acts on a point mass", "leave it out")
        meaning = f"finite values in {unit}, a row for each sample and columns x, y, z"
        values = validate_array(where, load, (count, 3), meaning)
        has_rates = _has_load_rates(fmus, name)
        names = (f"{name}{rate}.{axis}" for axis in AXES for rate in ("", "_rate")[: 1 + has_rates])
        sources, ports = (*sources, SampledLoad(values, has_rates)), (*ports, *(Port(PLATFORM, each) for each in names))
    return sources, ports


def _has_load_rates(fmus: RobotFmus, name: str) -> bool:
    """Whether the platform has the rates of a load as inputs; SlotError where it has not the load itself."""
    if PLATFORM not in fmus.user_start_values:
        return True
    variables = read_model_description(fmus.platform).modelVariables
    input_names = {variable.name for variable in variables if variable.causality == "input"}
    missing = [f"{name}.{axis}" for axis in AXES if f"{name}.{axis}" not in input_names]
    if missing:
        hint = f"add inputs {name}.x to .z to it, or leave the load out"
        raise SlotError(fmus.platform, PLATFORM, missing[0], f"{', '.join(missing)} is no input", hint)
    return all(f"{name}_rate.{axis}" in input_names for axis in AXES)
