"""How much a loop can be changed before it rings or breaks: gain, phase and disk margins, by python-control.

A disk margin alpha holds for gain and phase together, in every loop that it is of at once: each may be multiplied by
any complex number in a disk around 1 that reaches from ``(2 - alpha) / (2 + alpha)`` to its inverse.

Source: Seiler, Packard and Gahinet (2020), An introduction to disk margins, IEEE Control Systems 40(5), 78-95.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant, linearise
from ..robots.robot import Robot
from .design import Knot
from .plant import ramp_plant

Array = NDArray[np.float64]

FREQUENCIES = 200
SLOWEST = 1e-3


@dataclass(frozen=True)
class Margins:
    """Margins of a closed loop; ``radius``, of its slowest pole, is below 1 if it is stable, else all margins are 0.

    Disk margins: ``winches`` of all winch speeds at once, ``sensors`` of one sensor, the worst. ``gain``, a factor,
    and ``phase`` in degrees are the smallest of one winch, the classical ones.
    """

    radius: float
    winches: float
    sensors: float
    gain: float
    phase: float

    @property
    def least(self) -> float:
        """The smaller of the disk margins."""
        return min(self.winches, self.sensors)

    @property
    def disk_gain(self) -> float:
        """The factor by which all winches' gains may grow or shrink at once."""
        return float("inf") if self.winches >= 2.0 else (2.0 + self.winches) / (2.0 - self.winches)

    @property
    def disk_phase(self) -> float:
        """The phase, in degrees, that all winches may lose at once."""
        return float(2.0 * np.rad2deg(np.arctan(0.5 * self.winches)))

    def worst(self, other: Margins) -> Margins:
        """Of two loops, margin by margin."""
        return Margins(
            max(self.radius, other.radius),
            min(self.winches, other.winches),
            min(self.sensors, other.sensors),
            min(self.gain, other.gain),
            min(self.phase, other.phase),
        )


@dataclass(frozen=True)
class Range:
    """What is not known of a robot: ``moduli`` in Pa and payloads, as shares of the declared mass, from ... to."""

    moduli: tuple[float, float] = (102e9, 135e9)
    payloads: tuple[float, float] = (0.8, 1.2)

    @classmethod
    def of(cls, robot: Robot) -> Range:
        """Around a robot: the paper's rope from its static to its dynamic modulus, another rope by the same shares."""
        moduli = [cable.modulus for cable in robot.cables]
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
    """The robot with another modulus (Pa) of all cables, and its mass multiplied."""
    cables = tuple(replace(cable, modulus=modulus) for cable in robot.cables)
    return replace(robot, cables=cables, platform=replace(robot.platform, mass=payload * robot.platform.mass))


def speed_controller(regulator: Any) -> Any:
    """A regulator with its winches: from position and tensions to the winch speeds, a ``control.StateSpace``."""
    count, sensors = regulator.noutputs, regulator.ninputs - regulator.noutputs
    period, states = regulator.dt, regulator.nstates
    through = regulator.D[:, sensors:]
    return control.ss(
        np.block([[regulator.A, regulator.B[:, sensors:]], [period * regulator.C, np.eye(count) + period * through]]),
        np.vstack([regulator.B[:, :sensors], period * regulator.D[:, :sensors]]),
        np.eye(count, states + count, states),
        np.zeros((count, sensors)),
        period,
        inputs=regulator.input_labels[:sensors],
        outputs=regulator.input_labels[sensors:],
        name="speed_controller",
    )


def margins_of(linear: LinearPlant, knot: Knot) -> Margins:
    """Margins of a controller on a plant; of one that feels nothing they are infinite, it closes no loop."""
    regulator = knot.regulator
    if not np.any(regulator.B[:, : regulator.ninputs - regulator.noutputs]):
        return Margins(0.0, *[float("inf")] * 4)
    plant, feedback = ramp_plant(linear, regulator.dt), speed_controller(regulator)
    radius = float(np.max(np.abs(control.feedback(plant, feedback, 1).poles())))
    if radius >= 1.0:
        return Margins(radius, 0.0, 0.0, 0.0, 0.0)
    fastest = np.pi / regulator.dt
    omega = np.geomspace(SLOWEST * fastest, 0.999 * fastest, FREQUENCIES)
    at_winches, at_sensors = -feedback * plant, -plant * feedback
    together = _disk(at_winches, omega)
    alone = [_disk(loop, omega) for loop in _loops(at_sensors)]
    classical = [_classical(loop, omega) for loop in _loops(at_winches)]
    gain, phase = (min(values) for values in zip(*classical, strict=True))
    return Margins(radius, together, min(alone), gain, phase)


def margins_over(
    robot: Robot, knots: Sequence[Knot], positions: Array, uncertain: Range | None = None, points: int = 3
) -> Margins:
    """The worst margins over a range of robots, of each knot at its position (K, 3) in m.

    Raises what :func:`tautwire.linear.linearise` raises.
    """
    robots = [each for _, _, each in uncertain.robots(robot, points)] if uncertain else [robot]
    found = [
        margins_of(linearise(each, position), knot)
        for each in robots
        for knot, position in zip(knots, positions, strict=True)
    ]
    worst = found[0]
    for other in found[1:]:
        worst = worst.worst(other)
    return worst


def _loops(loop: Any) -> Iterator[Any]:
    """Each loop by itself, the others closed."""
    count = loop.ninputs
    for index in range(count):
        others = np.eye(count)
        others[index, index] = 0.0
        yield control.feedback(loop, control.ss([], [], [], others, loop.dt))[index, index]


def _disk(loop: Any, omega: Array) -> float:
    return float(control.disk_margins(loop, omega)[0])


def _classical(loop: Any, omega: Array) -> tuple[float, float]:
    """Smallest gain margin, as a factor above 1 in either direction, and phase margin in degrees."""
    response = control.frequency_response(loop, omega)
    gains, phases, *_ = control.stability_margins(response, returnall=True)
    factors = np.maximum(gains, 1.0 / np.maximum(gains, np.finfo(float).tiny))
    return float(np.min(factors, initial=np.inf)), float(np.min(np.abs(phases), initial=np.inf))
