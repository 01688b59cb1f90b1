"""Checkpoint of a coupling, for a rollback."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .audit import RunStatistics
from .prediction import ExtrapolationHistory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Checkpoint:
    """The state of a coupling at a communication point, for a rollback to it."""

    fmu_states: tuple[ctypes.c_void_p, ...]
    outputs: Array
    inputs: Array
    external_values: Array
    statistics: RunStatistics
    extrapolation_history: ExtrapolationHistory
