"""Rauch-Tung-Striebel smoothing of measured positions: position, velocity and acceleration, with covariances.

Each axis is a point whose jerk is white noise of intensity ``q``, measured with white noise of standard deviation
``sigma`` each ``h`` seconds; its initial state is diffuse. The Rauch-Tung-Striebel smoother passes what is slower than

    omega_c = (q / (sigma^2 h))^(1/6)

Source: Särkkä (2013), Bayesian Filtering and Smoothing, ch. 8; filter and smoother are those of statsmodels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording

Array = NDArray[np.float64]

UNIFORM_STEP_TOLERANCE = 1e-6
# Search interval of the cut-off: decades of the sample rate in rad/s.
MIN_CUTOFF_DECADE, MAX_CUTOFF_DECADE = -4.0, 0.0
# So many samples determine the intensity; more would only take longer.
MAX_LIKELIHOOD_SAMPLES = 10_000
MIN_MEASURED_SAMPLES = 20


@dataclass(frozen=True)
class SmoothedAxis:
    """Smoothed axis: ``state`` (N, 3) holds position, velocity and acceleration, ``covariance`` (N, 3, 3) theirs.

    ``intensity`` is that of the jerk, in m^2/s^5; ``cutoff`` in rad/s.
    """

    state: Array
    covariance: Array
    intensity: float
    cutoff: float


@dataclass(frozen=True)
class SmoothedPath:
    """The platform's motion at N times: ``position``, ``velocity``, ``acceleration`` (N, 3) in SI units.

    ``covariance`` (N, 3, 3, 3) is that of these three for each axis, ``cutoff`` (3,) in rad/s; both are zero along an
    axis that was not measured, which stays where it starts: see ``measured`` (3,).
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    covariance: Array
    cutoff: Array
    measured: NDArray[np.bool_]


def smooth_path(recording: Recording, start: tuple[float, float, float], sigmas: Sequence[float]) -> SmoothedPath:
    """Smooth the path of a recording from ``start``; ``sigmas`` are standard deviations of its positions' noise (m)."""
    count = recording.sample_count
    state, covariance, cutoff = np.zeros((3, count, 3)), np.zeros((count, 3, 3, 3)), np.zeros(3)
    measured = np.sum(np.isfinite(recording.position), axis=0) >= MIN_MEASURED_SAMPLES
    for axis, (column, sigma) in enumerate(zip(recording.position.T, sigmas, strict=True)):
        state[axis, :, 0] = start[axis]
        if measured[axis]:
            # A sensor may begin later than the log.
            first = int(np.argmax(np.isfinite(column)))
            head = slice(first, first + MAX_LIKELIHOOD_SAMPLES)
            intensity = maximum_likelihood_intensity(recording.time[head], column[head], sigma)
            smoothed = smooth_axis(recording.time, column, sigma, intensity)
            state[axis], covariance[:, axis], cutoff[axis] = smoothed.state, smoothed.covariance, smoothed.cutoff
    position, velocity, acceleration = np.moveaxis(state, (0, 1, 2), (2, 1, 0))
    return SmoothedPath(recording.time, position, velocity, acceleration, covariance, cutoff, measured)


def smooth_axis(time: Array, values: Array, sigma: float, intensity: float) -> SmoothedAxis:
    """Smooth one axis: values (N,) at rising times (s), NaN where not measured, at a given intensity (m^2/s^5)."""
    smoothed = _kalman_smoother(time, values, sigma, intensity).smooth()
    return SmoothedAxis(
        state=np.ascontiguousarray(smoothed.smoothed_state.T),
        covariance=np.ascontiguousarray(np.moveaxis(smoothed.smoothed_state_cov, 2, 0)),
        intensity=intensity,
        cutoff=(intensity / (sigma**2 * _median_step(time, values))) ** (1.0 / 6.0),
    )


def intensity_for_cutoff(cutoff: float, time: Array, values: Array, sigma: float) -> float:
    """Jerk intensity (m^2/s^5) at which smoothing passes frequencies below a cut-off (rad/s)."""
    return float(cutoff**6 * sigma**2 * _median_step(time, values))


def maximum_likelihood_intensity(time: Array, values: Array, sigma: float) -> float:
    """Maximum-likelihood estimate of the jerk intensity (m^2/s^5) from values (N,)."""
    # Imported here: scipy.optimize takes long to import, and only traces need it.
    from scipy.optimize import minimize_scalar

    rate = 2.0 * np.pi / _median_step(time, values)

    def cost(decade: float) -> float:
        intensity = intensity_for_cutoff(rate * 10.0**decade, time, values, sigma)
        return -float(_kalman_smoother(time, values, sigma, intensity).loglike())

    optimum = minimize_scalar(
        cost, bounds=(MIN_CUTOFF_DECADE, MAX_CUTOFF_DECADE), method="bounded", options={"xatol": 0.01}
    )
    return intensity_for_cutoff(rate * exp(log(10.0) * float(optimum.x)), time, values, sigma)


def _median_step(time: Array, values: Array) -> float:
    """Median of the seconds between two measured values."""
    return float(np.median(np.diff(time[np.isfinite(values)])))


def _kalman_smoother(time: Array, values: Array, sigma: float, intensity: float) -> Any:
    """Kalman smoother of an axis, of statsmodels."""
    # Imported here: it takes long, and only traces need it.
    from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

    steps = np.diff(time, append=2.0 * time[-1] - time[-2])
    if np.ptp(steps) < UNIFORM_STEP_TOLERANCE * float(np.mean(steps)):
        steps = steps[:1]
    smoother = KalmanSmoother(k_endog=1, k_states=3, k_posdef=3)
    smoother.bind(np.array(values, dtype=float)[:, None])
    smoother["design"] = np.array([[1.0, 0.0, 0.0]])
    smoother["obs_cov"] = np.array([[sigma**2]])
    smoother["transition"] = _transition_matrices(steps)
    smoother["selection"] = np.eye(3)
    smoother["state_cov"] = intensity * _process_covariance(steps)
    smoother.initialize_diffuse()
    return smoother


def _transition_matrices(steps: Array) -> Array:
    """Transition matrices of position, velocity and acceleration; shape (3, 3, number of steps)."""
    one, none = np.ones_like(steps), np.zeros_like(steps)
    return np.array([[one, steps, steps**2 / 2.0], [none, one, steps], [none, none, one]])


def _process_covariance(steps: Array) -> Array:
    """Process noise covariance of white jerk of unit intensity over a step; shape (3, 3, number of steps)."""
    h = steps
    return np.array([
        [h**5 / 20.0, h**4 / 8.0, h**3 / 6.0],
        [h**4 / 8.0, h**3 / 3.0, h**2 / 2.0],
        [h**3 / 6.0, h**2 / 2.0, h],
    ])  # fmt: skip
