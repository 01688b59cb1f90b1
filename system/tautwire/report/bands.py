"""Where modes lie in a spectrum: the frequencies of each along a path, as bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from ..linear import linearise
from ..robots.robot import Robot
from ..tracer.verdict import Resonance
from .series import thinned
from .units import significant

Array = NDArray[np.float64]

PLACES = 9
# Modes whose edges are nearer than this factor share a label: two would cover each other.
TOUCHING = 1.2
# A mode that does not move along the path is drawn this factor wide.
LEAST_WIDTH = 1.01


@dataclass(frozen=True)
class Band:
    """Frequencies from ``low`` to ``high`` (Hz) with a short label, and what is there in words.

    ``spans`` are those of each mode in it, from low to high; ``strange`` is no mode.
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


def mode_bands(robot: Robot, path: Array) -> list[Band]:
    """The bands of a robot's modes along a ``path`` (N, 3) in m, close ones in one; none where none rest."""
    finite = path[np.isfinite(path).all(axis=1)]
    if len(finite) < 2:
        return []
    places = finite[thinned(len(finite), PLACES)]
    try:
        return joined(np.array([linearise(robot, place, swing=0.0).modes.frequencies for place in places]))
    except TautwireError:
        return []


def joined(frequencies: Array) -> list[Band]:
    """Bands of modes by frequency, ``frequencies`` (N, modes) in Hz ascending in each row; close ones in one."""
    groups: list[list[int]] = []
    for mode in range(frequencies.shape[1]):
        if groups and frequencies[:, mode].min() <= TOUCHING * frequencies[:, groups[-1]].max():
            groups[-1].append(mode)
        else:
            groups.append([mode])
    return [_band(frequencies[:, group], group) for group in groups]


def strange_bands(resonances: Sequence[Resonance]) -> list[Band]:
    """Lines where something swings that the model does not have."""
    return [_strange(each) for each in resonances]


def _strange(resonance: Resonance) -> Band:
    span = _widened(resonance.frequency, resonance.frequency)
    return Band(*span, "?", f"{resonance.sentence[0].upper()}{resonance.sentence[1:]}", (span,), True)


def _band(frequencies: Array, modes: Sequence[int]) -> Band:
    ends = [(float(each.min()), float(each.max())) for each in frequencies.T]
    spans = tuple(_widened(*each) for each in ends)
    low, high = min(low for low, _ in spans), max(high for _, high in spans)
    first, last = modes[0] + 1, modes[-1] + 1
    if first == last:
        return Band(low, high, f"{first}", f"Mode {first} lies {_span(*ends[0])}", spans)
    several = f"{first} {'and' if last == first + 1 else 'to'} {last}"
    each = ", ".join(f"mode {mode + 1} {_span(*span)}" for mode, span in zip(modes, ends, strict=True))
    return Band(low, high, several, f"Modes {several} lie close together: {each}", spans)


def _span(low: float, high: float) -> str:
    """Where a mode lies, in words."""
    ends = significant(low, 4), significant(high, 4)
    return f"at {ends[0]} Hz" if ends[0] == ends[1] else f"between {ends[0]} and {ends[1]} Hz"


def _widened(low: float, high: float) -> tuple[float, float]:
    return min(low, high / LEAST_WIDTH), max(high, low * LEAST_WIDTH)
