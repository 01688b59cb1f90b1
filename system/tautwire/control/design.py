"""What every controller design has: limits, and gains at points of a path."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import control
import numpy as np
from numpy.typing import NDArray

from ..runs.wiring import AXES
from .aim import ControlAim

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Knot:
    """A point of a gain schedule at ``time`` (s) of the path; n cables, q states.

    ``regulator`` is a sampled ``control.StateSpace`` from deviations of position, tensions and winch speeds from the
    path to winch accelerations; only winch speeds feed through. ``tracking`` (q, n) is the anti-windup gain: from the
    difference of actual and commanded acceleration to the state.
    """

    time: float
    regulator: Any
    tracking: Array


class Design(Protocol):
    """Interface of a designed controller."""

    @property
    def aim(self) -> ControlAim:
        """Sample period and limits."""
        ...

    @property
    def cable_count(self) -> int:
        """Number of cables."""
        ...

    @property
    def feels(self) -> bool:
        """Whether it uses feedback from sensors."""
        ...

    def knots(self) -> tuple[Knot, ...]:
        """The points of the path at which it is designed; gains are interpolated in between."""
        ...


@dataclass(frozen=True)
class Feedforward:
    """Pure feedforward: the winches get the reference speeds, within the speed limits."""

    cable_count: int
    aim: ControlAim = field(default_factory=ControlAim)

    @property
    def feels(self) -> bool:
        """See :class:`Design`."""
        return False

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`Design`; speed lost to a limit is made up for in the next sample."""
        count = self.cable_count
        feedthrough = np.hstack([np.zeros((count, 3 + count)), -np.eye(count) / self.aim.period])
        regulator = control.ss([], [], [], feedthrough, self.aim.period, **regulator_signals(count))
        return (Knot(0.0, regulator, np.zeros((0, count))),)


def regulator_signals(count: int) -> dict[str, Any]:
    """Names of a regulator's inputs and outputs, and of the regulator."""
    numbers = range(1, count + 1)
    return {
        "inputs": [
            *(f"position_{axis}" for axis in AXES),
            *(f"{name}_{index}" for name in ("tension", "winch_speed") for index in numbers),
        ],
        "outputs": [f"winch_acceleration_{index}" for index in numbers],
        "name": "regulator",
    }
