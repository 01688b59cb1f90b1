"""Run statistics: steps, iterations, and the energy residual of the coupling."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .fallback import Fallbacks
from .wiring import Connection

Array = NDArray[np.float64]

# Relative to the energy exchanged, and to all steps.
MAX_ENERGY_RESIDUAL_SHARE, MAX_UNCONVERGED_SHARE = 0.01, 0.1


@dataclass(frozen=True)
class PowerBond:
    """Power bond: two connections whose product is a power, an effort one way (N) and a flow the other way (m/s)."""

    effort: Connection
    flow: Connection


@dataclass
class RunStatistics:
    """Statistics of a run: its cost in steps, iterations and sweeps, and the energy residual of its coupling.

    Over a step h, a bond sends ``effort sent x flow received`` and gets ``effort received x flow sent``; half of h
    times their difference at its end is the energy residual (J), which no component has produced. It is zero where
    inputs equal outputs at both ends; interpolation errors between them do not show. ``estimated_error`` is the sum of
    the steps' estimated errors (m), where steps were chosen by a tolerance. ``unconverged_steps`` did not converge
    within all iterations. ``squared_derivative_errors`` sums the squared error estimates of estimated derivatives.

    Source: Sadjina, Kyllingstad, Skjong and Pedersen (2017), Energy conservation and power bonds in co-simulations,
    Engineering with Computers 33(3), 607-620.
    """

    steps: int = 0
    iterations: int = 0
    sweeps: int = 0
    unconverged_steps: int = 0
    energy_residual: float = 0.0
    energy_exchanged: float = 0.0
    estimated_error: float | None = None
    fallbacks: Fallbacks = field(default_factory=Fallbacks, repr=False)
    squared_derivative_errors: Array = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)

    def add_step(
        self, step: float, iterations: int, converged: bool, sent: tuple[Array, Array], received: tuple[Array, Array]
    ) -> None:
        """Add one step; ``sent`` and ``received`` are (efforts, flows) of all power bonds at its end."""
        self.steps += 1
        self.iterations += iterations
        self.unconverged_steps += not converged and iterations > 0
        effort_sent, flow_sent = sent
        effort_received, flow_received = received
        self.energy_residual += 0.5 * step * float(effort_received @ flow_sent - effort_sent @ flow_received)
        self.energy_exchanged += step * float(np.sum(np.abs(effort_sent * flow_sent)))

    def add_derivative_errors(self, errors: Array) -> None:
        """Add the error estimates of a step's estimated derivatives, shape (number of derivatives,)."""
        self.squared_derivative_errors = self.squared_derivative_errors + errors**2

    def fallback_notes(self) -> tuple[str, ...]:
        """One line for each capability that FMUs lack; errors of estimated derivatives are root mean squares."""
        return self.fallbacks.notes(np.sqrt(self.squared_derivative_errors / max(self.steps, 1)))

    @property
    def energy_residual_share(self) -> float:
        """Energy residual of the coupling, as a share of the energy exchanged; zero where none was."""
        return abs(self.energy_residual) / self.energy_exchanged if self.energy_exchanged else 0.0

    def warnings(self) -> tuple[str, ...]:
        """Warnings for the user: a large energy residual, or steps that did not converge."""
        messages = []
        if self.energy_residual_share > MAX_ENERGY_RESIDUAL_SHARE:
            messages.append(
                f"the coupling made {self.energy_residual:.3g} J, {100.0 * self.energy_residual_share:.2g} % of the energy exchanged: "
                "take a smaller --step, or FMUs that save their states"
            )
        if self.unconverged_steps > MAX_UNCONVERGED_SHARE * self.steps:
            messages.append(
                f"in {self.unconverged_steps} of {self.steps} steps inputs and outputs did not agree after all redos: "
                "take a smaller --step; where that does not help, some FMU rounds its outputs"
            )
        return tuple(messages)
