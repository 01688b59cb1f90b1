"""Declared parameters with a stated uncertainty, as constant states.

Such a state d is normalised by the declared standard deviation ``s``: the true value is ``declared + s d``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from .schema import AXES, Robot

MODULUS, DAMPING, MASS = "modulus", "damping", "mass"
TENSION_OFFSET, POSITION_OFFSET = "tension_offset", "position_offset"
UNITS = {MODULUS: "Pa", DAMPING: "Pa s", MASS: "kg", TENSION_OFFSET: "N", POSITION_OFFSET: "m"}


@dataclass(frozen=True)
class UncertainParameter:
    """An uncertain parameter: kind, cable or axis (from 1, 0 for the platform), and standard deviation in SI units."""

    kind: str
    index: int
    standard_deviation: float

    @property
    def unit(self) -> str:
        """SI unit, such as ``Pa s``."""
        return UNITS[self.kind]

    def declared(self, robot: Robot) -> float:
        """Declared value; zero for a sensor offset, of which nothing is declared."""
        if self.kind == MASS:
            return robot.platform.mass
        if self.kind in (MODULUS, DAMPING):
            return float(getattr(robot.cables[self.index - 1], self.kind))
        return 0.0

    @property
    def label(self) -> str:
        """Readable name, such as ``modulus of cable 2``."""
        if self.kind == MASS:
            return MASS
        if self.kind == POSITION_OFFSET:
            return f"offset of {AXES[self.index - 1]}"
        return f"{'offset of tension' if self.kind == TENSION_OFFSET else f'{self.kind} of cable'} {self.index}"


def uncertain_parameters(robot: Robot) -> tuple[UncertainParameter, ...]:
    """All parameters for which the robot file states an uncertainty above zero."""
    sensors = robot.sensors
    parameters = [UncertainParameter(MASS, 0, robot.platform.mass_uncertainty)]
    for index, cable in enumerate(robot.cables, start=1):
        parameters.append(UncertainParameter(MODULUS, index, cable.modulus_uncertainty))
        parameters.append(UncertainParameter(DAMPING, index, cable.damping_uncertainty))
        parameters.append(UncertainParameter(TENSION_OFFSET, index, sensors.tension_offset_uncertainty))
    parameters += [UncertainParameter(POSITION_OFFSET, axis, sensors.position_offset_uncertainty) for axis in (1, 2, 3)]
    return tuple(number for number in parameters if number.standard_deviation > 0.0)


def perturbed_robot(robot: Robot, parameters: Sequence[UncertainParameter], perturbations: Sequence[Any]) -> Robot:
    """The robot with each parameter perturbed by a multiple of its standard deviation, except sensor offsets."""
    platform, cables = robot.platform, list(robot.cables)
    for parameter, perturbation in zip(parameters, perturbations, strict=True):
        change = parameter.standard_deviation * perturbation
        if parameter.kind == MASS:
            platform = replace(platform, mass=platform.mass + change)
        elif parameter.kind in (MODULUS, DAMPING):
            cable = cables[parameter.index - 1]
            cables[parameter.index - 1] = replace(cable, **{parameter.kind: getattr(cable, parameter.kind) + change})
    return replace(robot, platform=platform, cables=tuple(cables))


def sensor_offsets(
    parameters: Sequence[UncertainParameter], perturbations: Sequence[Any], cable_count: int
) -> list[Any]:
    """Sensor offsets of x, y, z (m) and of each tension (N), for multiples of the standard deviations."""
    offset_values: list[Any] = [0.0] * (3 + cable_count)
    for parameter, perturbation in zip(parameters, perturbations, strict=True):
        if parameter.kind == POSITION_OFFSET:
            offset_values[parameter.index - 1] = parameter.standard_deviation * perturbation
        elif parameter.kind == TENSION_OFFSET:
            offset_values[2 + parameter.index] = parameter.standard_deviation * perturbation
    return offset_values
