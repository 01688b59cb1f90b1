"""The books of a run: steps, redos, and the energy that the coupling itself made or ate."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .fallback import Fallback
from .wiring import Connection

Array = NDArray[np.float64]

# Of the energy exchanged, and of all steps.
WARNED_SHARE, WARNED_UNSETTLED = 0.01, 0.1


@dataclass(frozen=True)
class Bond:
    """Two connections whose product is a power: an effort one way (N), a flow the other way (m/s)."""

    effort: Connection
    flow: Connection


@dataclass
class Account:
    """What a run cost, and what its coupling did to energy.

    Over a step h, a bond sends ``effort sent x flow received`` and gets ``effort received x flow sent``; half of h
    times their difference at its end is energy (J) that no component made. Zero where inputs equal outputs at both
    ends; what the polynomials between them err by does not show. ``error`` is the sum of the steps' estimated errors
    (m), where steps were chosen by a tolerance. In ``unsettled`` steps inputs and outputs did not agree after all
    redos. ``doubted`` sums the squares of what estimated rates may err by.

    Source: Sadjina, Kyllingstad, Skjong and Pedersen (2017), Energy conservation and power bonds in co-simulations,
    Engineering with Computers 33(3), 607-620.
    """

    steps: int = 0
    redos: int = 0
    passes: int = 0
    unsettled: int = 0
    made: float = 0.0
    exchanged: float = 0.0
    error: float | None = None
    without: Fallback = field(default_factory=Fallback, repr=False)
    doubted: Array = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)

    def enter(
        self, step: float, redos: int, agreed: bool, sent: tuple[Array, Array], received: tuple[Array, Array]
    ) -> None:
        """One step; ``sent`` and ``received`` are (efforts, flows) of all bonds at its end."""
        self.steps += 1
        self.redos += redos
        self.unsettled += not agreed and redos > 0
        effort_sent, flow_sent = sent
        effort_received, flow_received = received
        self.made += 0.5 * step * float(effort_received @ flow_sent - effort_sent @ flow_received)
        self.exchanged += step * float(np.sum(np.abs(effort_sent * flow_sent)))

    def doubt(self, doubts: Array) -> None:
        """By how much the estimated rates of a step may err, shape (number of rates,)."""
        self.doubted = self.doubted + doubts**2

    def fallbacks(self) -> tuple[str, ...]:
        """What the master did without, for want of FMUs that can do it; the errors of rates are root mean squares."""
        return self.without.notes(np.sqrt(self.doubted / max(self.steps, 1)))

    @property
    def share(self) -> float:
        """Energy made by the coupling, as a share of all that was exchanged; zero where nothing was."""
        return abs(self.made) / self.exchanged if self.exchanged else 0.0

    def warnings(self) -> tuple[str, ...]:
        """What a user should know: where the coupling made energy, or steps ended before inputs and outputs agreed."""
        told = []
        if self.share > WARNED_SHARE:
            told.append(
                f"the coupling made {self.made:.3g} J, {100.0 * self.share:.2g} % of the energy exchanged: "
                "take a smaller --step, or FMUs that save their states"
            )
        if self.unsettled > WARNED_UNSETTLED * self.steps:
            told.append(
                f"in {self.unsettled} of {self.steps} steps inputs and outputs did not agree after all redos: "
                "take a smaller --step; where that does not help, some FMU rounds its outputs"
            )
        return tuple(told)
