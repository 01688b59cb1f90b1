"""Run statistics: steps, iterations, energy residual of the coupling, and the capabilities that FMUs lack."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component
from ..fmus.fmu_variables import INPUT_TIME, Port
from ..fmus.variable_units import unit_of
from .connections import Wiring

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fallbacks:
    """Capabilities that FMUs lack, in sentences, and outputs whose derivatives are estimated, with their units."""

    missing_capabilities: tuple[str, ...] = ()
    estimated_derivatives: tuple[tuple[Port, str], ...] = ()

    def notes(self, errors: Array) -> tuple[str, ...]:
        """One line for each fallback; ``errors`` (number of derivatives,) are those of the estimated derivatives."""
        max_errors: dict[tuple[str, str], float] = {}
        component_names: dict[tuple[str, str], dict[str, None]] = {}
        for (port, unit), error in zip(self.estimated_derivatives, errors, strict=True):
            quantity = port.variable.partition(".")[0], unit
            max_errors[quantity] = max(max_errors.get(quantity, 0.0), float(error))
            component_names.setdefault(quantity, {})[port.component] = None
        derivative_notes = (
            f"no derivative of {name}, so it is estimated from past steps, with an error of about "
            f"{max_error:.2g} {unit}: FMU {', '.join(component_names[name, unit])}"
            for (name, unit), max_error in max_errors.items()
        )
        return (*self.missing_capabilities, *derivative_notes)


def find_fallbacks(components: Mapping[str, Component], wiring: Wiring) -> Fallbacks:
    """Find the capabilities that these FMUs lack for a step of full order."""
    components_with_inputs = {wire.target.component for wire in (*wiring.connections, *wiring.derivative_connections)}
    components_with_inputs |= {port.component for port in wiring.external_inputs}
    holding = [
        name for name in components if name in components_with_inputs and INPUT_TIME not in components[name].variables
    ]
    without_rollback = [name for name, component in components.items() if not component.supports_rollback]
    missing_capabilities = []
    if holding:
        missing_capabilities.append(
            f"no {INPUT_TIME}, so inputs are constant over each step, at their mean: FMU {', '.join(holding)}"
        )
    if without_rollback:
        missing_capabilities.append(
            f"no saved states, so steps are not iterated, nor split at events: FMU {', '.join(without_rollback)}"
        )
    targets = {
        wire.source: components[wire.target.component].variables[wire.target.variable]
        for wire in wiring.derivative_connections
    }
    return Fallbacks(
        tuple(missing_capabilities), tuple((port, unit_of(target) or "") for port, target in targets.items())
    )


# Relative to the energy exchanged, and to all steps.
MAX_ENERGY_RESIDUAL_SHARE, MAX_UNCONVERGED_SHARE = 0.01, 0.1


@dataclass
class RunStatistics:
    """Statistics of a run: its cost in steps, iterations and sweeps, and the energy residual of its coupling.

    Over a step h, a bond sends ``effort sent x flow received`` and gets ``effort received x flow sent``; half of h
    times their difference at its end is the energy residual (J), which no component has produced. It is zero where
    inputs equal outputs at both ends; interpolation errors between them do not show. ``estimated_error`` is the sum of
    the local errors (m) that adaptive steps estimate. ``unconverged_steps`` did not converge within all iterations.
    ``squared_derivative_errors`` sums the squared error estimates of estimated derivatives.

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

    def add_estimated_error(self, error: float) -> None:
        """Add the estimated local error (m) of an accepted adaptive step."""
        self.estimated_error = (self.estimated_error or 0.0) + error

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
                f"the energy residual of the coupling is {self.energy_residual:.3g} J, "
                f"{100.0 * self.energy_residual_share:.2g} % of the energy exchanged: "
                "choose a smaller --step, or FMUs that save their states"
            )
        if self.unconverged_steps > MAX_UNCONVERGED_SHARE * self.steps:
            messages.append(
                f"in {self.unconverged_steps} of {self.steps} steps the iteration did not converge: "
                "choose a smaller --step; if that does not help, an FMU rounds its outputs"
            )
        return tuple(messages)
