"""Interpolation of winch speeds between samples: linear, or by cubic splines where they are samples of a smooth motion.

In a step of length h from speed v_0 with rate a_0 to v_1 with a_1, at the fraction s of it,

    v(s) = v_0 + s d + s (1 - s) ((1 - s) b_0 - s b_1)        d = v_1 - v_0        b_i = a_i h - d

is the cubic Hermite polynomial; without the bends b it is the straight line. The rope travels ``h (v_0 + v_1) / 2`` and
with bends ``h (b_0 - b_1) / 12`` more. Taken as linear, a motion of frequency f and travel x, sampled every h, errs by
``x (2 pi f h)^2 / 12``: 3 um of 1 mm at 3 Hz and 100 samples/s, which a stiff rope shows as newtons.

Source: de Boor (2001), A Practical Guide to Splines, rev. ed., chapter IV.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from .recording import Recording

Array = NDArray[np.float64]

# A cubic spline through fewer has no bend of its own.
MIN_SAMPLES = 4


def with_spline_speeds(recording: Recording) -> Recording:
    """The recording with winch speeds whose cubic splines are the motion between samples; too short a one as it is."""
    if recording.sample_count < MIN_SAMPLES:
        return recording
    rates = CubicSpline(recording.time, recording.winch_speed).derivative()(recording.time)
    return replace(recording, winch_acceleration=np.asarray(rates))


def with_linear_speeds(recording: Recording) -> Recording:
    """The recording with winch speeds linear between samples."""
    return replace(recording, winch_acceleration=None)


def bent_by(fraction: Any, begin_bend: Any, end_bend: Any) -> Any:
    """What bends add to the straight line at a fraction of a step: ``s (1 - s) ((1 - s) b_0 - s b_1)``, symbols too."""
    return fraction * (1.0 - fraction) * ((1.0 - fraction) * begin_bend - fraction * end_bend)


def speed_bends(recording: Recording) -> tuple[Array, Array]:
    """Bends b_0 and b_1 (N - 1, n) of the winch speeds in each step, in m/s; see the module."""
    differences = np.diff(recording.winch_speed, axis=0)
    if recording.winch_acceleration is None:
        return np.zeros_like(differences), np.zeros_like(differences)
    rates, steps = recording.winch_acceleration, np.diff(recording.time)[:, None]
    return steps * rates[:-1] - differences, steps * rates[1:] - differences
