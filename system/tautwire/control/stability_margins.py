"""Stability margins of a loop: gain, phase and disk margins, by python-control.

A disk margin alpha holds for gain and phase together, in all its loops at once: each may be multiplied by any complex
number in a disk around 1 that reaches from ``(2 - alpha) / (2 + alpha)`` to its inverse.

Source: Seiler, Packard and Gahinet (2020), An introduction to disk margins, IEEE Control Systems 40(5), 78-95.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray
from slycot import ab13md

from tautwire_fmu.laws.effects import MODULUS

from ..linear import LinearPlant, linearise
from ..linear.operating_point import format_position
from ..robot.active_effects import cable_moduli
from ..robot.schema import Robot
from .design import Knot
from .reachable_plant import reachable_plant
from .sampled_plant import ramp_plant

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FREQUENCY_COUNT = 200
MIN_RELATIVE_FREQUENCY = 1e-3
# An error of 11 % in all gains, or 6 degrees of phase: moduli and payloads are known no better.
MIN_DISK_MARGIN = 0.1
# Of an uncertainty, as SLICOT's AB13MD numbers them.
COMPLEX_BLOCK = 2


@dataclass(frozen=True)
class Margins:
    """Stability margins of a closed loop; ``spectral_radius`` is below 1 if it is stable, otherwise all margins are 0.

    Disk margins: ``winch_disk`` of all winch speeds at once, ``sensor_disk`` the smallest of a single sensor.
    ``gain_margin``, a factor, and ``phase_margin`` in degrees are the smallest classical ones of a single winch.
    """

    spectral_radius: float
    winch_disk: float
    sensor_disk: float
    gain_margin: float
    phase_margin: float

    @property
    def min_disk(self) -> float:
        """The smaller of the disk margins."""
        return min(self.winch_disk, self.sensor_disk)

    @property
    def disk_gain(self) -> float:
        """Factor by which all winch gains may grow or shrink at once."""
        return float("inf") if self.winch_disk >= 2.0 else (2.0 + self.winch_disk) / (2.0 - self.winch_disk)

    @property
    def disk_phase(self) -> float:
        """Phase, in degrees, that all winches may lose at once."""
        return float(2.0 * np.rad2deg(np.arctan(0.5 * self.winch_disk)))

    def worst_of(self, other: Margins) -> Margins:
        """The worse of two loops, margin by margin."""
        return Margins(
            max(self.spectral_radius, other.spectral_radius),
            min(self.winch_disk, other.winch_disk),
            min(self.sensor_disk, other.sensor_disk),
            min(self.gain_margin, other.gain_margin),
            min(self.phase_margin, other.phase_margin),
        )


@dataclass(frozen=True)
class Range:
    """Parametric uncertainty of a robot: ranges of ``moduli`` in Pa, and of ``payloads`` as mass ratios."""

    moduli: tuple[float, float] = (102e9, 135e9)
    payloads: tuple[float, float] = (0.8, 1.2)

    @classmethod
    def of(cls, robot: Robot) -> Range:
        """The range of a robot: the paper's rope from static to dynamic modulus, other ropes in proportion."""
        moduli = cable_moduli(robot)
        lowest, highest = cls.moduli
        if lowest <= min(moduli) and max(moduli) <= highest:
            return cls()
        middle = 0.5 * (lowest + highest)
        return cls((min(moduli) * lowest / middle, max(moduli) * highest / middle))

    def robots(self, robot: Robot, points: int = 3) -> Iterator[tuple[float, float, Robot]]:
        """Modulus, payload and the robot with both, on a grid of ``points`` each."""
        for modulus in np.linspace(*self.moduli, points).tolist():
            for payload in np.linspace(*self.payloads, points).tolist():
                yield modulus, payload, robot_with(robot, modulus, payload)

    def middle(self, robot: Robot) -> Robot:
        """The robot in the middle of the range."""
        return robot_with(robot, sum(self.moduli) / 2.0, sum(self.payloads) / 2.0)


def robot_with(robot: Robot, modulus: float, payload: float) -> Robot:
    """The robot with another modulus (Pa) of all cables, and its mass and inertia times ``payload``.

    The modulus takes the place of one that the effect ``modulus`` sets, too.
    """
    effects = tuple(setting for setting in robot.effects if setting.name != MODULUS.name)
    cables = tuple(replace(cable, modulus=modulus) for cable in robot.cables)
    platform = replace(robot.platform, mass=payload * robot.platform.mass)
    if platform.inertia is not None:
        xx, yy, zz = ((payload * x, payload * y, payload * z) for x, y, z in platform.inertia)
        platform = replace(platform, inertia=(xx, yy, zz))
    return replace(robot, cables=cables, platform=platform, effects=effects)


def speed_controller(regulator: Any) -> Any:
    """A regulator with integrated winch speeds: ``control.StateSpace`` from pose and tensions to winch speeds."""
    count, sensors = regulator.noutputs, regulator.ninputs - regulator.noutputs
    period, states = regulator.dt, regulator.nstates
    feedthrough = regulator.D[:, sensors:]
    return control.ss(
        np.block(
            [[regulator.A, regulator.B[:, sensors:]], [period * regulator.C, np.eye(count) + period * feedthrough]]
        ),
        np.vstack([regulator.B[:, :sensors], period * regulator.D[:, :sensors]]),
        np.eye(count, states + count, states),
        np.zeros((count, sensors)),
        period,
        inputs=regulator.input_labels[:sensors],
        outputs=regulator.input_labels[sensors:],
        name="speed_controller",
    )


def margins_of(linear: LinearPlant, knot: Knot) -> Margins:
    """Margins of a controller on what winches reach of a plant; infinite without feedback, which closes no loop."""
    regulator = knot.regulator
    if not np.any(regulator.B[:, : regulator.ninputs - regulator.noutputs]):
        return Margins(0.0, *[float("inf")] * 4)
    plant, feedback = ramp_plant(reachable_plant(linear), regulator.dt), speed_controller(regulator)
    radius = float(np.max(np.abs(control.feedback(plant, feedback, 1).poles())))
    if radius >= 1.0:
        return Margins(radius, 0.0, 0.0, 0.0, 0.0)
    nyquist_frequency = np.pi / regulator.dt
    omega = np.geomspace(MIN_RELATIVE_FREQUENCY * nyquist_frequency, 0.999 * nyquist_frequency, FREQUENCY_COUNT)
    plant_response, feedback_response = (_response(system, omega) for system in (plant, feedback))
    at_winches = _sensitivities(-feedback_response @ plant_response)
    at_sensors = _single(_sensitivities(-plant_response @ feedback_response))
    classical = [_classical_margins(1.0 / each - 1.0, omega, regulator.dt) for each in _single(at_winches)]
    gain, phase = (min(values) for values in zip(*classical, strict=True))
    return Margins(radius, _disk_margin(at_winches), float(1.0 / np.max(np.abs(at_sensors - 0.5))), gain, phase)


def margin_notes(plants: Sequence[LinearPlant], knots: Sequence[Knot]) -> tuple[str, ...]:
    """One line for each plant on which the loop of its controller has a disk margin below 0.1."""
    margins = [margins_of(plant, knot).min_disk for plant, knot in zip(plants, knots, strict=True)]
    return tuple(
        f"at [{format_position(plant.position)}] m: the loop has a disk margin of {margin:.2g}, below "
        f"{MIN_DISK_MARGIN:g}, so that small errors of the model unsettle it; where the winches hardly reach a mode, "
        "arrange the cables otherwise"
        for plant, margin in zip(plants, margins, strict=True)
        if margin < MIN_DISK_MARGIN
    )


def margins_over(
    robot: Robot,
    knots: Sequence[Knot],
    positions: Array,
    parameter_range: Range | None = None,
    points: int = 3,
    orientations: Array | None = None,
) -> Margins:
    """The worst margins over a range of robots, of each knot at its position (K, 3) in m, and orientation (K, 4).

    Raises what :func:`tautwire.linear.linearise` raises.
    """
    robots = [each for _, _, each in parameter_range.robots(robot, points)] if parameter_range else [robot]
    held = [None] * len(positions) if orientations is None else orientations.tolist()
    all_margins = [
        margins_of(linearise(each, position, 0.0, orientation), knot)
        for each in robots
        for knot, position, orientation in zip(knots, positions, held, strict=True)
    ]
    worst = all_margins[0]
    for other in all_margins[1:]:
        worst = worst.worst_of(other)
    return worst


def _response(system: Any, omega: Array) -> ComplexArray:
    """Frequency response (F, outputs, inputs)."""
    response: ComplexArray = np.moveaxis(system(np.exp(1j * omega * system.dt), squeeze=False), 2, 0)
    return response


def _sensitivities(loops: ComplexArray) -> ComplexArray:
    """Sensitivity ``(1 + L)^-1`` of loops (F, k, k) under negative feedback."""
    return np.asarray(np.linalg.inv(np.eye(loops.shape[1]) + loops), dtype=np.complex128)


def _single(sensitivities: ComplexArray) -> ComplexArray:
    """Sensitivity of each loop opened by itself, with the others closed, (k, F)."""
    return np.diagonal(sensitivities, axis1=1, axis2=2).T


def _disk_margin(sensitivities: ComplexArray) -> float:
    """Disk margin of all loops at once, by the largest structured singular value of ``S - 1/2``.

    The largest singular value is an upper bound of it, which rules out most frequencies.
    """
    count = sensitivities.shape[1]
    blocks, kinds = np.ones(count, dtype=int), np.full(count, COMPLEX_BLOCK)
    balanced = sensitivities - 0.5 * np.eye(count)
    bounds, largest = np.linalg.norm(balanced, ord=2, axis=(1, 2)), 0.0
    for index in np.argsort(-bounds):
        if bounds[index] <= largest:
            break
        largest = max(largest, float(ab13md(balanced[index], blocks, kinds)[0]))
    return 1.0 / largest


def _classical_margins(loop: ComplexArray, omega: Array, period: float) -> tuple[float, float]:
    """Smallest gain margin, as a factor above 1 in either direction, and phase margin in degrees."""
    gains, phases, *_ = control.stability_margins(control.frd(loop, omega, period), returnall=True)
    factors = np.maximum(gains, 1.0 / np.maximum(gains, np.finfo(float).tiny))
    return float(np.min(factors, initial=np.inf)), float(np.min(np.abs(phases), initial=np.inf))
