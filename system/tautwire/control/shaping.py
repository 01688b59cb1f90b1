"""Input shaping: a reference given in impulses that cancel the swing which each of them starts.

For moves where no sensor looks. Impulses ``A_j`` at ``t_j``, which sum to 1, make of a reference r the shaped one
``sum A_j r(t - t_j)``. They stand at half periods of the damped mode; with ``K = exp(-zeta pi / sqrt(1 - zeta^2))``:

    ZV    A ~ 1, K                            no residual swing at the frequency itself
    ZVD   A ~ 1, 2 K, K^2                     nor a slope of it there
    EI    A ~ 1 + V, 2 (1 - V) K, (1 + V) K^2   a swing of V there, and none at two frequencies beside it

Sources: Singer and Seering (1990), ASME Journal of Dynamic Systems, Measurement and Control 112(1), 76-82; Singhose,
Seering and Singer (1994), ASME Journal of Mechanical Design 116(3), 654-659, for EI.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ..errors import InputError
from ..linear import modes_along
from ..robots.robot import Robot
from ..trajectory import Trajectory

Array = NDArray[np.float64]
Kind = Literal["ZV", "ZVD", "EI"]
_Moved = tuple[Array, Array, Array]
_Late = Callable[[Callable[[Array], Array], Array], Array]

TOLERATED = 0.05
PLACES = 9


@dataclass(frozen=True)
class Shaper:
    """Impulses: ``amplitudes`` (J,), which sum to 1, at ``delays`` (J,) in s."""

    amplitudes: Array
    delays: Array

    def __mul__(self, other: Shaper) -> Shaper:
        """Both in series, for two modes at once."""
        return Shaper(
            np.outer(self.amplitudes, other.amplitudes).ravel(), np.add.outer(self.delays, other.delays).ravel()
        )

    def residual(self, frequency: Array | float, damping_ratio: float = 0.0) -> Array:
        """Swing that is left, as a share of that after one impulse; frequency in Hz, undamped.

        ``|sum A_j exp(s (t_J - t_j))|``, s the eigenvalue; of the last impulse on, Singer and Seering Eq. 5.
        """
        omega = 2.0 * np.pi * np.asarray(frequency, dtype=float)[..., None]
        s = omega * (-damping_ratio + 1j * np.sqrt(1.0 - damping_ratio**2))
        left: Array = np.abs(np.sum(self.amplitudes * np.exp(s * (np.max(self.delays) - self.delays)), axis=-1))
        return left


def shaper(frequency: float, damping_ratio: float = 0.0, kind: Kind = "ZV", tolerated: float = TOLERATED) -> Shaper:
    """A shaper for one mode: ``frequency`` in Hz, undamped; ``tolerated`` is the V of EI, as a share.

    Raises InputError where the kind is unknown.
    """
    root = np.sqrt(1.0 - damping_ratio**2)
    outer, inner = 1.0 + tolerated, 2.0 - 2.0 * tolerated
    patterns = {"ZV": [1.0, 1.0], "ZVD": [1.0, 2.0, 1.0], "EI": [outer, inner, outer]}
    if kind not in patterns:
        raise InputError("kind", f"{kind!r} is no shaper", f"choose among {', '.join(patterns)}")
    pattern = np.array(patterns[kind])
    places = np.arange(len(pattern))
    amplitudes = pattern * np.exp(-damping_ratio * np.pi / root) ** places
    return Shaper(amplitudes / np.sum(amplitudes), 0.5 * places / (frequency * root))


def shaper_for_modes(frequencies: Array, damping_ratios: Array, kind: Kind = "ZV") -> Shaper:
    """A shaper for several modes at once, one a mode in series."""
    singles = [shaper(f, zeta, kind) for f, zeta in zip(frequencies.tolist(), damping_ratios.tolist(), strict=True)]
    return reduce(Shaper.__mul__, singles)


@dataclass(frozen=True)
class ShapedTrajectory:
    """A path under a shaper that changes along it: ``p(t) = sum A_j(t) q(t - t_j(t))``, q the path as it was.

    Amplitudes and delays run on cubic splines through those at K ``times`` (s): ``amplitudes`` and ``delays`` (K, J).
    Before the first and after the last time they stay. A straight line stays one; corners and curves are cut.
    """

    trajectory: Trajectory
    times: Array
    amplitudes: Array
    delays: Array

    @property
    def duration(self) -> float:
        """When the end is reached, in s."""
        return self.trajectory.duration + float(np.max(self.delays))

    def position(self, times: Array) -> Array:
        """Where the platform shall be, (N, 3) in m."""
        (A, *_), (d, *_), q = self._parts(times)
        return np.einsum("kj,kja->ka", A, q(self.trajectory.position, d))

    def velocity(self, times: Array) -> Array:
        """The rate of position, (N, 3) in m/s."""
        (A, dA, _), (d, dd, _), q = self._parts(times)
        p, v = q(self.trajectory.position, d), q(self.trajectory.velocity, d)
        return np.einsum("kj,kja->ka", dA, p) + np.einsum("kj,kja->ka", A * (1.0 - dd), v)

    def acceleration(self, times: Array) -> Array:
        """The rate of velocity, (N, 3) in m/s^2."""
        (A, dA, ddA), (d, dd, ddd), q = self._parts(times)
        p, v, a = (q(f, d) for f in (self.trajectory.position, self.trajectory.velocity, self.trajectory.acceleration))
        pace = 1.0 - dd
        return (
            np.einsum("kj,kja->ka", ddA, p)
            + np.einsum("kj,kja->ka", 2.0 * dA * pace - A * ddd, v)
            + np.einsum("kj,kja->ka", A * pace**2, a)
        )

    def _parts(self, times: Array) -> tuple[_Moved, _Moved, _Late]:
        """Amplitudes and delays with two derivatives, each (N, J), and what takes a function of the late times."""
        now = np.asarray(times, dtype=float)

        def late(function: Callable[[Array], Array], delays: Array) -> Array:
            return function((now[:, None] - delays).ravel()).reshape(*delays.shape, 3)

        return self._moved(self.amplitudes, now), self._moved(self.delays, now), late

    def _moved(self, values: Array, times: Array) -> _Moved:
        if len(self.times) == 1:
            still = np.zeros((len(times), values.shape[1]))
            return still + values[0], still, still
        curve = CubicSpline(self.times, values, bc_type="clamped")
        within = (times >= self.times[0]) & (times <= self.times[-1])
        held = np.clip(times, self.times[0], self.times[-1])
        return curve(held), within[:, None] * curve(held, 1), within[:, None] * curve(held, 2)


def shaped(trajectory: Trajectory, impulses: Shaper) -> ShapedTrajectory:
    """A path under one shaper all along."""
    return ShapedTrajectory(trajectory, np.zeros(1), impulses.amplitudes[None], impulses.delays[None])


def shape_along(robot: Robot, trajectory: Trajectory, kind: Kind = "ZV", places: int = PLACES) -> ShapedTrajectory:
    """A path under shapers for all three modes as they are where the platform then is.

    Raises what :func:`tautwire.linear.modes_along` raises.
    """
    times = np.linspace(0.0, trajectory.duration, places)
    modes = modes_along(robot, trajectory, times)
    shapers = [shaper_for_modes(f, z, kind) for f, z in zip(modes.frequencies, modes.damping_ratios, strict=True)]
    delays = np.array([each.delays for each in shapers])
    amplitudes = np.array([each.amplitudes for each in shapers])
    # Half of the impulses are out when the platform is there.
    return ShapedTrajectory(trajectory, times + 0.5 * np.max(delays, axis=1), amplitudes, delays)
