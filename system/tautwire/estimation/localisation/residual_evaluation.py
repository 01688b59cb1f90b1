"""Residual evaluation: each component residual against the noise that it would have if the model were right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...robot.schema import AXES, Robot
from ..kalman_filter import Noise
from ..residual_spectrum import resonance_frequency
from .cable_simulation import CableSimulation, drift_variance, tension_variance
from .component_residuals import PLATFORM, ComponentResidual, root_mean_square, strongest_correlation
from .force_balance import ForceBalance
from .path_smoothing import SmoothedPath
from .policy import LocalisationPolicy

Array = NDArray[np.float64]

# Relative standard deviation of the mean square of a random walk about its mean.
RANDOM_WALK_DEVIATION = 0.9


@dataclass(frozen=True)
class MeasuredPorts:
    """What was measured at the components' ports: the recording of a robot, its smoothed path, and their noise."""

    robot: Robot
    recording: Recording
    path: SmoothedPath
    noise: Noise


def cable_residual(
    measured: MeasuredPorts, number: int, run: CableSimulation, policy: LocalisationPolicy
) -> ComponentResidual:
    """Residual of a cable: its load cell (``number`` from 1) less its FMU, without the mean, that of the start tension.

    With ``k`` the sensitivities of the tension, ``P`` the path's covariance, ``kappa`` the stiffness and ``t`` the time

        expected^2 = sigma_T^2 + k' P k + kappa^2 sigma_V^2 sum h^2, the last less that of its mean

    and ``kappa^2`` times the variance of the length where that was recorded, in the last term's place.
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
    expected = steady_variance + drift_excess
    independent_samples = (
        2.0 * (path.time[-1] - path.time[0]) * float(np.min(path.cutoff[path.measured])) / (2.0 * np.pi)
    )
    path_variance = max(steady_variance - load_cell_noise**2, 0.0)
    terms = (
        load_cell_noise**2 * np.sqrt(2.0 / np.sum(is_measured)),
        path_variance * np.sqrt(2.0 / max(independent_samples, 1.0)),
        RANDOM_WALK_DEVIATION * drift_excess,
    )
    return expected, float(np.sqrt(np.sum(np.square(terms)))) / expected


def platform_residual(
    path: SmoothedPath, axis: int, balance: ForceBalance, policy: LocalisationPolicy
) -> ComponentResidual:
    """Residual of the platform: the missing force along an axis."""
    residual = balance.force[:, axis]
    is_known = np.isfinite(residual)
    expected = root_mean_square(balance.expected_deviation[is_known, axis])
    duration = (path.time[-1] - path.time[0]) * float(np.mean(is_known))
    independent_samples = max(2.0 * duration * float(balance.cutoff[axis]) / (2.0 * np.pi), 1.0)
    return ComponentResidual(
        component=PLATFORM,
        quantity=f"force {AXES[axis]}",
        unit="N",
        residual=residual,
        mean=float(np.mean(residual[is_known])) if np.any(is_known) else float("nan"),
        rms=root_mean_square(residual),
        expected_rms=expected,
        threshold=_threshold(np.sqrt(2.0 / independent_samples), policy),
        correlated_signal=strongest_correlation(residual, _platform_signals(path), policy.correlation_level),
        resonance_frequency=resonance_frequency(
            path.time, residual, path.acceleration[:, axis], float(balance.cutoff[axis]), policy.resonance_peaks
        ),
    )


def _threshold(deviation: float, policy: LocalisationPolicy) -> float:
    """Threshold of the ratio that chance does not reach, by the relative standard deviation of the mean square."""
    return float(np.sqrt(1.0 + policy.significant_sigmas * deviation + policy.negligible_excess))


def _cable_signals(run: CableSimulation, winch_speed: Array, path: SmoothedPath, anchor: Array) -> dict[str, Array]:
    line = anchor - path.position
    length = np.linalg.norm(line, axis=1)
    stretch_rate = winch_speed - np.sum(line * path.velocity, axis=1) / length
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
