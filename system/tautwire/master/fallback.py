"""Fallbacks of the master for capabilities that FMUs lack, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .component import Component
from .seat import INPUT_TIME
from .units import unit_of
from .wiring import Connection, Port

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
            f"no rate of {name}, so it is worked out from the past, off by about {doubt:.2g} {unit}: "
            f"FMU {', '.join(component_names[name, unit])}"
            for (name, unit), doubt in max_errors.items()
        )
        return (*self.missing_capabilities, *derivative_notes)


def find_fallbacks(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    external_inputs: Sequence[Port],
    derivative_connections: Sequence[Connection],
) -> Fallbacks:
    """Find the capabilities that these FMUs lack for a step of full order."""
    components_with_inputs = {wire.target.component for wire in (*connections, *derivative_connections)} | {
        port.component for port in external_inputs
    }
    holding = [
        name for name in components if name in components_with_inputs and INPUT_TIME not in components[name].variables
    ]
    without_rollback = [name for name, component in components.items() if not component.supports_rollback]
    missing_capabilities = []
    if holding:
        missing_capabilities.append(
            f"no {INPUT_TIME}, so inputs are held over each step at their mean: FMU {', '.join(holding)}"
        )
    if without_rollback:
        missing_capabilities.append(
            f"no saved states, so no step is redone or cut at a kink: FMU {', '.join(without_rollback)}"
        )
    targets = {
        wire.source: components[wire.target.component].variables[wire.target.variable]
        for wire in derivative_connections
    }
    return Fallbacks(
        tuple(missing_capabilities), tuple((port, unit_of(target) or "") for port, target in targets.items())
    )
