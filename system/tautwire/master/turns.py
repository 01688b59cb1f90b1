"""Execution order of the components in a Gauss-Seidel sweep, and the tear variables that follow from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .component import Component
from .seat import Indices
from .wiring import Connection, Port, direct_feedthrough


def gauss_seidel_order(
    components: Mapping[str, Component], connections: Sequence[Connection], outputs: Sequence[Port]
) -> list[str]:
    """Gauss-Seidel order: components with an output free of direct feedthrough first, adapted for fewer tear variables.

    Each component in turn is moved to the end where that leaves fewer tear variables.
    """
    connected_inputs = {(c.target.component, c.target.variable) for c in connections}

    def has_full_feedthrough(name: str) -> bool:
        feedthrough = direct_feedthrough(components[name])
        own_outputs = [port.variable for port in outputs if port.component == name]
        return all(
            any((name, known) in connected_inputs for known in feedthrough[variable]) for variable in own_outputs
        )

    order = sorted(components, key=has_full_feedthrough)
    for name in tuple(order):
        candidate = [*(kept for kept in order if kept != name), name]
        if len(tear_variables(candidate, connections, outputs)) < len(tear_variables(order, connections, outputs)):
            order = candidate
    return order


def tear_variables(order: Sequence[str], connections: Sequence[Connection], outputs: Sequence[Port]) -> Indices:
    """Indices of the tear variables: outputs that a sweep in this order uses before it computes them."""
    position = {name: number for number, name in enumerate(order)}
    torn_outputs = {c.source for c in connections if position[c.source.component] >= position[c.target.component]}
    return np.array([place for place, port in enumerate(outputs) if port in torn_outputs], dtype=np.intp)


def affected_connections(
    components: Mapping[str, Component], groups: Sequence[Sequence[Connection]], changed_inputs: Sequence[Port]
) -> list[list[Connection]]:
    """The connections whose values jump, by direct feedthrough, when the changed inputs do, group by group."""
    feedthrough = {name: direct_feedthrough(component) for name, component in components.items()}
    affected_ports = set(changed_inputs)
    affected_groups = []
    for group in groups:
        affected = [
            c
            for c in group
            if any(
                Port(c.source.component, n) in affected_ports
                for n in feedthrough[c.source.component][c.source.variable]
            )
        ]
        affected_ports |= {c.target for c in affected}
        if affected:
            affected_groups.append(affected)
    return affected_groups
