"""Residual evaluation: each component residual against what it would be if the model were correct.

That is noise, errors of the sensors with a memory, and what the robot file states as uncertain. The last are constant,
so that a longer recording does not make them smaller: with standard deviations ``s``, the cables' directions ``u``,
tensions ``T``, lengths ``L``, areas ``A``, rates ``r`` of stretching, and the change ``C`` of a tension for each metre
by which an exit point shifts, of a cable and of the platform along an axis ``a``

    S_i^2 = (s_anchor^2 + s_x^2) sum var C_i + (s_gain^2 + (s_E / E)^2) var T_i + s_c^2 var (A_i r_i / L_i)

    S^2 = sum_i u_ia^2 (s_offset^2 + s_gain^2 T_i^2) + s_anchor^2 (1 - u_ia^2) (T_i / L_i)^2
        + s_x^2 sum_b (sum_i (delta_ab - u_ia u_ib) T_i / L_i)^2 + s_m^2 (a_a + g delta_az)^2

The tracker's offset ``s_x`` is one for all cables. Errors of positions with a memory are left out at the platform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...robot.schema import AXES, Robot
from ..disturbance import NEUTRAL, Disturbance, sensor_noise_only
from ..kalman_filter import Noise
from ..residual_spectrum import resonance_frequency
from .cable_simulation import CableSimulation, drift_variance, exit_shift_columns, tension_variance
from .component_residuals import PLATFORM, ComponentResidual, root_mean_square, strongest_correlation
from .force_balance import ForceBalance
from .path_smoothing import SmoothedPath
from .policy import LocalisationPolicy

Array = NDArray[np.float64]

# Relative standard deviations of the mean square of a random walk about its mean, and of one constant.
RANDOM_WALK_DEVIATION, CONSTANT_DEVIATION = 0.9, 2.0**0.5


@dataclass(frozen=True)
class MeasuredPorts:
    """What was measured at the components' ports: the recording of a robot, its smoothed path, and their noise."""

    robot: Robot
    recording: Recording
    path: SmoothedPath
    noise: Noise

    @property
    def sensor_errors(self) -> Disturbance:
        """Errors of the sensors with a memory, without what may be an error of the model."""
        noise, disturbance = self.noise, self.noise.disturbance
        return NEUTRAL if disturbance is None else sensor_noise_only(disturbance, noise.position, noise.tension)


def cable_residual(
    measured: MeasuredPorts, number: int, run: CableSimulation, policy: LocalisationPolicy
) -> ComponentResidual:
    """Residual of a cable: its load cell (``number`` from 1) less its FMU, without the mean, that of the start tension.

    With ``k`` the sensitivities of the tension, ``P`` the path's covariance, ``kappa`` the stiffness and ``t`` the time

        expected^2 = sigma_T^2 + k' P k + kappa^2 sigma_V^2 sum h^2 + M^2 + S^2, the third less that of its mean

    with ``kappa^2`` times the variance of the length where that was recorded, in its place, and M of errors with a
    memory of load cell and tracker.
    """
    recording = measured.recording
    residual = recording.tension[:, number - 1] - run.tension
    is_measured = np.isfinite(residual)
    mean = float(np.mean(residual[is_measured]))
    residual = residual - mean
    expected, relative_deviation = _expected_variance(measured, number, run, is_measured)
    anchor = np.array(measured.robot.cables[number - 1].anchor)
    signals = _cable_signals(run, recording.winch_speed[:, number - 1], measured.path, anchor)
    return ComponentResidual(
        component=f"cable {number}",
        quantity="tension",
        unit="N",
        residual=residual,
        mean=mean,
        rms=root_mean_square(residual),
        expected_rms=float(np.sqrt(expected)),
        threshold=_threshold(relative_deviation, policy),
        correlated_signal=strongest_correlation(residual, signals, policy.correlation_level),
    )


def _expected_variance(
    measured: MeasuredPorts, number: int, run: CableSimulation, is_measured: NDArray[np.bool_]
) -> tuple[float, float]:
    """Expected variance (N^2) of a cable's residual, and the relative standard deviation of its mean square."""
    path, noise = measured.path, measured.noise
    load_cell_noise = noise.of_outputs(measured.recording.cable_count)[2 + number]
    length_error = noise.rope_lengths[number - 1].rms if noise.rope_lengths else 0.0
    speed_noise = 0.0 if length_error else noise.winch_speed
    drift, drift_of_mean = drift_variance(run, path.time, speed_noise)
    variance = tension_variance(run, path, load_cell_noise, speed_noise) + (run.stiffness * length_error) ** 2
    steady_variance = float(np.mean(variance[is_measured]))
    drift_excess = max(float(np.mean(drift[is_measured])) - drift_of_mean, 0.0)
    errors = measured.sensor_errors
    memory = errors.tension.rms**2 + errors.position.rms**2 * float(np.mean(run.stiffness[is_measured] ** 2))
    independent_samples = (
        2.0 * (path.time[-1] - path.time[0]) * float(np.min(path.cutoff[path.measured])) / (2.0 * np.pi)
    )
    path_variance = max(steady_variance - load_cell_noise**2, 0.0)
    return _total_variance(
        (min(load_cell_noise**2, steady_variance), np.sqrt(2.0 / np.sum(is_measured))),
        (path_variance, np.sqrt(2.0 / max(independent_samples, 1.0))),
        (drift_excess + memory, RANDOM_WALK_DEVIATION),
        (_stated_cable_variance(measured, number, run, is_measured), CONSTANT_DEVIATION),
    )


def _total_variance(*parts: tuple[float, float]) -> tuple[float, float]:
    """The sum of variances that each have a relative standard deviation, and that of the sum."""
    variances, deviations = np.array(parts, dtype=float).T
    total = float(np.sum(variances))
    return total, float(np.linalg.norm(variances * deviations)) / total


def _stated_cable_variance(
    measured: MeasuredPorts, number: int, run: CableSimulation, rows: NDArray[np.bool_]
) -> float:
    """Variance (N^2) of a cable's residual by what the robot file states as uncertain."""
    cable, sensors, path = measured.robot.cables[number - 1], measured.robot.sensors, measured.path
    of_shifts = np.var(exit_shift_columns(run)[rows][:, list(measured.robot.axes_in_plane)], axis=0)
    stretch_rate = _stretch_rate(path, measured.recording.winch_speed[:, number - 1], np.array(cable.anchor))
    points = cable.anchor_uncertainty**2 + sensors.position_offset_uncertainty**2
    relative_modulus = cable.modulus_uncertainty / cable.modulus
    return float(
        points * np.sum(of_shifts)
        + (sensors.tension_gain_uncertainty**2 + relative_modulus**2) * np.var(run.tension[rows])
        + cable.damping_uncertainty**2 * np.var((cable.area * stretch_rate / run.length)[rows])
    )


def platform_residual(
    measured: MeasuredPorts, axis: int, balance: ForceBalance, directions: Array, policy: LocalisationPolicy
) -> ComponentResidual:
    """Residual of the platform: the missing force along an axis; ``directions`` (N, n, 3) are the cables'."""
    residual, path = balance.force[:, axis], measured.path
    is_known = np.isfinite(residual)
    noise = root_mean_square(balance.expected_deviation[is_known, axis])
    memory, stated = _slow_platform_variances(measured, axis, directions[is_known], is_known)
    duration = (path.time[-1] - path.time[0]) * float(np.mean(is_known))
    independent_samples = max(2.0 * duration * float(balance.cutoff[axis]) / (2.0 * np.pi), 1.0)
    expected, relative_deviation = _total_variance(
        (noise**2, np.sqrt(2.0 / independent_samples)), (memory, RANDOM_WALK_DEVIATION), (stated, CONSTANT_DEVIATION)
    )
    return ComponentResidual(
        component=PLATFORM,
        quantity=f"force {AXES[axis]}",
        unit="N",
        residual=residual,
        mean=float(np.mean(residual[is_known])) if np.any(is_known) else float("nan"),
        rms=root_mean_square(residual),
        expected_rms=float(np.sqrt(expected)),
        threshold=_threshold(relative_deviation, policy),
        correlated_signal=strongest_correlation(residual, _platform_signals(path), policy.correlation_level),
        resonance_frequency=resonance_frequency(
            path.time, residual, path.acceleration[:, axis], float(balance.cutoff[axis]), policy.resonance_peaks
        ),
    )


def _slow_platform_variances(
    measured: MeasuredPorts, axis: int, directions: Array, rows: NDArray[np.bool_]
) -> tuple[float, float]:
    """Variances (N^2) of the missing force by sensors' errors with a memory, and by what is stated as uncertain."""
    robot, sensors, path = measured.robot, measured.robot.sensors, measured.path
    tension, squares = measured.recording.tension[rows], directions[:, :, axis] ** 2
    slopes = tension / np.linalg.norm(np.array(robot.anchors) - path.position[rows][:, None], axis=2)
    anchors = np.array([cable.anchor_uncertainty for cable in robot.cables])
    # By how much all cables together pull otherwise for each metre by which the platform is elsewhere, (N, 3).
    across = np.eye(3)[axis] - directions[:, :, axis, None] * directions
    of_offset = np.sum((slopes[:, :, None] * across).sum(axis=1) ** 2, axis=1)
    weight = path.acceleration[rows, axis] + (robot.gravity if AXES[axis] == "z" else 0.0)
    memory = measured.sensor_errors.tension.rms**2 * float(np.sum(np.mean(squares, axis=0)))
    of_cables = (
        sensors.tension_offset_uncertainty**2 * squares
        + (sensors.tension_gain_uncertainty * tension) ** 2 * squares
        + anchors**2 * (1.0 - squares) * slopes**2
    )
    of_all = sensors.position_offset_uncertainty**2 * of_offset + (robot.platform.mass_uncertainty * weight) ** 2
    return memory, float(np.mean(of_cables.sum(axis=1) + of_all))


def _threshold(deviation: float, policy: LocalisationPolicy) -> float:
    """Threshold of the ratio that chance does not reach, by the relative standard deviation of the mean square."""
    return float(np.sqrt(1.0 + policy.significant_sigmas * deviation + policy.negligible_excess))


def _cable_signals(run: CableSimulation, winch_speed: Array, path: SmoothedPath, anchor: Array) -> dict[str, Array]:
    line = anchor - path.position
    length = np.linalg.norm(line, axis=1)
    stretch_rate = _stretch_rate(path, winch_speed, anchor)
    travel = np.concatenate([[0.0], np.cumsum(0.5 * (winch_speed[1:] + winch_speed[:-1]) * np.diff(path.time))])
    return {
        "strain rate": stretch_rate / length,
        "tension": run.tension,
        "winch travel": travel,
        "winch speed": winch_speed,
        "direction of the winch": np.sign(np.sum(line * path.velocity, axis=1)),
        "direction of stretching": np.sign(stretch_rate),
        **_slow_signals(path),
    }


def _stretch_rate(path: SmoothedPath, winch_speed: Array, anchor: Array) -> Array:
    """Rate (m/s) at which a rope is stretched, (N,): what the winch reels in beyond what the platform comes nearer."""
    line = anchor - path.position
    rate: Array = winch_speed - np.sum(line * path.velocity, axis=1) / np.linalg.norm(line, axis=1)
    return rate


def _platform_signals(path: SmoothedPath) -> dict[str, Array]:
    speed = np.linalg.norm(path.velocity, axis=1)
    motion = {
        "velocity": path.velocity,
        "velocity times speed": path.velocity * speed[:, None],
        "acceleration": path.acceleration,
    }
    by_axis = {f"{name} {axis}": values[:, k] for name, values in motion.items() for k, axis in enumerate(AXES)}
    return {**by_axis, "speed": speed, **_slow_signals(path)}


def _slow_signals(path: SmoothedPath) -> dict[str, Array]:
    """Slow signals: position, time, and a drift that settles as that of a temperature does."""
    relative_time = (path.time - path.time[0]) / (path.time[-1] - path.time[0])
    positions = {f"position {axis}": path.position[:, k] for k, axis in enumerate(AXES) if path.measured[k]}
    return {**positions, "time": relative_time, "a drift that settles": 1.0 - np.exp(-4.0 * relative_time)}
