"""Travel of ropes on a uniform grid, and the lags at which two recordings of it correlate best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate, correlation_lags

Array = NDArray[np.float64]

TRAVEL_WINDOW = 0.2  # s; travel over a shorter time drowns in a tracker's noise
MAX_CANDIDATES = 8
# Of distances: the share of the motion of one that the other has to have recorded too, and what candidates may miss.
MIN_SHARED_MOTION, MAX_DISTANCE_MISFIT = 0.5, 0.1


def travel_on_grid(times: Array, lengths: Array, interval: float) -> tuple[Array, Array]:
    """Differences of lengths (K, n) over the window on a uniform grid, and 1 where they are known, else both 0."""
    grid = np.arange(times[0], times[-1], interval)
    window = max(1, round(TRAVEL_WINDOW / interval))
    if len(grid) <= window:
        return np.zeros((1, lengths.shape[1])), np.zeros(1)
    on_grid = np.column_stack([np.interp(grid, times, column) for column in lengths.T])
    after = np.minimum(np.searchsorted(times, grid), len(times) - 1)
    gaps = times[after] - times[np.maximum(after - 1, 0)]
    is_known = gaps <= max(TRAVEL_WINDOW, 2.0 * interval)
    known = (is_known[window:] & is_known[:-window]).astype(float)
    return (on_grid[window:] - on_grid[:-window]) * known[:, None], known


def correlated(first: Array, second: Array) -> Array:
    """Cross-correlation of two signals at all lags, as ``scipy.signal.correlation_lags`` counts them."""
    return np.asarray(correlate(first, second, "full", "fft"))


def lowest_valleys(misfits: Array, limit: float, reach: int) -> list[int]:
    """Indices of the lowest misfits (L,) up to a limit, one of each valley and so many apart, the lowest first."""
    left, indices = misfits.copy(), []
    for _ in range(MAX_CANDIDATES):
        index = int(np.argmin(left))
        if not left[index] <= limit < np.inf:
            break
        indices.append(index)
        # The whole valley around a minimum is one candidate.
        left[_valley(left, index, reach)] = np.inf
    return indices


def _valley(misfits: Array, index: int, reach: int) -> slice:
    first, last = index, index
    while first > 0 and (index - first < reach or misfits[first - 1] >= misfits[first]):
        first -= 1
    while last + 1 < len(misfits) and (last - index < reach or misfits[last + 1] >= misfits[last]):
        last += 1
    return slice(first, last + 1)


def distance_lags(first: tuple[Array, Array], second: tuple[Array, Array], interval: float) -> list[float]:
    """Lags (s) at which the distances travelled in both paths correlate best, the best first, in whatever frames.

    A path is its times (K,) and positions (K, 3); neither unit, axes nor origin of either change the normalised
    cross-correlation of the distances over the window. A lag is that of the first behind the second, both counted from
    their first sample.
    """
    distances, known = zip(*(_distances_on_grid(*path, interval) for path in (first, second)), strict=True)
    squares = [distance**2 for distance in distances]
    energies = correlated(squares[0], known[1]), correlated(known[0], squares[1])
    shares = np.maximum(*(energy / max(np.sum(own), 1e-300) for energy, own in zip(energies, squares, strict=True)))
    is_shared = shares >= MIN_SHARED_MOTION
    scale = np.sqrt(np.where(is_shared, np.maximum(energies[0] * energies[1], 1e-300), 1.0))
    misfits = np.where(is_shared, 1.0 - correlated(distances[0], distances[1]) / scale, np.inf)
    lags = interval * correlation_lags(len(distances[0]), len(distances[1]))
    reach = round(TRAVEL_WINDOW / interval) + 1
    return [float(lags[index]) for index in lowest_valleys(misfits, float(misfits.min()) + MAX_DISTANCE_MISFIT, reach)]


def _distances_on_grid(times: Array, positions: Array, interval: float) -> tuple[Array, Array]:
    travel, known = travel_on_grid(times, positions, interval)
    return np.linalg.norm(travel, axis=1), known
