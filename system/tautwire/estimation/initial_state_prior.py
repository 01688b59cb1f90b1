"""Prior of the filter's initial state: its covariance, self-stress, and motion at the start of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..recordings.recording import Recording
from ..recordings.start_position import start_position, with_start
from ..robot.cable_routes import unit_directions
from ..robot.equilibrium_slopes import equilibrium_slopes
from ..robot.kinematics import structure_matrix
from ..robot.platform_symbols import StateIndices
from ..robot.rigid_equilibrium import leaves_orientation_to_equilibrium, platform_size
from ..robot.schema import Robot
from ..robot.static_equilibrium import start_orientation, static_tensions
from ..robot.uncertain_parameters import uncertain_parameters
from .kalman_filter import Noise
from .measured_outputs import measured_outputs
from .measurement_noise import rotation_scale
from .policy import DEFAULT_POLICY
from .preprocessing_policy import InitialStatePolicy

Array = NDArray[np.float64]

RANK_TOLERANCE = 1e-9
# Of a static tension on too few cables to hold any orientation: what bends beyond its slopes by uncertain parameters.
START_TENSION_RATIO = 0.25


def initial_covariance(robot: Robot, noise: Noise, state_count: int, constant_count: int = 0) -> Array:
    """Prior covariance (state_count, state_count) of the initial state.

    Beside pose, twist and lengths only the last ``constant_count`` states are uncertain; internal states of ropes
    follow by :func:`settled_covariance`. Where an orientation follows from equilibrium, rotation and lengths are as
    uncertain as the robot file's numbers make them there, independently of these: it bends too much with them.

    Self-stress, the tensions in the null space of redundant robots' structure matrix, has the standard deviation
    ``noise.self_stress``: with ``U`` the ropes' directions and ``F = l / (E S)``, unstrained lengths by
    ``s^2 F (I - U^+ U) F``.
    """
    count, turning = robot.cable_count, 3 if robot.platform.is_rigid_body else 0
    indices = StateIndices(3 + turning, count)
    length_variance = noise.start_position**2 + noise.start_stretch**2
    variances = np.zeros(state_count)
    variances[indices.pose] = [length_variance] * 3 + [noise.start_rotation**2] * turning
    variances[indices.twist] = [noise.start_velocity**2] * 3 + [noise.start_angular_velocity**2] * turning
    variances[indices.lengths] = length_variance
    covariance, lengths = np.diag(variances), indices.lengths
    covariance[state_count - constant_count :, state_count - constant_count :] = np.eye(constant_count)
    if noise.self_stress > 0.0:
        length_modes = _cable_compliances(robot)[:, None] * self_stress_projection(robot)
        covariance[lengths, lengths] += noise.self_stress**2 * length_modes @ length_modes.T
    if has_uncertain_equilibrium(robot):
        rows = [*range(3, 6), *range(lengths.start, lengths.stop)]
        covariance[np.ix_(rows, rows)] += _equilibrium_covariance(robot)
    return covariance


def has_uncertain_equilibrium(robot: Robot) -> bool:
    """Whether the orientation at the start follows from an equilibrium, and that from uncertain numbers."""
    return leaves_orientation_to_equilibrium(robot) and bool(uncertain_parameters(robot))


def _equilibrium_covariance(robot: Robot) -> Array:
    """Covariance (3 + n, 3 + n) of rotation and unstrained lengths in such an equilibrium."""
    slopes = equilibrium_slopes(robot)
    covariance: Array = slopes @ slopes.T
    stretches = START_TENSION_RATIO * _cable_compliances(robot) * static_tensions(robot)
    covariance[3:, 3:] += np.diag(stretches**2)
    return covariance


def settled_covariance(covariance: Array, rate_slopes: Array, settling: NDArray[np.int64]) -> Array:
    """Covariance (n, n) of an initial state at rest, where the ropes' internal states have followed its uncertainty.

    With the slopes (e, n) of the rates of the e ``settling`` states, ``A`` by themselves and ``B`` by the others,
    ``de = -A^+ B dx``: a rope whose pretension differs has relaxed under the one that it has. One without equilibrium,
    such as a memory of friction, has no slope and stays.
    """
    others = np.setdiff1d(np.arange(len(covariance)), settling)
    follow = np.eye(len(covariance))
    follow[np.ix_(settling, others)] = -np.linalg.pinv(rate_slopes[:, settling]) @ rate_slopes[:, others]
    settled: Array = follow @ covariance @ follow.T
    return settled


def self_stress_projection(robot: Robot) -> Array:
    """Projection (n, n) of tensions on self-stress, the null space of the structure matrix; zero where it is empty."""
    matrix = start_structure_matrix(robot)
    projection: Array = np.eye(robot.cable_count) - np.linalg.pinv(matrix, rcond=RANK_TOLERANCE) @ matrix
    return projection


def start_structure_matrix(robot: Robot) -> Array:
    """Structure matrix at the start, (3, n); of a platform that turns (6, n), moments over its size."""
    if not robot.platform.is_rigid_body:
        return unit_directions(robot)
    matrix = structure_matrix(robot, orientation=start_orientation(robot))
    return np.vstack([matrix[:3], matrix[3:] / platform_size(robot)])


def self_stress_deviation(
    robot: Robot,
    recordings: tuple[Recording, ...],
    policy: InitialStatePolicy = DEFAULT_POLICY.preprocessing.initial_state,
) -> tuple[float, tuple[str, ...]]:
    """Standard deviation of self-stress in N, and a note where it matters.

    The robot file's value; without one, zero with tensions measured, else a quarter of the mean static one.
    """
    if float(np.trace(self_stress_projection(robot))) < 0.5:
        return 0.0, ()
    declared = robot.tension.preferred_uncertainty if robot.tension else None
    is_tension_unmeasured = not any(recording.has_tension for recording in recordings)
    if declared is None and not is_tension_unmeasured:
        return 0.0, ()
    tensions = static_tensions(robot)
    deviation = policy.self_stress_ratio * float(np.mean(tensions)) if declared is None else declared
    if deviation == 0.0:
        return 0.0, ()
    reason = "tension.preferred_uncertainty" if declared is not None else "no tension is measured"
    by_rule = f"{tensions.min():.3g} to {tensions.max():.3g} N"
    return deviation, (
        f"{reason}: start tensions may differ from the tension rule's, {by_rule}, by {deviation:.3g} N; they are "
        "estimated beside every effect, so that a wrong pretension is not taken for one",
    )


def _cable_compliances(robot: Robot) -> Array:
    """Axial compliances of the cables (n,) in m/N: length over axial stiffness."""
    lengths = [float(np.linalg.norm(np.subtract(anchor, robot.platform.start))) for anchor in robot.anchors]
    return np.array([length / (c.modulus * c.area) for length, c in zip(lengths, robot.cables, strict=True)])


@dataclass(frozen=True)
class InitialMotion:
    """Initial ``speed`` of the platform (m/s), and ``amplitude`` of its oscillation about equilibrium (m).

    Of one that turns also its angular speed ``turning`` (rad/s), and the amplitude of its rotation, ``angle`` (rad).
    """

    speed: float
    amplitude: float
    turning: float = 0.0
    angle: float = 0.0

    @property
    def description(self) -> str:
        """Speeds in words."""
        return f"{self.speed:.3g} m/s" + (f" and {self.turning:.3g} rad/s" if self.turning > 0.0 else "")


def with_motion_at_start(
    robot: Robot,
    noise: Noise,
    recordings: Sequence[Recording],
    policy: InitialStatePolicy = DEFAULT_POLICY.preprocessing.initial_state,
) -> tuple[Noise, tuple[str, ...]]:
    """Noise with an initial state as uncertain as recordings that begin in motion require, and a note of each of these.

    Raises RecordingError where one is too far from rest to find its ropes' reference, the static start.
    """
    notes: list[str] = []
    for recording in recordings:
        robot_at_start = with_start(robot, start_position(robot, noise.position, recording)[0])
        motion = initial_motion(robot_at_start, noise, recording, policy)
        if motion is None:
            continue
        shortest_cable = min(float(np.linalg.norm(np.subtract(a, robot.platform.start))) for a in robot.anchors)
        if motion.amplitude > policy.max_amplitude_ratio * shortest_cable:
            problem = f"starts in motion, {motion.description}, and vibrates by {motion.amplitude:.3g} m"
            hint = "begin the recording at rest: the ropes have their reference length at the static start"
            raise RecordingError(recording.path, problem, hint)
        noise = replace(
            noise,
            start_velocity=max(noise.start_velocity, policy.prior_widening * motion.speed),
            start_stretch=max(noise.start_stretch, policy.prior_widening * motion.amplitude),
            start_angular_velocity=max(noise.start_angular_velocity, policy.prior_widening * motion.turning),
            start_rotation=max(noise.start_rotation, policy.prior_widening * motion.angle),
        )
        notes.append(
            f"{recording.path} starts in motion, at about {motion.description}: initial position, velocity and "
            "tensions were estimated beside every effect; internal states of ropes (relaxation, creep) start at rest"
        )
    return noise, tuple(notes)


def initial_motion(
    robot: Robot,
    noise: Noise,
    recording: Recording,
    policy: InitialStatePolicy = DEFAULT_POLICY.preprocessing.initial_state,
) -> InitialMotion | None:
    """Initial motion of a recording; None where it is at rest within noise.

    Winch speeds alone would move a platform on stiff ropes at ``v`` with ``U' v = V``. The residual of the positions is
    fitted by ``e_0 + e_1 t + e_2 t^2``; the velocity is ``v + e_1``, significant at eight sigma from zero. Rotations
    count as positions of points in the platform's distance.
    """
    time = recording.time - recording.time[0]
    velocity_map = np.linalg.pinv(start_structure_matrix(robot), rcond=RANK_TOLERANCE)
    pose, pose_noise, size = _scaled_pose(robot, noise, recording)
    winch_led_velocity = recording.winch_speed @ velocity_map
    displacement = _cumulative_integral(time, winch_led_velocity)
    initial_winch_speed, initial_velocity = recording.winch_speed[0], winch_led_velocity[0]
    velocity_noise = noise.winch_speed * np.linalg.norm(velocity_map, axis=0)
    is_early = time <= 2.0 * policy.velocity_window
    measured_axes = [
        axis for axis, column in enumerate(pose.T) if np.sum(np.isfinite(column[is_early])) >= policy.min_window_samples
    ]
    if not measured_axes:
        is_moving = (
            bool(np.any(np.abs(initial_winch_speed) > policy.min_velocity_sigmas * noise.winch_speed))
            and noise.winch_speed > 0.0
        )
        return _motion_of(initial_velocity, np.zeros_like(initial_velocity), size) if is_moving else None
    velocity, significant, amplitudes = np.zeros(pose.shape[1]), False, np.zeros(pose.shape[1])
    for axis in measured_axes:
        residual = pose[:, axis] - displacement[:, axis]
        slope, deviation = _initial_slope(time, residual, pose_noise[axis], policy)
        velocity[axis] = initial_velocity[axis] + slope
        significant |= bool(
            abs(velocity[axis]) > policy.min_velocity_sigmas * np.hypot(deviation, velocity_noise[axis])
        )
        amplitudes[axis] = _oscillation_amplitude(time, residual, pose_noise[axis], policy)
    return _motion_of(velocity, amplitudes, size) if significant else None


def _scaled_pose(robot: Robot, noise: Noise, recording: Recording) -> tuple[Array, Array, float]:
    """Measured pose (N, d) in m, rotations times the platform's size, its noise (d,) in m, and that size in m."""
    outputs, deviations = measured_outputs(recording, robot.platform.is_rigid_body), noise.of_outputs(robot.cable_count)
    size, tensions = rotation_scale(robot), slice(3, 3 + robot.cable_count)
    pose = np.hstack([outputs[:, :3], size * outputs[:, tensions.stop :]])
    return pose, np.array([*deviations[:3], *(size * each for each in deviations[tensions.stop :])]), size


def _motion_of(velocity: Array, amplitudes: Array, size: float) -> InitialMotion:
    """Motion by scaled velocities and amplitudes (d,) in m/s and m."""
    return InitialMotion(
        float(np.linalg.norm(velocity[:3])),
        float(np.max(amplitudes[:3])),
        float(np.linalg.norm(velocity[3:])) / size,
        float(np.max(amplitudes[3:], initial=0.0)) / size,
    )


def _cumulative_integral(time: Array, rates: Array) -> Array:
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(time)[:, None]
    total: Array = np.vstack([np.zeros((1, rates.shape[1])), np.cumsum(steps, axis=0)])
    return total


def _initial_slope(time: Array, signal: Array, sigma: float, policy: InitialStatePolicy) -> tuple[float, float]:
    """Initial slope of the parabola through the first samples, and its standard deviation."""
    measured = np.flatnonzero(np.isfinite(signal))
    selected = measured[: max(int(np.sum(time[measured] <= policy.velocity_window)), policy.min_window_samples)]
    powers = np.vander(time[selected], 3, increasing=True)
    inverse = np.linalg.pinv(powers)
    return float(inverse[1] @ signal[selected]), sigma * float(np.linalg.norm(inverse[1]))


def _oscillation_amplitude(time: Array, signal: Array, sigma: float, policy: InitialStatePolicy) -> float:
    """Amplitude of the oscillation of a signal about a parabola in its first second, without noise."""
    selected = np.flatnonzero(np.isfinite(signal) & (time <= policy.oscillation_window))
    if len(selected) <= policy.min_window_samples:
        return 0.0
    residual = signal[selected] - np.polyval(np.polyfit(time[selected], signal[selected], 2), time[selected])
    return float(np.sqrt(max(2.0 * (float(np.mean(residual**2)) - sigma**2), 0.0)))
