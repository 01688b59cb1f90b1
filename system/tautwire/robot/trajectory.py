"""Reference paths of the platform: the interface, straight lines and helices from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from ..array_validation import validate_point
from ..errors import ArgumentError
from ..validation import NumberRule, validate_attributes, validate_number
from .schema import Point

Array = NDArray[np.float64]

DURATION_RULE = NumberRule("the duration of the path", "s", positive=True)
RADIUS_RULE = NumberRule("the radius", "m", minimum=0.0)
RISE_RULE = NumberRule("the rise over the whole helix", "m")
ANGLE_RULE = NumberRule("the angle turned", "rad")


class Trajectory(Protocol):
    """Interface of a trajectory: each method takes times (N,) in s and returns (N, 3), in m, m/s and m/s^2."""

    @property
    def duration(self) -> float:
        """Time of arrival in s; the trajectory rests at its end afterwards, and at its start before 0."""
        ...

    def position(self, times: Array) -> Array:
        """Reference position."""
        ...

    def velocity(self, times: Array) -> Array:
        """Reference velocity."""
        ...

    def acceleration(self, times: Array) -> Array:
        """Reference acceleration."""
        ...


@dataclass(frozen=True)
class Line:
    """A straight rest-to-rest trajectory from ``start`` to ``end``, in m, within ``duration``, in s.

    ``p = start + s(t) (end - start)`` with the fifth-order law s of :func:`quintic_law`.

    Raises ArgumentError where a point is not three finite coordinates, or the duration is not above 0.
    """

    start: Point
    end: Point
    duration: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", validate_point("Line: start", self.start))
        object.__setattr__(self, "end", validate_point("Line: end", self.end))
        object.__setattr__(self, "duration", validate_number("Line: duration", self.duration, DURATION_RULE))

    def position(self, times: Array) -> Array:
        """Reference position, (N, 3) in m."""
        return np.array(self.start) + np.outer(quintic_law(times, self.duration)[0], self._span)

    def velocity(self, times: Array) -> Array:
        """Reference velocity, (N, 3) in m/s."""
        return np.outer(quintic_law(times, self.duration)[1], self._span)

    def acceleration(self, times: Array) -> Array:
        """Reference acceleration, (N, 3) in m/s^2."""
        return np.outer(quintic_law(times, self.duration)[2], self._span)

    @property
    def _span(self) -> Array:
        return np.array(self.end) - np.array(self.start)


@dataclass(frozen=True)
class Helix:
    """A rest-to-rest trajectory along a helix about a vertical axis, within ``duration``, in s.

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
        object.__setattr__(self, "centre", validate_point("Helix: centre", self.centre))
        for name, rule in (
            ("radius", RADIUS_RULE),
            ("rise", RISE_RULE),
            ("angle", ANGLE_RULE),
            ("duration", DURATION_RULE),
        ):
            object.__setattr__(self, name, validate_number(f"Helix: {name}", getattr(self, name), rule))
        if self.angle == 0.0:
            raise ArgumentError(
                "Helix: angle", 0.0, "is 0, but a helix must turn", "give another angle, or take a Line"
            )

    def position(self, times: Array) -> Array:
        """Reference position, (N, 3) in m."""
        angles = self.angle * quintic_law(times, self.duration)[0]
        return np.array(self.centre) + self._columns(np.cos(angles), np.sin(angles), angles)

    def velocity(self, times: Array) -> Array:
        """Reference velocity, (N, 3) in m/s."""
        angles, angular_rate, _ = (self.angle * part for part in quintic_law(times, self.duration))
        return self._columns(-angular_rate * np.sin(angles), angular_rate * np.cos(angles), angular_rate)

    def acceleration(self, times: Array) -> Array:
        """Reference acceleration, (N, 3) in m/s^2."""
        angles, angular_rate, angular_acceleration = (self.angle * part for part in quintic_law(times, self.duration))
        return self._columns(
            -angular_acceleration * np.sin(angles) - angular_rate**2 * np.cos(angles),
            angular_acceleration * np.cos(angles) - angular_rate**2 * np.sin(angles),
            angular_acceleration,
        )

    def _columns(self, x: Array, y: Array, angles: Array) -> Array:
        return np.column_stack([self.radius * x, self.radius * y, self.rise / self.angle * angles])


# The printed coefficients turn three times and rise 9.4 m; the printed end point and figures need these.
PAPER_HELIX = Helix(centre=(23.86, 0.0, 5.0), radius=5.0, rise=15.0, angle=4.0 * pi, duration=50.0)
# The printed beta_2 = 0.1 m contradicts the printed start; z = 1 m is the start.
CAROCA_HELIX = Helix(centre=(0.0, 0.0, 1.0), radius=1.0, rise=0.12 * pi, angle=0.6 * pi, duration=4.0)


def quintic_law(times: Array, duration: float) -> tuple[Array, Array, Array]:
    """Quintic rest-to-rest time law from 0 to 1, with its first two time derivatives.

    ``s = 6 f^5 - 15 f^4 + 10 f^3``, ``f = t / duration`` clipped to 0 and 1; speed and acceleration are zero
    at both ends.
    """
    fraction = np.clip(np.asarray(times, dtype=float) / duration, 0.0, 1.0)
    remainder = 1.0 - fraction
    return (
        fraction**3 * (10.0 + fraction * (6.0 * fraction - 15.0)),
        30.0 * fraction**2 * remainder**2 / duration,
        60.0 * fraction * remainder * (remainder - fraction) / duration**2,
    )


def require_trajectory(where: str, value: object) -> Trajectory:
    """Returns the value if it is a trajectory; raises ArgumentError."""
    names = ("duration", "position", "velocity", "acceleration")
    return cast(
        Trajectory, validate_attributes(where, value, names, "path", "give a path, such as Line(start, end, duration)")
    )
