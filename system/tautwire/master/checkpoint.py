"""What a coupling keeps to go back to a time."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .audit import Account
from .prediction import Memory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Checkpoint:
    """All that a coupling needs to go back to a time."""

    states: tuple[ctypes.c_void_p, ...]
    shown: Array
    given: Array
    driven: Array
    account: Account
    memory: Memory
