"""Declared parameters with a stated uncertainty, as constant states.

Such a state d is normalised by the declared standard deviation ``s``: the true value is ``declared + s d``, where d
is at most three; what exceeds that counts a tenth. Data sheets and surveys have no tails: an error of ten standard
deviations is not unlikely but another kind of error, and a long recording would buy it from a normal distribution.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .active_effects import platform_axes
from .schema import AXES, Platform, Point, Robot

MODULUS, DAMPING, MASS = "modulus", "damping", "mass"
ANCHOR, ATTACHMENT = "anchor", "attachment"
INERTIA, CENTRE_OF_MASS = "inertia", "centre_of_mass"
TENSION_OFFSET, TENSION_GAIN, POSITION_OFFSET = "tension_offset", "tension_gain", "position_offset"
UNITS = {
    MODULUS: "Pa",
    DAMPING: "Pa s",
    MASS: "kg",
    ANCHOR: "m",
    ATTACHMENT: "m",
    INERTIA: "kg m^2",
    CENTRE_OF_MASS: "m",
    TENSION_OFFSET: "N",
    TENSION_GAIN: "",
    POSITION_OFFSET: "m",
}

# Standard deviations up to which a perturbation counts in full, within which that ends, and what share of the excess
# counts.
MAX_FULL_PERTURBATION, TRANSITION, EXCESS_SHARE = 3.0, 0.5, 0.1


def limited_perturbation(state: Any, square_root: Callable[[Any], Any]) -> Any:
    """Perturbation in standard deviations of a parameter whose state d is given, with the ``square_root`` handed in.

    With the limit L and the transition w

        c = sqrt(1 + w^2 / L^2) (sqrt((d + L)^2 + w^2) - sqrt((d - L)^2 + w^2)) / 2        c + 0.1 (d - c)

    The slope never vanishes, so that a filter which went too far at first returns; and it has no jump, where gains and
    so the likelihood would have one.
    """
    limit, width = MAX_FULL_PERTURBATION, TRANSITION
    above, below = (square_root((state + bound) ** 2 + width**2) for bound in (limit, -limit))
    full = 0.5 * (1.0 + (width / limit) ** 2) ** 0.5 * (above - below)
    return full + EXCESS_SHARE * (state - full)


@dataclass(frozen=True)
class UncertainParameter:
    """An uncertain parameter: its kind, cable (from 1, 0 for none), standard deviation in SI units, axis (from 0).

    Of an inertia the axis is the principal one nearest to that axis of the platform.
    """

    kind: str
    cable: int
    standard_deviation: float
    axis: int = 0

    @property
    def unit(self) -> str:
        """SI unit, such as ``Pa s``."""
        return UNITS[self.kind]

    def declared(self, robot: Robot) -> float:
        """Declared value; zero for a sensor's offset and one for its gain, of which nothing is declared."""
        if self.kind == MASS:
            return robot.platform.mass
        if self.kind in (MODULUS, DAMPING):
            return float(getattr(robot.cables[self.cable - 1], self.kind))
        if self.kind in (ANCHOR, ATTACHMENT):
            return float(getattr(robot.cables[self.cable - 1], self.kind)[self.axis])
        if self.kind == CENTRE_OF_MASS:
            return robot.platform.centre_of_mass[self.axis]
        if self.kind == INERTIA:
            axis = np.array(platform_axes(robot.platform)[self.axis])
            return float(axis @ np.array(robot.platform.inertia) @ axis)
        return 1.0 if self.kind == TENSION_GAIN else 0.0

    @property
    def label(self) -> str:
        """Readable name, such as ``modulus of cable 2``."""
        if self.kind == MASS:
            return MASS
        if self.kind == POSITION_OFFSET:
            return f"offset of {AXES[self.axis]}"
        if self.kind in (ANCHOR, ATTACHMENT):
            return f"{self.kind} {AXES[self.axis]} of cable {self.cable}"
        if self.kind == CENTRE_OF_MASS:
            return f"centre of mass {AXES[self.axis]}"
        if self.kind == INERTIA:
            return f"principal moment {AXES[self.axis]}"
        names = {TENSION_OFFSET: "offset of tension", TENSION_GAIN: "gain of tension"}
        return f"{names.get(self.kind, f'{self.kind} of cable')} {self.cable}"


def uncertain_parameters(robot: Robot) -> tuple[UncertainParameter, ...]:
    """All parameters for which the robot file states an uncertainty above zero.

    Without the coordinates of anchors across a plane in which the robot lies: a first-order error there moves nothing
    in the plane, and could push the platform out of it.
    """
    sensors, in_plane = robot.sensors, robot.axes_in_plane
    platform = robot.platform
    parameters = [UncertainParameter(MASS, 0, platform.mass_uncertainty)]
    for kind, deviation in (
        (INERTIA, platform.inertia_uncertainty),
        (CENTRE_OF_MASS, platform.centre_of_mass_uncertainty),
    ):
        parameters += [UncertainParameter(kind, 0, deviation, axis) for axis in range(3)]
    for index, cable in enumerate(robot.cables, start=1):
        parameters.append(UncertainParameter(MODULUS, index, cable.modulus_uncertainty))
        parameters.append(UncertainParameter(DAMPING, index, cable.damping_uncertainty))
        parameters += [UncertainParameter(ANCHOR, index, cable.anchor_uncertainty, axis) for axis in in_plane]
        parameters += [UncertainParameter(ATTACHMENT, index, cable.attachment_uncertainty, axis) for axis in range(3)]
        parameters.append(UncertainParameter(TENSION_OFFSET, index, sensors.tension_offset_uncertainty))
        parameters.append(UncertainParameter(TENSION_GAIN, index, sensors.tension_gain_uncertainty))
    parameters += [
        UncertainParameter(POSITION_OFFSET, 0, sensors.position_offset_uncertainty, axis) for axis in range(3)
    ]
    return tuple(number for number in parameters if number.standard_deviation > 0.0)


def perturbed_robot(robot: Robot, parameters: Sequence[UncertainParameter], perturbations: Sequence[Any]) -> Robot:
    """The robot with each parameter perturbed by a multiple of its standard deviation, except those of sensors."""
    platform, cables = robot.platform, list(robot.cables)
    for parameter, perturbation in zip(parameters, perturbations, strict=True):
        change = parameter.standard_deviation * perturbation
        if parameter.kind == MASS:
            platform = replace(platform, mass=platform.mass + change)
        elif parameter.kind in (MODULUS, DAMPING):
            cable = cables[parameter.cable - 1]
            cables[parameter.cable - 1] = replace(cable, **{parameter.kind: getattr(cable, parameter.kind) + change})
        elif parameter.kind == CENTRE_OF_MASS:
            platform = replace(platform, centre_of_mass=_moved(platform.centre_of_mass, parameter.axis, change))
        elif parameter.kind == INERTIA:
            axis = platform_axes(robot.platform)[parameter.axis]
            platform = replace(platform, inertia=_with_moment_added(platform, axis, change))
        elif parameter.kind in (ANCHOR, ATTACHMENT):
            cable = cables[parameter.cable - 1]
            changed: dict[str, Any] = {parameter.kind: _moved(getattr(cable, parameter.kind), parameter.axis, change)}
            cables[parameter.cable - 1] = replace(cable, **changed)
    return replace(robot, platform=platform, cables=tuple(cables))


def _moved(point: Point, axis: int, change: Any) -> Point:
    """A point with one coordinate changed."""
    x, y, z = (value + change if index == axis else value for index, value in enumerate(point))
    return (x, y, z)


def _with_moment_added(platform: Platform, axis: Sequence[float], change: Any) -> tuple[Point, Point, Point]:
    """The inertia with a change of its moment about one principal axis, a unit vector."""
    assert platform.inertia is not None
    x, y, z = (
        tuple(entry + row * column * change for entry, column in zip(entries, axis, strict=True))
        for entries, row in zip(platform.inertia, axis, strict=True)
    )
    return (x, y, z)


@dataclass(frozen=True)
class SensorErrors:
    """Constant errors of x, y, z (m) and of each tension (N): an output is shown as ``gains * value + offsets``."""

    gains: tuple[Any, ...]
    offsets: tuple[Any, ...]


def sensor_errors(
    parameters: Sequence[UncertainParameter], perturbations: Sequence[Any], cable_count: int
) -> SensorErrors:
    """Constant errors of the sensors, for multiples of the standard deviations."""
    gains: list[Any] = [1.0] * (3 + cable_count)
    offsets: list[Any] = [0.0] * (3 + cable_count)
    for parameter, perturbation in zip(parameters, perturbations, strict=True):
        error = parameter.standard_deviation * perturbation
        if parameter.kind == POSITION_OFFSET:
            offsets[parameter.axis] = error
        elif parameter.kind == TENSION_OFFSET:
            offsets[2 + parameter.cable] = error
        elif parameter.kind == TENSION_GAIN:
            gains[2 + parameter.cable] = 1.0 + error
    return SensorErrors(tuple(gains), tuple(offsets))


def is_surveyed(robot: Robot) -> bool:
    """Whether the robot file states how well a survey knows points or load cells: a real robot's does."""
    return any(parameter.kind in (ANCHOR, ATTACHMENT, TENSION_GAIN) for parameter in uncertain_parameters(robot))
