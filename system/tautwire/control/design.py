"""What every controller has: limits, and gains at places of a path."""

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
    """A controller as it is at a ``time`` (s) of the path; n cables, q states.

    ``regulator`` is a sampled ``control.StateSpace``, deviations of position, tensions and winch speeds from the path
    in, winch accelerations out; only winch speeds act at once. ``tracking`` (q, n) tells its state by how much the
    acceleration given is not the one asked for.
    """

    time: float
    regulator: Any
    tracking: Array


class Design(Protocol):
    """A designed controller."""

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
        """Whether it looks at sensors at all."""
        ...

    def knots(self) -> tuple[Knot, ...]:
        """Where along the path it is designed; between knots gains are interpolated."""
        ...


@dataclass(frozen=True)
class Feedforward:
    """No feedback: the winches get the speeds that the reference has, within the limits of speed."""

    cable_count: int
    aim: ControlAim = field(default_factory=ControlAim)

    @property
    def feels(self) -> bool:
        """See :class:`Design`."""
        return False

    def knots(self) -> tuple[Knot, ...]:
        """See :class:`Design`; a speed that a limit has cut is made up for in the next sample."""
        count = self.cable_count
        through = np.hstack([np.zeros((count, 3 + count)), -np.eye(count) / self.aim.period])
        regulator = control.ss([], [], [], through, self.aim.period, **regulator_signals(count))
        return (Knot(0.0, regulator, np.zeros((0, count))),)


def regulator_signals(count: int) -> dict[str, Any]:
    """Names of a regulator's inputs and outputs, and its own."""
    numbers = range(1, count + 1)
    return {
        "inputs": [
            *(f"position_{axis}" for axis in AXES),
            *(f"{name}_{index}" for name in ("tension", "winch_speed") for index in numbers),
        ],
        "outputs": [f"winch_acceleration_{index}" for index in numbers],
        "name": "regulator",
    }
