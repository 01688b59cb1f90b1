"""Input shaping: impulses that cancel the vibration which each of them excites.

For moves without feedback. Impulses ``A_j`` at ``t_j``, which sum to 1, make of a reference r the shaped one
``sum A_j r(t - t_j)``. They stand at half periods of the damped mode; with ``K = exp(-zeta pi / sqrt(1 - zeta^2))``:

    ZV    A ~ 1, K                            no residual vibration at the frequency itself
    ZVD   A ~ 1, 2 K, K^2                     nor a slope of it there
    EI    A ~ 1 + V, 2 (1 - V) K, (1 + V) K^2   a vibration of V there, and none at two frequencies beside it

Sources: Singer and Seering (1990), ASME Journal of Dynamic Systems, Measurement and Control 112(1), 76-82; Singhose,
Seering and Singer (1994), ASME Journal of Mechanical Design 116(3), 654-659, for EI.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ..errors import InputError, describe_value
from ..linear import linearise, modes_along
from ..linear.modes_along_path import ModesAlong
from ..robot.pose_path import pose_path, sample_poses
from ..robot.pose_trajectory import OrientationTrajectory, PoseTrajectory, turns
from ..robot.schema import Robot
from ..robot.trajectory import Trajectory

Array = NDArray[np.float64]
ShaperKind = Literal["ZV", "ZVD", "EI"]
_WithDerivatives = tuple[Array, Array, Array]
_DelayedEvaluation = Callable[[Callable[[Array], Array], Array], Array]

EI_TOLERATED_VIBRATION = 0.05
SHAPER_POINTS = 9
# Of the largest residual vibration: a mode with less is left as it is.
MIN_RESIDUAL_SHARE = 0.02
SAMPLES_PER_PERIOD = 20


@dataclass(frozen=True)
class Shaper:
    """An input shaper: impulses of ``amplitudes`` (J,), which sum to 1, at ``delays`` (J,) in s."""

    amplitudes: Array
    delays: Array

    def __mul__(self, other: Shaper) -> Shaper:
        """Both shapers in series, for two modes at once."""
        return Shaper(
            np.outer(self.amplitudes, other.amplitudes).ravel(), np.add.outer(self.delays, other.delays).ravel()
        )

    def residual_vibration(self, frequency: Array | float, damping_ratio: float = 0.0) -> Array:
        """Residual vibration relative to that after one impulse; undamped frequency in Hz.

        ``|sum A_j exp(s (t_J - t_j))|``, s the eigenvalue; from the last impulse on, Singer and Seering Eq. 5.
        """
        omega = 2.0 * np.pi * np.asarray(frequency, dtype=float)[..., None]
        s = omega * (-damping_ratio + 1j * np.sqrt(1.0 - damping_ratio**2))
        vibration: Array = np.abs(np.sum(self.amplitudes * np.exp(s * (np.max(self.delays) - self.delays)), axis=-1))
        return vibration


def shaper(
    frequency: float,
    damping_ratio: float = 0.0,
    kind: ShaperKind = "ZV",
    tolerated_vibration: float = EI_TOLERATED_VIBRATION,
) -> Shaper:
    """A shaper for one mode: undamped ``frequency`` in Hz; ``tolerated_vibration`` is the V of EI, relative.

    Raises InputError where the kind is unknown, or the mode does not swing: its damping ratio is 1 or more.
    """
    if not damping_ratio < 1.0:
        raise InputError("damping_ratio", f"is {damping_ratio:g}, with which no mode swings", "give one below 1")
    _require_kind(kind)
    damped_ratio = np.sqrt(1.0 - damping_ratio**2)
    outer, inner = 1.0 + tolerated_vibration, 2.0 - 2.0 * tolerated_vibration
    patterns = {"ZV": [1.0, 1.0], "ZVD": [1.0, 2.0, 1.0], "EI": [outer, inner, outer]}
    pattern = np.array(patterns[kind])
    indices = np.arange(len(pattern))
    amplitudes = pattern * np.exp(-damping_ratio * np.pi / damped_ratio) ** indices
    return Shaper(amplitudes / np.sum(amplitudes), 0.5 * indices / (frequency * damped_ratio))


def _require_kind(kind: str) -> None:
    if kind not in get_args(ShaperKind):
        hint = f"choose among {', '.join(get_args(ShaperKind))}"
        raise InputError("kind", f"{kind!r} is not a known shaper", hint)


def shaper_for_modes(frequencies: Array, damping_ratios: Array, kind: ShaperKind = "ZV") -> Shaper:
    """A shaper for several modes at once, one per mode in series; of no mode one impulse at once."""
    _require_kind(kind)
    if not len(frequencies):
        return Shaper(np.ones(1), np.zeros(1))
    singles = [shaper(f, zeta, kind) for f, zeta in zip(frequencies.tolist(), damping_ratios.tolist(), strict=True)]
    return reduce(Shaper.__mul__, singles)


@dataclass(frozen=True)
class ShapedTrajectory:
    """A trajectory under a time-varying shaper: ``p(t) = sum A_j(t) q(t - t_j(t))``, q the original trajectory.

    Amplitudes and delays are cubic splines through those at K ``times`` (s): ``amplitudes`` and ``delays`` (K, J).
    Before the first and after the last time they are constant. A straight line stays one; corners and curves are cut.
    """

    trajectory: Trajectory
    times: Array
    amplitudes: Array
    delays: Array

    @property
    def duration(self) -> float:
        """Time of arrival in s."""
        return self.trajectory.duration + float(np.max(self.delays))

    def position(self, times: Array) -> Array:
        """Reference position, (N, 3) in m."""
        (A, *_), (d, *_), q = self._delayed_parts(times)
        return np.einsum("kj,kja->ka", A, q(self.trajectory.position, d))

    def velocity(self, times: Array) -> Array:
        """Reference velocity, (N, 3) in m/s."""
        (A, dA, _), (d, dd, _), q = self._delayed_parts(times)
        p, v = q(self.trajectory.position, d), q(self.trajectory.velocity, d)
        return np.einsum("kj,kja->ka", dA, p) + np.einsum("kj,kja->ka", A * (1.0 - dd), v)

    def acceleration(self, times: Array) -> Array:
        """Reference acceleration, (N, 3) in m/s^2."""
        (A, dA, ddA), (d, dd, ddd), q = self._delayed_parts(times)
        p, v, a = (q(f, d) for f in (self.trajectory.position, self.trajectory.velocity, self.trajectory.acceleration))
        time_rate = 1.0 - dd
        return (
            np.einsum("kj,kja->ka", ddA, p)
            + np.einsum("kj,kja->ka", 2.0 * dA * time_rate - A * ddd, v)
            + np.einsum("kj,kja->ka", A * time_rate**2, a)
        )

    def _delayed_parts(self, times: Array) -> tuple[_WithDerivatives, _WithDerivatives, _DelayedEvaluation]:
        """Amplitudes and delays with two derivatives, each (N, J), and the evaluation at delayed times."""
        evaluation_times = np.asarray(times, dtype=float)

        def evaluate_delayed(function: Callable[[Array], Array], delays: Array) -> Array:
            return function((evaluation_times[:, None] - delays).ravel()).reshape(*delays.shape, 3)

        return (
            self._interpolate(self.amplitudes, evaluation_times),
            self._interpolate(self.delays, evaluation_times),
            evaluate_delayed,
        )

    def _interpolate(self, values: Array, times: Array) -> _WithDerivatives:
        if len(self.times) == 1:
            zeros = np.zeros((len(times), values.shape[1]))
            return zeros + values[0], zeros, zeros
        curve = CubicSpline(self.times, values, bc_type="clamped")
        within = (times >= self.times[0]) & (times <= self.times[-1])
        clipped = np.clip(times, self.times[0], self.times[-1])
        return curve(clipped), within[:, None] * curve(clipped, 1), within[:, None] * curve(clipped, 2)


def shaped(trajectory: Trajectory, impulses: Shaper) -> ShapedTrajectory | PoseTrajectory:
    """A trajectory under one constant shaper; of one that turns, both translation and rotation.

    Raises InputError where a trajectory turns and is no :class:`tautwire.robot.pose_trajectory.PoseTrajectory`.
    """
    return _shaped_pose(trajectory, np.zeros(1), impulses.amplitudes[None], impulses.delays[None])


def shape_along(
    robot: Robot, trajectory: Trajectory, kind: ShaperKind = "ZV", points: int = SHAPER_POINTS
) -> ShapedTrajectory | PoseTrajectory:
    """A trajectory under shapers for the modes, which vary with the platform's pose.

    They are all three of a point mass. Of a rigid platform they are those whose vibration the trajectory would leave
    behind, each at least a fiftieth of the largest. Modes that are overdamped somewhere on the way do not count.

    Raises what :func:`tautwire.linear.modes_along` raises, UnreachableError where fewer than six cables cannot hold the
    platform along the path, and InputError as :func:`shaped` does.
    """
    times = np.linspace(0.0, trajectory.duration, points)
    modes = modes_along(robot, trajectory, times)
    frequencies, ratios = modes.frequencies, modes.damping_ratios
    swings = np.all(ratios < 1.0, axis=0)
    if robot.platform.is_rigid_body:
        left = residual_amplitudes(robot, trajectory, modes)
        swings &= left >= MIN_RESIDUAL_SHARE * np.max(left[swings], initial=0.0)
    frequencies, ratios = frequencies[:, swings], ratios[:, swings]
    shapers = [shaper_for_modes(f, z, kind) for f, z in zip(frequencies, ratios, strict=True)]
    delays = np.array([each.delays for each in shapers])
    amplitudes = np.array([each.amplitudes for each in shapers])
    # Half of the impulses have passed when the platform is there.
    return _shaped_pose(trajectory, times + 0.5 * np.max(delays, axis=1), amplitudes, delays)


def residual_amplitudes(robot: Robot, trajectory: Trajectory, modes: ModesAlong) -> Array:
    """Vibration that a trajectory leaves behind in each of its modes, undamped, (d,) in m of its largest displacement.

    ``|integral of phi' M a exp(-i w t)| / (w phi' M phi)`` with the mode in the middle of the path, a the acceleration
    of the pose.
    """
    middle = len(modes.positions) // 2
    path, omega, shapes = pose_path(robot, trajectory), 2.0 * np.pi * modes.frequencies[middle], modes.shapes[middle]
    count = int(np.ceil(SAMPLES_PER_PERIOD * trajectory.duration * np.max(modes.frequencies[middle]))) + SHAPER_POINTS
    times = np.linspace(0.0, trajectory.duration, count)
    at_middle = sample_poses("residual_amplitudes", robot, path, modes.abscissa[middle : middle + 1])
    plant = linearise(robot, at_middle.position[0], 0.0, at_middle.orientation[0])
    d = plant.degrees_of_freedom
    mass = np.linalg.inv(plant.system.B[d : 2 * d, robot.cable_count :])
    accelerations = sample_poses("residual_amplitudes", robot, path, times).acceleration
    forcing = accelerations @ mass @ shapes / np.sum(shapes * (mass @ shapes), axis=0)
    amplitudes: Array = np.abs(np.trapezoid(forcing * np.exp(-1j * np.outer(times, omega)), times, axis=0)) / omega
    return amplitudes


def _shaped_pose(
    trajectory: Trajectory, times: Array, amplitudes: Array, delays: Array
) -> ShapedTrajectory | PoseTrajectory:
    if not turns(trajectory):
        return ShapedTrajectory(trajectory, times, amplitudes, delays)
    if not isinstance(trajectory, PoseTrajectory):
        hint = "give a PoseTrajectory of a translation and an orientation by its rotation vector"
        raise InputError("trajectory", f"turns, but is {describe_value(trajectory)}", hint)
    translation, rotation = (
        ShapedTrajectory(part, times, amplitudes, delays)
        for part in (trajectory.translation, trajectory.rotation.rotation_vector)
    )
    return PoseTrajectory(translation, OrientationTrajectory(trajectory.rotation.start, rotation))
