"""Samples that two recordings have in common: a copy in other digits, a part, or every second row of the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..errors import RecordingError
from .recording import Recording
from .shared_noise import noise_correlation
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

# Digits that a file leaves out change a sample by less than its noise.
TOLERANCE_IN_NOISE = 0.1
RELATIVE_TOLERANCE = 1e-6
MAX_NOISE_CORRELATION = 0.5
MAX_SHARED_SAMPLES = 0.1  # of those that validate


def require_unseen(fit: Recording, check: Recording) -> None:
    """Raises RecordingError where too many samples of a recording that validates were fitted."""
    shared = shared_sample_count(check, fit)
    if shared >= MAX_SHARED_SAMPLES * check.sample_count:
        count = "all" if shared == check.sample_count else f"{shared}"
        problem = f"has {count} of its {check.sample_count} samples in common with FIT, which they cannot validate"
        hint = "give a recording of another motion, or none: then the second half of FIT validates"
        raise RecordingError(check.path, problem, hint)
    correlation = noise_correlation(check, fit)
    if correlation > MAX_NOISE_CORRELATION:
        problem = f"has the noise of FIT (correlation {correlation:.2f}), as FIT has where it is resampled or shifted"
        raise RecordingError(check.path, problem, "give a recording of another run, or none")


def shared_sample_count(recording: Recording, other: Recording) -> int:
    """Number of samples of a recording that another one has too, in the same order and at a constant stride.

    Outputs alone are compared: commanded winch speeds are the same whenever a motion is repeated, white noise never
    is. A sample that repeats the one before it, as of a robot at rest without noise, counts in neither recording.
    """
    mine, others = (np.hstack((each.measured(), each.orientation)) for each in (recording, other))
    common = np.isfinite(mine).any(axis=0) & np.isfinite(others).any(axis=0)
    if not common.any():
        return 0
    tolerance = _tolerances(mine[:, common])
    mine, others = (_changing(np.where(np.isnan(each), 0.0, each)[:, common] / tolerance) for each in (mine, others))
    # Balancing the tree takes quadratic time where many samples are alike.
    distances, indices = cKDTree(others, balanced_tree=False).query(mine, p=np.inf, distance_upper_bound=1.0)
    is_shared = np.isfinite(distances)
    steps = np.diff(indices)[is_shared[:-1] & is_shared[1:]]
    strides = np.bincount(steps[steps > 0])
    return int(strides.max()) + 1 if len(strides) else 0


def _tolerances(outputs: Array) -> Array:
    """How far apart the same value may be in each column, shape (k,)."""
    noise = np.array([white_noise_deviation(column) for column in np.split(outputs, outputs.shape[1], axis=1)])
    largest = np.nanmax(np.abs(outputs), axis=0)
    tolerances: Array = np.maximum(TOLERANCE_IN_NOISE * noise, RELATIVE_TOLERANCE * largest)
    return np.maximum(tolerances, np.finfo(float).tiny)


def _changing(samples: Array) -> Array:
    """Samples that differ from the one before them."""
    differs = np.any(np.diff(samples, axis=0) != 0.0, axis=1)
    changing: Array = samples[np.concatenate(([True], differs))]
    return changing
