"""What every controller design has: weights, limits, sensor noise and gains at points of a path."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import control
import numpy as np
from numpy.typing import NDArray

from ..errors import ArgumentError, InputError
from ..linear import LinearPlant
from ..linear.operating_point import slack_cables
from ..robot.schema import AXES, Robot
from ..validation import NumberRule, validate_number

# Assumed if the robot file declares no sensors.
POSITION_NOISE = 1e-4
ORIENTATION_NOISE = 2e-4
TENSION_NOISE = 1.0
AIM_RULES = {
    "period": NumberRule("the sample period", "s", positive=True),
    "position": NumberRule("a deviation of position", "m", positive=True),
    "rotation": NumberRule("a deviation of orientation", "rad", positive=True),
    "tension": NumberRule("a share of the mean static tension", "", positive=True),
    "winch_speed": NumberRule("a winch speed", "m/s", positive=True),
    "winch_acceleration": NumberRule("a winch acceleration", "m/s^2", positive=True),
    "integral_time": NumberRule("a time", "s", positive=True),
    "speed_limit": NumberRule("the largest winch speed", "m/s", positive=True),
    "acceleration_disturbance": NumberRule("a wander of velocity", "m/s^2", positive=True),
    "angular_acceleration_disturbance": NumberRule("a wander of angular velocity", "rad/s^2", positive=True),
    "speed_disturbance": NumberRule("a wander of rope", "m/s", positive=True),
    "acceleration_limit": NumberRule("the largest winch acceleration", "m/s^2", positive=True),
    "lowest_tension": NumberRule("the minimum tension", "N", minimum=0.0),
    "highest_tension": NumberRule("the maximum tension", "N", positive=True),
    "yield_time": NumberRule("a time", "s", positive=True),
}
UNBOUNDED_KEYS = ("speed_limit", "acceleration_limit", "highest_tension")
OPTIONAL_KEYS = ("lowest_tension", "highest_tension")


class MarginError(InputError):
    """No controller of a design has the ``required`` disk margin; ``achieved`` is the best one."""

    def __init__(self, where: str, required: float, achieved: float, hint: str) -> None:
        super().__init__(where, f"a disk margin of {required:g} cannot be reached, the largest is {achieved:.3g}", hint)
        self.required = required
        self.achieved = achieved
        self.args = (where, required, achieved, hint)


class StretchError(InputError):
    """No winch speeds make the elastic model follow a path; ``time`` in s is where the inverse simulation failed."""

    def __init__(self, where: str, time: float, hint: str) -> None:
        super().__init__(where, f"no winch speeds were found that follow the path at {time:g} s", hint)
        self.time = time
        self.args = (where, time, hint)


Array = NDArray[np.float64]


@dataclass(frozen=True)
class ControlAim:
    """Weights and limits of a controller; weights are deviations of equal cost (Bryson's rule).

    ``period`` in s; ``position`` in m; ``rotation`` in rad, of a platform that turns; ``tension`` as a share of the
    mean static tension; ``winch_speed`` in m/s and ``winch_acceleration`` in m/s^2, beyond the ideal ones;
    ``integral_time`` in s, after which a lasting error of position costs as much.

    The observer expects velocity to wander by ``acceleration_disturbance`` (m/s^2), angular velocity by
    ``angular_acceleration_disturbance`` (rad/s^2) and rope by ``speed_disturbance`` (m/s) within a second. A larger
    ``speed_disturbance`` makes the loop more robust against a wrong modulus or payload, a smaller one calmer under
    noise (loop transfer recovery).

    Limits of every design: ``speed_limit`` in m/s and ``acceleration_limit`` in m/s^2 bound the commands of each winch,
    in addition to those of the robot file. No cable is let out below ``lowest_tension`` or reeled in above
    ``highest_tension``, in N; by default the bounds of the robot file's tension distribution, otherwise 0 and none. A
    cable beyond its limit yields such that its tension is back in about ``yield_time``, in s.

    With ``tare`` the run starts at rest, and the tensions measured there reveal an undeclared payload.

    Raises ArgumentError where a number is not finite or not above 0; limits may be infinite, the lowest tension 0.
    """

    period: float = 0.01
    position: float = 2e-3
    tension: float = 0.1
    winch_speed: float = 0.03
    winch_acceleration: float = 0.2
    integral_time: float = 0.35
    speed_limit: float = 3.0
    acceleration_disturbance: float = 0.2
    speed_disturbance: float = 0.03
    acceleration_limit: float = float("inf")
    lowest_tension: float | None = None
    highest_tension: float | None = None
    yield_time: float = 0.06
    tare: bool = True
    rotation: float = 4e-3
    angular_acceleration_disturbance: float = 0.4

    def __post_init__(self) -> None:
        for name, rule in AIM_RULES.items():
            value = getattr(self, name)
            if not (value is None and name in OPTIONAL_KEYS):
                validate_number(f"ControlAim: {name}", value, rule, allow_infinite=name in UNBOUNDED_KEYS)
        lowest, highest = self.lowest_tension, self.highest_tension
        if lowest is not None and highest is not None and lowest > highest:
            problem = f"is {lowest:g} N, above highest_tension, {highest:g} N"
            raise ArgumentError("ControlAim: lowest_tension", lowest, problem, "lower it, or raise the other")


def measurement_noise(robot: Robot, positive: bool = False) -> Array:
    """Standard deviation of one sample of x, y, z (m) and the tensions (N), shape (3 + n,), as declared or by default.

    Of a platform that turns those of the rotation about each axis (rad) follow the position, shape (6 + n,). With
    ``positive`` a declared zero is the default too: no Kalman filter has sensors without noise.
    """
    sensors, turning = robot.sensors, 3 if robot.platform.is_rigid_body else 0
    declared = (sensors.position_noise, sensors.orientation_noise, sensors.tension_noise)
    defaults = (POSITION_NOISE, ORIENTATION_NOISE, TENSION_NOISE)
    noise = [
        default if value is None or (positive and value == 0.0) else value
        for value, default in zip(declared, defaults, strict=True)
    ]
    return np.repeat(noise, [3, turning, robot.cable_count])


def require_taut(robot: Robot, linear: LinearPlant) -> None:
    """Refuses a plant with a slack cable, whose length no sensor tells; raises InputError."""
    slack = [str(index + 1) for index in slack_cables(linear.tensions)]
    if slack:
        problem = f"has no tension in cable {', '.join(slack)} where the controller is to be designed"
        hint = "choose a pose that holds all cables taut, or give [tension] a minimum"
        raise InputError(robot.name, problem, hint)


def integrated_freedoms(cable_count: int, degrees_of_freedom: int) -> int:
    """How many coordinates of the pose, in their order, feedback can hold at its reference: all, or the position.

    Fewer cables than degrees of freedom leave the orientation to statics.
    """
    return degrees_of_freedom if cable_count >= degrees_of_freedom else len(AXES)


@dataclass(frozen=True)
class Knot:
    """A point of a gain schedule at ``time`` (s) of the path; n cables, q states.

    ``regulator`` is a sampled ``control.StateSpace`` from deviations of pose, tensions and winch speeds from the path
    to winch accelerations; only winch speeds feed through. ``tracking`` (q, n) is the anti-windup gain: from the
    difference of actual and commanded acceleration to the state.
    """

    time: float
    regulator: Any
    tracking: Array


class Design(Protocol):
    """Interface of a designed controller."""

    @property
    def aim(self) -> ControlAim:
        """Sample period and limits."""
        ...

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        ...

    @property
    def uses_feedback(self) -> bool:
        """Whether it uses feedback from sensors."""
        ...

    def knots(self) -> tuple[Knot, ...]:
        """The points of the path at which it is designed; gains are interpolated in between."""
        ...


@dataclass(frozen=True)
class RegulatorDesign:
    """A sampled ``regulator`` with the anti-windup gain ``tracking`` (q, n), one for the whole path; as in Knot."""

    aim: ControlAim
    regulator: Any
    tracking: Array

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        return int(self.regulator.noutputs)

    @property
    def uses_feedback(self) -> bool:
        """See :class:`Design`."""
        return True

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`Design`."""
        return (Knot(0.0, self.regulator, self.tracking),)


@dataclass(frozen=True)
class Feedforward:
    """Pure feedforward: the winches get the reference speeds, within the speed limits."""

    cable_count: int
    aim: ControlAim = field(default_factory=ControlAim)

    @property
    def uses_feedback(self) -> bool:
        """See :class:`Design`."""
        return False

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`Design`; speed lost to a limit is made up for in the next sample."""
        count = self.cable_count
        feedthrough = np.hstack([np.zeros((count, 3 + count)), -np.eye(count) / self.aim.period])
        regulator = control.ss([], [], [], feedthrough, self.aim.period, **regulator_signals(count))
        return (Knot(0.0, regulator, np.zeros((0, count))),)


def regulator_signals(count: int, degrees_of_freedom: int = 3) -> dict[str, Any]:
    """Names of a regulator's inputs and outputs, and of the regulator."""
    numbers = range(1, count + 1)
    return {
        "inputs": [
            *pose_signals(degrees_of_freedom),
            *(f"{name}_{index}" for name in ("tension", "winch_speed") for index in numbers),
        ],
        "outputs": [f"winch_acceleration_{index}" for index in numbers],
        "name": "regulator",
    }


def pose_signals(degrees_of_freedom: int) -> list[str]:
    """Names of the measured deviations of a pose: position in m, and of a rigid body rotation in rad."""
    names = [f"{name}_{axis}" for name in ("position", "rotation") for axis in AXES]
    return names[:degrees_of_freedom]
