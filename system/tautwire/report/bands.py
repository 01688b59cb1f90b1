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
# Bands whose edges are nearer than this factor are drawn as one.
TOUCHING = 1.2
# A mode that does not move along the path is drawn this factor wide.
LEAST_WIDTH = 1.01


@dataclass(frozen=True)
class Band:
    """Frequencies from ``low`` to ``high`` (Hz) with a short label, what is there in words; ``strange`` is no mode."""

    low: float
    high: float
    label: str
    words: str
    strange: bool = False

    def document(self) -> dict[str, Any]:
        """The band as ``panels.js`` draws it."""
        return vars(self).copy()


def mode_bands(robot: Robot, path: Array) -> list[Band]:
    """The bands of a robot's modes along a ``path`` (N, 3) in m, neighbours that touch in one; none where none rest."""
    finite = path[np.isfinite(path).all(axis=1)]
    if len(finite) < 2:
        return []
    places = finite[thinned(len(finite), PLACES)]
    try:
        return joined(np.array([linearise(robot, place, swing=0.0).modes.frequencies for place in places]))
    except TautwireError:
        return []


def joined(frequencies: Array) -> list[Band]:
    """Bands of modes by frequency, ``frequencies`` (N, modes) in Hz ascending in each row; those that touch in one."""
    groups: list[list[int]] = []
    for mode in range(frequencies.shape[1]):
        if groups and frequencies[:, mode].min() <= TOUCHING * frequencies[:, groups[-1]].max():
            groups[-1].append(mode)
        else:
            groups.append([mode])
    return [_band(frequencies[:, group], group) for group in groups]


def strange_bands(resonances: Sequence[Resonance]) -> list[Band]:
    """Lines where something swings that the model does not have."""
    return [
        Band(*_widened(each.frequency, each.frequency), "?", f"{each.sentence[0].upper()}{each.sentence[1:]}", True)
        for each in resonances
    ]


def _band(frequencies: Array, modes: Sequence[int]) -> Band:
    low, high = float(frequencies.min()), float(frequencies.max())
    first, last = modes[0] + 1, modes[-1] + 1
    label = f"{first}" if first == last else f"{first}\N{EN DASH}{last}"
    which = f"Mode {first} lies" if first == last else f"Modes {first} to {last} lie"
    apart = significant(high) != significant(low)
    span = f"between {significant(low)} and {significant(high)} Hz" if apart else f"at {significant(low)} Hz"
    return Band(*_widened(low, high), label, f"{which} {span}")


def _widened(low: float, high: float) -> tuple[float, float]:
    return min(low, high / LEAST_WIDTH), max(high, low * LEAST_WIDTH)
