"""A controller that keeps its margins over a range of moduli and payloads: H-infinity loop shaping.

The loop is as fast as the margins allow: of several bandwidths the largest is kept at which the worst disk margin
over the whole range, of all winches at once and of each sensor alone, is what was asked for. Along a path designs at
its places follow each other: their states are estimates of the same quantities, so gains can be interpolated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant, linearise
from ..robots.robot import Robot
from ..trajectory import Trajectory
from .aim import ControlAim
from .design import Knot, regulator_signals
from .errors import MarginError
from .loop_shaping import shaped_controller
from .margins import Margins, Range, margins_of
from .plant import ramp_plant
from .schedule import PLACES, ScheduledController

Array = NDArray[np.float64]

# Of the lowest mode, from fast to slow.
BANDWIDTHS = (1.6, 1.2, 0.9, 0.65, 0.48, 0.35, 0.26, 0.19, 0.14, 0.1)
# Between sensing and the end of the ramp that answers: one sample for computing, one for the ramp.
DELAY = 2
# How much faster than they act the integrals give way where a limit acts.
YIELDING = 3.0


@dataclass(frozen=True)
class RobustAim:
    """``margin`` is the disk margin to keep; 2/3 allows a factor of 2 in gain and 37 degrees of phase, at once.

    As multiples of the lowest mode's angular frequency: ``damping``, the rate at which a cable gives way to its own
    tension, and ``integral``, where the integral action of position sets in.
    """

    margin: float = 2.0 / 3.0
    damping: float = 1.0
    integral: float = 0.2


@dataclass(frozen=True)
class RobustController:
    """A robust controller with q states, the first three of which are integrals of position.

    ``linear`` is the plant in the middle of the range; ``regulator`` and ``tracking`` (q, n) are as in :class:`Knot`;
    ``bandwidth``, that of position, is a multiple of the lowest mode; ``margins`` are the worst over the range.
    """

    aim: ControlAim
    linear: LinearPlant
    regulator: Any
    tracking: Array
    bandwidth: float
    margins: Margins

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        return int(self.regulator.noutputs)

    @property
    def feels(self) -> bool:
        """See :class:`tautwire.control.Design`."""
        return True

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`tautwire.control.Design`; one for the whole path."""
        return (Knot(0.0, self.regulator, self.tracking),)


def design_robust(
    robot: Robot,
    aim: ControlAim | None = None,
    uncertain: Range | None = None,
    robust: RobustAim | None = None,
    at: Sequence[float] | None = None,
) -> RobustController:
    """The fastest loop whose margins hold over a range, at a position (m), by default the start.

    The range is :meth:`Range.of` the robot where none is given.

    Raises MarginError where none does, and what :func:`tautwire.linear.linearise` raises.
    """
    start = robot.platform.start if at is None else at
    (design,) = _fastest(
        robot, np.array([start]), aim or ControlAim(), uncertain or Range.of(robot), robust or RobustAim()
    )
    return design


def schedule_robust(
    robot: Robot,
    trajectory: Trajectory,
    aim: ControlAim | None = None,
    uncertain: Range | None = None,
    robust: RobustAim | None = None,
    places: int = PLACES,
) -> ScheduledController:
    """As :func:`design_robust`, at equally many times of a path, from its start to its end.

    Raises MarginError where none does, and what :func:`tautwire.linear.linearise` raises.
    """
    times = np.linspace(0.0, trajectory.duration, places)
    positions = trajectory.position(times)
    designs = _fastest(robot, positions, aim or ControlAim(), uncertain or Range.of(robot), robust or RobustAim())
    return ScheduledController(tuple(times.tolist()), tuple(designs))


def _fastest(
    robot: Robot, positions: Array, aim: ControlAim, uncertain: Range, robust: RobustAim
) -> list[RobustController]:
    """Designs of one bandwidth at all positions, the largest at which all keep their margin."""
    middles = [linearise(uncertain.middle(robot), position) for position in positions]
    plants = [[linearise(each, position) for _, _, each in uncertain.robots(robot)] for position in positions]
    reached = 0.0
    for bandwidth in BANDWIDTHS:
        found: list[RobustController] = []
        for middle, around in zip(middles, plants, strict=True):
            design = _design(robot, middle, around, aim, robust, bandwidth)
            if design.margins.least < robust.margin:
                reached = max(reached, design.margins.least)
                break
            found.append(design)
        else:
            return found
    raise MarginError(robot.name, robust.margin, reached, "ask for less, narrow the range, or sample faster")


def _design(
    robot: Robot,
    linear: LinearPlant,
    plants: Sequence[LinearPlant],
    aim: ControlAim,
    robust: RobustAim,
    bandwidth: float,
) -> RobustController:
    """A design with its worst margins on some plants, or on the first of them that fall short."""
    regulator = _regulator(robot, linear, aim.period, bandwidth, robust)
    tracking = back_calculation(regulator, YIELDING * robust.integral * _lowest(linear) * aim.period)
    knot = Knot(0.0, regulator, tracking)
    worst = margins_of(plants[0], knot)
    for plant in plants[1:]:
        if worst.least < robust.margin:
            break
        worst = worst.worst(margins_of(plant, knot))
    return RobustController(aim, linear, regulator, tracking, bandwidth, worst)


def back_calculation(regulator: Any, share: float) -> Array:
    """What the integrals make of a limit, (q, n): a ``share`` of what lets the speed asked for be the one given.

    The other states of the regulator forget by themselves.
    """
    count = regulator.noutputs
    others = slice(3, regulator.nstates - count)
    asks = regulator.A[-count:]
    settled = np.linalg.solve(np.eye(others.stop - 3) - regulator.A[others, others], regulator.A[others, :3])
    lasting = asks[:, :3] + asks[:, others] @ settled
    gain = np.zeros((regulator.nstates, count))
    gain[:3] = share * regulator.dt * np.linalg.pinv(lasting)
    return gain


def _lowest(linear: LinearPlant) -> float:
    """Angular frequency of the lowest mode, in rad/s."""
    return 2.0 * np.pi * float(linear.modes.frequencies[0])


def _regulator(robot: Robot, linear: LinearPlant, period: float, bandwidth: float, robust: RobustAim) -> Any:
    """One loop shape: scale position and tensions, close, and let the winches run as asked two samples later."""
    count = len(linear.tensions)
    lowest = _lowest(linear)
    lengths = np.linalg.norm(np.array(robot.anchors) - linear.position, axis=1)
    stiffness = float(np.mean([cable.modulus * cable.area for cable in robot.cables] / lengths))
    rates = np.repeat([bandwidth * lowest, robust.damping * lowest / stiffness], [3, count])
    plant = ramp_plant(linear, period)
    scaled = control.ss(plant.A, plant.B, rates[:, None] * plant.C, rates[:, None] * plant.D, period)
    # Position also by its integral: (s + w) / s.
    corner = robust.integral * lowest
    places = np.eye(3 + count, 3)
    weights = control.ss(np.zeros((3, 3)), corner * places.T, places, np.eye(3 + count))
    found = shaped_controller(scaled * _delay(count, period), weights)
    return _as_regulator(control.ss(found.A, found.B * rates, found.C, found.D * rates, period), count)


def _delay(count: int, period: float) -> Any:
    """Each of some signals, DELAY samples late."""
    nothing = np.zeros((count, count))
    once = control.ss(nothing, np.eye(count), np.eye(count), nothing, period)
    late = once
    for _ in range(DELAY - 1):
        late = late * once
    return late


def _as_regulator(found: Any, count: int) -> Any:
    """A controller whose output is the speed of two samples later, as accelerations of the next sample.

    The speed for the sample's end was found one sample ago and is part of the state.
    """
    size, sensors, period = found.nstates, found.ninputs, found.dt
    each, none = np.eye(count) / period, np.zeros
    return control.ss(
        np.block([[found.A, none((size, count))], [found.C, none((count, count))]]),
        np.block([[found.B, none((size, count))], [found.D, none((count, count))]]),
        np.hstack([none((count, size)), each]),
        np.hstack([none((count, sensors)), -each]),
        period,
        **regulator_signals(count),
    )
