"""Connected instances, their dependency levels, and their execution order in a Gauss-Seidel sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component, VariableBlock
from .connections import Connection, Port, direct_feedthrough

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

INPUT_TIME = "input_time"
MIDDLE_TIME = "middle_time"
MIDDLE_PREFIX = "middle_"


@dataclass(frozen=True)
class ConnectedInstance:
    """An FMU instance with its input and output buffers.

    ``outputs`` and ``inputs`` are parts of the coupling's arrays of all outputs and inputs, the latter at
    ``input_slice``. The last inputs, ``connected_inputs``, take the outputs at ``source_indices``, those before them
    are external. The first is the input time where the component has one; the second is the time of the midpoint where
    midpoint inputs are connected.
    """

    component: Component
    outputs: VariableBlock
    inputs: VariableBlock
    input_slice: slice
    source_indices: Indices
    connected_inputs: Array
    has_input_time: bool
    has_middle_time: bool

    def gather_inputs(self, time: float, all_outputs: Array) -> None:
        """Gather all inputs at ``time`` from the outputs of all instances."""
        if self.has_input_time:
            self.inputs.values[0] = time
        if len(self.source_indices):
            all_outputs.take(self.source_indices, out=self.connected_inputs, mode="clip")

    def write_inputs(self, time: float, all_outputs: Array) -> None:
        """Gather all inputs at ``time`` and set them."""
        self.gather_inputs(time, all_outputs)
        if self.inputs.count:
            self.component.write(self.inputs)

    def do_step(self, time: float, step: float, inputs_at_start: Array, all_outputs: Array) -> None:
        """One macro step, then read the outputs at its end.

        A component without an input time holds its inputs over the step: it gets the mean of ``inputs_at_start`` and
        those at the end of the step, which is of second order and symmetric in time, and the end values before its
        outputs are read.
        """
        if self.has_input_time:
            if self.has_middle_time:
                self.inputs.values[1] = time + 0.5 * step
            self.write_inputs(time + step, all_outputs)
            self.component.step(time, step)
        else:
            self.gather_inputs(time, all_outputs)
            inputs_at_end = self.inputs.values.copy()
            self.inputs.values[:] = 0.5 * (inputs_at_start[self.input_slice] + inputs_at_end)
            if self.inputs.count:
                self.component.write(self.inputs)
            self.component.step(time, step)
            self.inputs.values[:] = inputs_at_end
            if self.inputs.count:
                self.component.write(self.inputs)
        self.read_outputs()

    def read_outputs(self) -> None:
        """Read the outputs."""
        if self.outputs.count:
            self.component.read(self.outputs)


@dataclass(frozen=True)
class DependencyLevel:
    """A dependency level: outputs that can be read together, their indices, and the instances that they drive."""

    output_reads: tuple[tuple[Component, VariableBlock, Indices], ...]
    driven_instances: tuple[ConnectedInstance, ...]

    def propagate(self, time: float, all_outputs: Array) -> None:
        """Propagate: read the outputs and set the inputs that are connected to them."""
        for component, block, indices in self.output_reads:
            component.read(block)
            all_outputs[indices] = block.values
        for instance in self.driven_instances:
            instance.write_inputs(time, all_outputs)


def takes_middle_inputs(component: Component, connections: Sequence[Connection]) -> bool:
    """Whether a component has connected midpoint inputs."""
    return MIDDLE_TIME in component.variables and any(
        c.target.component == component.name and c.target.variable.startswith(MIDDLE_PREFIX) for c in connections
    )


def convergence_order_of(instances: Sequence[ConnectedInstance], connections: Sequence[Connection]) -> int:
    """Convergence order: six where all connected inputs have midpoint inputs, four with input times, else two."""
    connected_inputs = {c.target for c in connections}
    middle_inputs = (
        Port(t.component, f"{MIDDLE_PREFIX}{t.variable}")
        for t in connected_inputs
        if not t.variable.startswith(MIDDLE_PREFIX)
    )
    if connected_inputs.issuperset(middle_inputs):
        return 6
    return 4 if all(seat.has_input_time for seat in instances if len(seat.source_indices)) else 2


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
