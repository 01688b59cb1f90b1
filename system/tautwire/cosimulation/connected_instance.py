"""FMU instances with their input and output buffers, and the dependency levels between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component, VariableBlock

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class InstanceLayout:
    """Where the outputs and inputs of an instance lie among those of all instances.

    The last inputs take the outputs at ``source_indices``, those before them are external. The first is the input time
    where the component has one; the second is the time of the midpoint where midpoint inputs are connected.
    """

    component: Component
    output_names: tuple[str, ...]
    output_slice: slice
    input_names: tuple[str, ...]
    input_slice: slice
    source_indices: Indices
    has_input_time: bool
    has_middle_time: bool


@dataclass(frozen=True)
class ConnectedInstance:
    """An FMU instance with its input and output buffers, see :func:`connect_instance`.

    ``outputs`` and ``inputs`` are parts of the arrays of all outputs and inputs, the latter at ``input_slice``; the
    other fields are those of :class:`InstanceLayout`. ``connected_inputs`` are the inputs that are not external.
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


def connect_instance(layout: InstanceLayout, all_outputs: Array, all_inputs: Array) -> ConnectedInstance:
    """The instance whose buffers are its parts of these arrays."""
    inputs = all_inputs[layout.input_slice]
    return ConnectedInstance(
        component=layout.component,
        outputs=layout.component.block(layout.output_names, all_outputs[layout.output_slice]),
        inputs=layout.component.block(layout.input_names, inputs),
        input_slice=layout.input_slice,
        source_indices=layout.source_indices,
        connected_inputs=inputs[len(inputs) - len(layout.source_indices) :],
        has_input_time=layout.has_input_time,
        has_middle_time=layout.has_middle_time,
    )


@dataclass(frozen=True)
class LevelLayout:
    """A dependency level: outputs that can be read together, and the names of the instances that they drive.

    ``sources`` are, for each component, the names of its outputs and their indices among all outputs.
    """

    sources: tuple[tuple[str, tuple[str, ...], Indices], ...]
    driven_instances: tuple[str, ...]


@dataclass(frozen=True)
class DependencyLevel:
    """A dependency level with buffers for its outputs, their indices, and the instances that they drive."""

    output_reads: tuple[tuple[Component, VariableBlock, Indices], ...]
    driven_instances: tuple[ConnectedInstance, ...]

    def propagate(self, time: float, all_outputs: Array) -> None:
        """Propagate: read the outputs and set the inputs that are connected to them."""
        for component, block, indices in self.output_reads:
            component.read(block)
            all_outputs[indices] = block.values
        for instance in self.driven_instances:
            instance.write_inputs(time, all_outputs)


def connect_level(layout: LevelLayout, instances: Mapping[str, ConnectedInstance]) -> DependencyLevel:
    """The dependency level of these instances, by name."""
    return DependencyLevel(
        tuple(
            (instances[name].component, instances[name].component.block(outputs), indices)
            for name, outputs, indices in layout.sources
        ),
        tuple(instances[name] for name in layout.driven_instances),
    )
