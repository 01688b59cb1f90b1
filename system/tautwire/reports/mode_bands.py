"""Frequency bands of the modes along a path, to be marked in a spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from ..estimation.trace_result import Resonance
from ..linear import linearise
from ..number_format import format_significant
from ..recordings.quaternion_columns import unit_quaternions
from ..robot.schema import Robot
from .downsampling import evenly_spaced_indices

Array = NDArray[np.float64]

PATH_SAMPLES = 9
# Bands whose edges are nearer than this factor are merged: their labels would overlap.
MERGE_RATIO = 1.2
# A mode whose frequency is constant along the path is drawn this factor wide.
MIN_WIDTH_RATIO = 1.01


@dataclass(frozen=True)
class Band:
    """A frequency band from ``low`` to ``high`` (Hz) with a short label and a description in words.

    ``spans`` are the bands of its modes, from low to high; ``strange`` marks a resonance that the model lacks.
    """

    low: float
    high: float
    label: str
    words: str
    spans: tuple[tuple[float, float], ...]
    strange: bool = False

    def document(self) -> dict[str, Any]:
        """The band as ``panels.js`` draws it."""
        return vars(self).copy()


def mode_bands(robot: Robot, path: Array, orientation: Array | None = None) -> list[Band]:
    """Bands of a robot's modes along a ``path`` (N, 3) in m, close ones merged; none without an operating point.

    ``orientation`` (N, 4) are the unit quaternions of a rigid platform there, by default that of the robot file.
    """
    poses = path if orientation is None else np.hstack([path, unit_quaternions(orientation)])
    finite = poses[np.isfinite(poses).all(axis=1)]
    if len(finite) < 2:
        return []
    samples = finite[evenly_spaced_indices(len(finite), PATH_SAMPLES)]
    plants = (linearise(robot, pose[:3], 0.0, None if orientation is None else pose[3:]) for pose in samples)
    try:
        return merge_mode_bands(np.array([plant.modes.frequencies for plant in plants]))
    except TautwireError:
        return []


def merge_mode_bands(frequencies: Array) -> list[Band]:
    """Bands of modes, close ones merged, from ``frequencies`` (N, modes) in Hz, ascending in each row."""
    groups: list[list[int]] = []
    for mode in range(frequencies.shape[1]):
        if groups and frequencies[:, mode].min() <= MERGE_RATIO * frequencies[:, groups[-1]].max():
            groups[-1].append(mode)
        else:
            groups.append([mode])
    return [_mode_group_band(frequencies[:, group], group) for group in groups]


def resonance_bands(resonances: Sequence[Resonance]) -> list[Band]:
    """Narrow bands at resonances that the model does not have."""
    return [_resonance_band(each) for each in resonances]


def _resonance_band(resonance: Resonance) -> Band:
    span = _widen(resonance.frequency, resonance.frequency)
    return Band(*span, "?", f"{resonance.sentence[0].upper()}{resonance.sentence[1:]}", (span,), True)


def _mode_group_band(frequencies: Array, modes: Sequence[int]) -> Band:
    ends = [(float(mode_texts.min()), float(mode_texts.max())) for mode_texts in frequencies.T]
    spans = tuple(_widen(*each) for each in ends)
    low, high = min(low for low, _ in spans), max(high for _, high in spans)
    first, last = modes[0] + 1, modes[-1] + 1
    if first == last:
        return Band(low, high, f"{first}", f"Mode {first} lies {_span_text(*ends[0])}", spans)
    mode_numbers = f"{first} {'and' if last == first + 1 else 'to'} {last}"
    each = ", ".join(f"mode {mode + 1} {_span_text(*span)}" for mode, span in zip(modes, ends, strict=True))
    return Band(low, high, mode_numbers, f"Modes {mode_numbers} lie close together: {each}", spans)


def _span_text(low: float, high: float) -> str:
    """The frequency range of a mode in words."""
    ends = format_significant(low, 4), format_significant(high, 4)
    return f"at {ends[0]} Hz" if ends[0] == ends[1] else f"between {ends[0]} and {ends[1]} Hz"


def _widen(low: float, high: float) -> tuple[float, float]:
    return min(low, high / MIN_WIDTH_RATIO), max(high, low * MIN_WIDTH_RATIO)
