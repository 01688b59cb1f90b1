"""Execution order of a Gauss-Seidel sweep, its tear variables, and the order of its convergence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component
from ..fmus.fmu_variables import MIDDLE_PREFIX, MIDDLE_TIME, Port
from .connected_instance import InstanceLayout
from .connections import Connection
from .direct_feedthrough import direct_feedthrough
from .hermite_interpolation import derivative_chains

Indices = NDArray[np.intp]


def takes_middle_inputs(component: Component, connections: Sequence[Connection]) -> bool:
    """Whether a component has connected midpoint inputs."""
    return MIDDLE_TIME in component.variables and any(
        c.target.component == component.name and c.target.variable.startswith(MIDDLE_PREFIX) for c in connections
    )


def convergence_order_of(instances: Sequence[InstanceLayout], connections: Sequence[Connection]) -> int:
    """Convergence order: six where all connected inputs have midpoint inputs, four with input times, else two."""
    connected_inputs = {c.target for c in connections}
    middle_inputs = (
        Port(t.component, f"{MIDDLE_PREFIX}{t.variable}")
        for t in connected_inputs
        if not t.variable.startswith(MIDDLE_PREFIX)
    )
    if connected_inputs.issuperset(middle_inputs):
        return 6
    return 4 if all(layout.has_input_time for layout in instances if len(layout.source_indices)) else 2


def gauss_seidel_order(
    components: Mapping[str, Component], connections: Sequence[Connection], outputs: Sequence[Port]
) -> list[str]:
    """Gauss-Seidel order: components with an output free of direct feedthrough first, adapted for fewer torn signals.

    Each component in turn is moved to the end where that leaves fewer signals torn, or as many with more derivatives:
    these are extrapolated best, and show the interpolation error. A signal is an output with its derivatives.
    """
    connected_inputs = {(c.target.component, c.target.variable) for c in connections}

    def has_full_feedthrough(name: str) -> bool:
        feedthrough = direct_feedthrough(components[name])
        own_outputs = [port.variable for port in outputs if port.component == name]
        return all(
            any((name, known) in connected_inputs for known in feedthrough[variable]) for variable in own_outputs
        )

    def torn_signals(order: Sequence[str]) -> tuple[int, int]:
        indices = tear_variables(order, connections, outputs)
        return len(derivative_chains(components, outputs, set(indices.tolist()))), -len(indices)

    order = sorted(components, key=has_full_feedthrough)
    for name in tuple(order):
        candidate = [*(other for other in order if other != name), name]
        if torn_signals(candidate) < torn_signals(order):
            order = candidate
    return order


def tear_variables(order: Sequence[str], connections: Sequence[Connection], outputs: Sequence[Port]) -> Indices:
    """Indices of the tear variables: outputs that a sweep in this order uses before it computes them."""
    position = {name: number for number, name in enumerate(order)}
    torn_outputs = {c.source for c in connections if position[c.source.component] >= position[c.target.component]}
    return np.array([index for index, port in enumerate(outputs) if port in torn_outputs], dtype=np.intp)
