"""Residuals of FMUs alone, each with the noise that it would have if the model were right."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ..filter_step import Noise
from .associations import strongest
from .cable_cut import AXES, CableRun, drift_variance, tension_variance
from .path import Path
from .platform_cut import Balance
from .port_residuals import PLATFORM, ComponentResidual, root_mean_square
from .ringing import ringing

Array = NDArray[np.float64]

SIGMAS = 5.0
MATERIAL = 0.1
# Relative deviation of the mean square of a random walk about its mean.
WALK = 0.9


def cable_part(
    number: int, run: CableRun, recording: Recording, path: Path, noise: Noise, anchor: Array
) -> ComponentResidual:
    """What a cable's load cell (``number`` from 1) shows beyond its FMU; its mean, the start tension's, is taken off.

    With ``k`` the slopes of the tension, ``P`` the path's covariance, ``kappa`` the stiffness and ``t`` the time

        expected^2 = sigma_T^2 + k' P k + kappa^2 sigma_V^2 sum h^2, the last less that of its mean
    """
    own = noise.of_outputs(recording.cable_count)[2 + number]
    residual = recording.tension[:, number - 1] - run.tension
    seen = np.isfinite(residual)
    mean = float(np.mean(residual[seen]))
    residual = residual - mean
    drift, drift_of_mean = drift_variance(run, path.time, noise.winch_speed)
    steady = float(np.mean(tension_variance(run, path, own, noise.winch_speed)[seen]))
    wandering = max(float(np.mean(drift[seen])) - drift_of_mean, 0.0)
    expected = steady + wandering
    slow = 2.0 * (path.time[-1] - path.time[0]) * float(np.min(path.cutoff[path.measured])) / (2.0 * np.pi)
    along_path = max(steady - own**2, 0.0)
    terms = (own**2 * np.sqrt(2.0 / np.sum(seen)), along_path * np.sqrt(2.0 / max(slow, 1.0)), WALK * wandering)
    return ComponentResidual(
        component=f"cable {number}",
        quantity="tension",
        unit="N",
        residual=residual,
        mean=mean,
        rms=root_mean_square(residual),
        expected_rms=float(np.sqrt(expected)),
        limit=_limit(float(np.sqrt(np.sum(np.square(terms)))) / expected),
        moves_with=strongest(residual, _cable_signals(run, recording.winch_speed[:, number - 1], path, anchor)),
    )


def axis_part(axis: int, found: Balance, path: Path) -> ComponentResidual:
    """The force that is missing on the platform along an axis."""
    residual = found.force[:, axis]
    seen = np.isfinite(residual)
    expected = root_mean_square(found.expected[seen, axis])
    duration = (path.time[-1] - path.time[0]) * float(np.mean(seen))
    independent = max(2.0 * duration * float(found.cutoff[axis]) / (2.0 * np.pi), 1.0)
    return ComponentResidual(
        component=PLATFORM,
        quantity=f"force {AXES[axis]}",
        unit="N",
        residual=residual,
        mean=float(np.mean(residual[seen])) if np.any(seen) else float("nan"),
        rms=root_mean_square(residual),
        expected_rms=expected,
        limit=_limit(np.sqrt(2.0 / independent)),
        moves_with=strongest(residual, _platform_signals(path)),
        rings_at=ringing(path.time, residual, path.acceleration[:, axis], float(found.cutoff[axis])),
    )


def _limit(deviation: float) -> float:
    """The ratio that chance does not reach, by the relative standard deviation of the mean square."""
    return float(np.sqrt(1.0 + SIGMAS * deviation + MATERIAL))


def _cable_signals(run: CableRun, winch_speed: Array, path: Path, anchor: Array) -> dict[str, Array]:
    line = anchor - path.position
    length = np.linalg.norm(line, axis=1)
    stretching = winch_speed - np.sum(line * path.velocity, axis=1) / length
    travel = np.concatenate([[0.0], np.cumsum(0.5 * (winch_speed[1:] + winch_speed[:-1]) * np.diff(path.time))])
    return {
        "strain rate": stretching / length,
        "tension": run.tension,
        "winch travel": travel,
        "winch speed": winch_speed,
        "direction of the winch": np.sign(np.sum(line * path.velocity, axis=1)),
        "direction of stretching": np.sign(stretching),
        **_slow_signals(path),
    }


def _platform_signals(path: Path) -> dict[str, Array]:
    speed = np.linalg.norm(path.velocity, axis=1)
    moving = {
        "velocity": path.velocity,
        "velocity times speed": path.velocity * speed[:, None],
        "acceleration": path.acceleration,
    }
    by_axis = {f"{name} {axis}": values[:, k] for name, values in moving.items() for k, axis in enumerate(AXES)}
    return {**by_axis, "speed": speed, **_slow_signals(path)}


def _slow_signals(path: Path) -> dict[str, Array]:
    """Where the platform is, time, and a drift that settles as that of a temperature does."""
    since = (path.time - path.time[0]) / (path.time[-1] - path.time[0])
    places = {f"position {axis}": path.position[:, k] for k, axis in enumerate(AXES) if path.measured[k]}
    return {**places, "time": since, "a drift that settles": 1.0 - np.exp(-4.0 * since)}
