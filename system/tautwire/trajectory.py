"""Reference paths of the platform, and the winch speeds that follow them with inelastic cables."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import having, number_of, robot_of
from .array_arguments import array_of, point_of
from .errors import ArgumentError
from .robots.checked_table import NumberRule
from .robots.robot import Point, Robot
from .statics.equilibrium import directions as rope_directions
from .statics.equilibrium import has_routes

Array = NDArray[np.float64]

DURATION = NumberRule("how long the path takes", "s", positive=True)
RADIUS = NumberRule("the radius", "m", minimum=0.0)
RISE = NumberRule("the rise over the whole helix", "m")
ANGLE = NumberRule("the angle turned", "rad")


class Trajectory(Protocol):
    """A path over time; each method takes times (N,) in s and gives (N, 3), in m, m/s and m/s^2."""

    @property
    def duration(self) -> float:
        """When the end is reached, in s; the path rests there afterwards, and at its start before 0."""
        ...

    def position(self, times: Array) -> Array:
        """Where the platform shall be."""
        ...

    def velocity(self, times: Array) -> Array:
        """The rate of position."""
        ...

    def acceleration(self, times: Array) -> Array:
        """The rate of velocity."""
        ...


@dataclass(frozen=True)
class Line:
    """A straight line from rest at ``start`` to rest at ``end``, in m, within ``duration``, in s.

    ``p = start + s(t) (end - start)`` with the fifth-order law s of :func:`quintic_law`.

    Raises ArgumentError where a point is not three finite coordinates, or the duration is not above 0.
    """

    start: Point
    end: Point
    duration: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", point_of("Line: start", self.start))
        object.__setattr__(self, "end", point_of("Line: end", self.end))
        object.__setattr__(self, "duration", number_of("Line: duration", self.duration, DURATION))

    def position(self, times: Array) -> Array:
        """Where the platform shall be, (N, 3) in m."""
        return np.array(self.start) + np.outer(quintic_law(times, self.duration)[0], self._span)

    def velocity(self, times: Array) -> Array:
        """The rate of position, (N, 3) in m/s."""
        return np.outer(quintic_law(times, self.duration)[1], self._span)

    def acceleration(self, times: Array) -> Array:
        """The rate of velocity, (N, 3) in m/s^2."""
        return np.outer(quintic_law(times, self.duration)[2], self._span)

    @property
    def _span(self) -> Array:
        return np.array(self.end) - np.array(self.start)


@dataclass(frozen=True)
class Helix:
    """A helix about a vertical axis from rest to rest within ``duration``, in s.

    ``p = centre + (R cos q, R sin q, rise q / angle)``, ``q = angle s(t)`` with the fifth-order law s of
    :func:`quintic_law`; ``radius`` R and ``rise`` in m, ``angle`` in rad. Baklouti et al. 2017, Eqs. 13, 14.

    Raises ArgumentError where the centre is not three finite coordinates, the angle is 0, or a number breaks a bound.
    """

    centre: Point
    radius: float
    rise: float
    angle: float
    duration: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", point_of("Helix: centre", self.centre))
        for name, rule in (("radius", RADIUS), ("rise", RISE), ("angle", ANGLE), ("duration", DURATION)):
            object.__setattr__(self, name, number_of(f"Helix: {name}", getattr(self, name), rule))
        if self.angle == 0.0:
            raise ArgumentError("Helix: angle", 0.0, "is 0, which is no turn", "give another angle, or take a Line")

    def position(self, times: Array) -> Array:
        """Where the platform shall be, (N, 3) in m."""
        turned = self.angle * quintic_law(times, self.duration)[0]
        return np.array(self.centre) + self._columns(np.cos(turned), np.sin(turned), turned)

    def velocity(self, times: Array) -> Array:
        """The rate of position, (N, 3) in m/s."""
        turned, rate, _ = (self.angle * part for part in quintic_law(times, self.duration))
        return self._columns(-rate * np.sin(turned), rate * np.cos(turned), rate)

    def acceleration(self, times: Array) -> Array:
        """The rate of velocity, (N, 3) in m/s^2."""
        turned, rate, change = (self.angle * part for part in quintic_law(times, self.duration))
        return self._columns(
            -change * np.sin(turned) - rate**2 * np.cos(turned),
            change * np.cos(turned) - rate**2 * np.sin(turned),
            change,
        )

    def _columns(self, x: Array, y: Array, turned: Array) -> Array:
        return np.column_stack([self.radius * x, self.radius * y, self.rise / self.angle * turned])


# The printed coefficients turn three times and rise 9.4 m; the printed end point and figures need these.
PAPER_HELIX = Helix(centre=(23.86, 0.0, 5.0), radius=5.0, rise=15.0, angle=4.0 * pi, duration=50.0)
# The printed beta_2 = 0.1 m contradicts the printed start; z = 1 m is the start.
CAROCA_HELIX = Helix(centre=(0.0, 0.0, 1.0), radius=1.0, rise=0.12 * pi, angle=0.6 * pi, duration=4.0)


def quintic_law(times: Array, duration: float) -> tuple[Array, Array, Array]:
    """A rest-to-rest time law from 0 to 1 with its two derivatives in time.

    ``s = 6 f^5 - 15 f^4 + 10 f^3``, ``f = t / duration`` held within 0 and 1; speed and acceleration are zero
    at both ends.
    """
    f = np.clip(np.asarray(times, dtype=float) / duration, 0.0, 1.0)
    rest = 1.0 - f
    return (
        f**3 * (10.0 + f * (6.0 * f - 15.0)),
        30.0 * f**2 * rest**2 / duration,
        60.0 * f * rest * (rest - f) / duration**2,
    )


def cable_directions(robot: Robot, positions: Array) -> Array:
    """Unit vectors of the ropes at the platform; positions (N, 3) in m give (N, 3, n)."""
    if has_routes(robot):
        return np.array([rope_directions(robot, position) for position in np.asarray(positions, dtype=float)])
    spans = np.array(robot.anchors).T - np.asarray(positions, dtype=float)[:, :, None]
    directions: Array = spans / np.linalg.norm(spans, axis=1, keepdims=True)
    return directions


def ideal_winch_speeds(robot: Robot, trajectory: Trajectory, times: ArrayLike) -> Array:
    """Speeds that reel inelastic cables along a path, at ``times`` (N,) in s; positive reels in.

    ``V_i = -dl_i/dt = u_i . v``, shape (N, n), in m/s; ``u_i`` from the platform along the rope, ``v`` the velocity.

    Raises ArgumentError where an argument is none of these, a path of the user's gives anything but finite (N, 3), or
    the path leads through an exit point.
    """
    robot_of("ideal_winch_speeds: robot", robot)
    trajectory_of("ideal_winch_speeds: trajectory", trajectory)
    moments = array_of("ideal_winch_speeds: times", times, (None,), "finite times (N,) in s")
    place, velocity = (_along("ideal_winch_speeds", trajectory, name, moments) for name in ("position", "velocity"))
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = cable_directions(robot, place)
    speeds: Array = np.einsum("kai,ka->ki", unit, velocity)
    lost = np.argwhere(~np.isfinite(speeds))
    if len(lost):
        row, cable = lost[0]
        problem = f"has no winch speed of cable {cable + 1} at {moments[row]:g} s: it leads through the exit point"
        raise ArgumentError("ideal_winch_speeds: trajectory", trajectory, problem, "lead the path past all exit points")
    return speeds


def _along(where: str, trajectory: Trajectory, name: str, times: Array) -> Array:
    """What a path, maybe of the user's, is or does at times (N,): finite numbers (N, 3); raises ArgumentError."""
    meaning = f"a path whose {name}(times) has a finite row x, y, z for each of the {len(times)} times"
    return array_of(f"{where}: trajectory.{name}", getattr(trajectory, name)(times), (len(times), 3), meaning)


def trajectory_of(where: str, value: object) -> Trajectory:
    """The value if it is a path over time; raises ArgumentError."""
    names = ("duration", "position", "velocity", "acceleration")
    return cast(Trajectory, having(where, value, names, "path", "give a path, such as Line(start, end, duration)"))
