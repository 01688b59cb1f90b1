"""The state of a coupled system at a communication point, and checkpoints of it."""

from __future__ import annotations

import ctypes
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .extrapolation import ExtrapolationHistory
from .run_statistics import RunStatistics

Array = NDArray[np.float64]


@dataclass(slots=True)
class CouplingState:
    """The state of a coupled system, without that of its FMUs: all that a step changes and a rollback takes back.

    ``outputs`` and ``inputs`` hold the values of all ports of a :class:`CouplingGraph`, outputs followed by estimated
    derivatives; instances read and write them in place. ``external_values`` are the external inputs as last set,
    ``held_values`` the discrete outputs as last sampled. ``pending_input_time`` is the time (s) at which inputs are
    still to be updated, if they are. ``diverged`` tells that the last step kept a large error after all iterations; one
    with a small error left is accepted.
    """

    outputs: Array
    inputs: Array
    external_values: Array
    held_values: Array
    statistics: RunStatistics
    extrapolation_history: ExtrapolationHistory
    pending_input_time: float | None = None
    diverged: bool = False

    def copy(self) -> CouplingState:
        """A copy that later steps do not change."""
        return replace(self, outputs=self.outputs.copy(), inputs=self.inputs.copy(), statistics=copy(self.statistics))

    def restore(self, saved: CouplingState) -> None:
        """Roll back to a copy; sweeps made since then still count, and held values count as jumps."""
        self.outputs[:] = saved.outputs
        self.inputs[:] = saved.inputs
        self.external_values = saved.external_values
        self.held_values = np.full_like(saved.held_values, np.nan)
        self.statistics = replace(saved.statistics, sweeps=self.statistics.sweeps)
        self.extrapolation_history = saved.extrapolation_history
        self.pending_input_time = saved.pending_input_time
        self.diverged = saved.diverged


@dataclass(frozen=True)
class Checkpoint:
    """A copy of the state of a coupled system, with that of its FMUs, for a rollback to it."""

    fmu_states: tuple[ctypes.c_void_p, ...]
    state: CouplingState
