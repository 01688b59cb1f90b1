"""The platform's path behind measured positions: position, velocity and acceleration, with their covariances.

Each axis is a point whose jerk is white noise of intensity ``q``, seen with white noise of standard deviation
``sigma`` each ``h`` seconds; nothing is known of its start. The Rauch-Tung-Striebel smoother passes what is slower than

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

EVEN = 1e-6
# Decades of the cut-off, in multiples of the sample rate in rad/s, in which the likeliest is looked for.
SLOWEST, FASTEST = -4.0, 0.0
# So many samples tell the intensity; more would only take longer.
TELLING = 10_000
FEWEST_SEEN = 20


@dataclass(frozen=True)
class Smoothed:
    """One axis: ``state`` (N, 3) holds position, velocity and acceleration, ``covariance`` (N, 3, 3) theirs.

    ``intensity`` is that of the jerk, in m^2/s^5; ``cutoff`` in rad/s.
    """

    state: Array
    covariance: Array
    intensity: float
    cutoff: float


@dataclass(frozen=True)
class Path:
    """The platform's motion at N times: ``position``, ``velocity``, ``acceleration`` (N, 3) in SI units.

    ``covariance`` (N, 3, 3, 3) is that of these three for each axis, ``cutoff`` (3,) in rad/s; both are zero along an
    axis that was not measured, which stays where it starts: ``measured`` (3,) tells.
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    covariance: Array
    cutoff: Array
    measured: NDArray[np.bool_]


def smoothed_path(recording: Recording, start: tuple[float, float, float], sigmas: Sequence[float]) -> Path:
    """The path of a recording whose positions have noise of these standard deviations (m), starting at ``start``."""
    count = recording.sample_count
    state, covariance, cutoff = np.zeros((3, count, 3)), np.zeros((count, 3, 3, 3)), np.zeros(3)
    measured = np.sum(np.isfinite(recording.position), axis=0) >= FEWEST_SEEN
    for axis, (column, sigma) in enumerate(zip(recording.position.T, sigmas, strict=True)):
        state[axis, :, 0] = start[axis]
        if measured[axis]:
            head = slice(0, TELLING)
            intensity = likeliest_intensity(recording.time[head], column[head], sigma)
            found = smooth(recording.time, column, sigma, intensity)
            state[axis], covariance[:, axis], cutoff[axis] = found.state, found.covariance, found.cutoff
    position, velocity, acceleration = np.moveaxis(state, (0, 1, 2), (2, 1, 0))
    return Path(recording.time, position, velocity, acceleration, covariance, cutoff, measured)


def smooth(time: Array, values: Array, sigma: float, intensity: float) -> Smoothed:
    """Smooth values (N,) at rising times (s), NaN where nothing was measured, at a given intensity (m^2/s^5)."""
    found = _filter(time, values, sigma, intensity).smooth()
    return Smoothed(
        state=np.ascontiguousarray(found.smoothed_state.T),
        covariance=np.ascontiguousarray(np.moveaxis(found.smoothed_state_cov, 2, 0)),
        intensity=intensity,
        cutoff=(intensity / (sigma**2 * _usual_step(time, values))) ** (1.0 / 6.0),
    )


def intensity_at(cutoff: float, time: Array, values: Array, sigma: float) -> float:
    """The intensity (m^2/s^5) at which smoothing passes what is slower than a cut-off (rad/s)."""
    return float(cutoff**6 * sigma**2 * _usual_step(time, values))


def likeliest_intensity(time: Array, values: Array, sigma: float) -> float:
    """The intensity (m^2/s^5) of the jerk under which the values (N,) are likeliest."""
    # Imported here: scipy.optimize takes long to import, and only traces need it.
    from scipy.optimize import minimize_scalar

    rate = 2.0 * np.pi / _usual_step(time, values)

    def cost(decade: float) -> float:
        intensity = intensity_at(rate * 10.0**decade, time, values, sigma)
        return -float(_filter(time, values, sigma, intensity).loglike())

    found = minimize_scalar(cost, bounds=(SLOWEST, FASTEST), method="bounded", options={"xatol": 0.01})
    return intensity_at(rate * exp(log(10.0) * float(found.x)), time, values, sigma)


def _usual_step(time: Array, values: Array) -> float:
    """Seconds between two measured values, in the median."""
    return float(np.median(np.diff(time[np.isfinite(values)])))


def _filter(time: Array, values: Array, sigma: float, intensity: float) -> Any:
    """The axis as statsmodels has it."""
    # Imported here: it takes long, and only traces need it.
    from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

    steps = np.diff(time, append=2.0 * time[-1] - time[-2])
    if np.ptp(steps) < EVEN * float(np.mean(steps)):
        steps = steps[:1]
    axis = KalmanSmoother(k_endog=1, k_states=3, k_posdef=3)
    axis.bind(np.array(values, dtype=float)[:, None])
    axis["design"] = np.array([[1.0, 0.0, 0.0]])
    axis["obs_cov"] = np.array([[sigma**2]])
    axis["transition"] = _transition(steps)
    axis["selection"] = np.eye(3)
    axis["state_cov"] = intensity * _spread(steps)
    axis.initialize_diffuse()
    return axis


def _transition(steps: Array) -> Array:
    """Position, velocity and acceleration a step later; shape (3, 3, number of steps)."""
    one, none = np.ones_like(steps), np.zeros_like(steps)
    return np.array([[one, steps, steps**2 / 2.0], [none, one, steps], [none, none, one]])


def _spread(steps: Array) -> Array:
    """What white jerk of unit intensity adds to their covariance over a step; shape (3, 3, number of steps)."""
    h = steps
    return np.array([
        [h**5 / 20.0, h**4 / 8.0, h**3 / 6.0],
        [h**4 / 8.0, h**3 / 3.0, h**2 / 2.0],
        [h**3 / 6.0, h**2 / 2.0, h],
    ])  # fmt: skip
