"""Zero-order hold of discrete outputs, which jump between macro steps only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component
from ..fmus.fmu_variables import Port
from .connections import Connection

Array = NDArray[np.float64]


class ZeroOrderHold:
    """Zero-order hold of the discrete outputs among ``output_ports``.

    Their value at the end of a step is for the next one; within the step the ``held_values`` that were sampled at its
    beginning hold.
    """

    def __init__(self, components: Mapping[str, Component], output_ports: Sequence[Port]) -> None:
        self.ports = tuple(port for port in output_ports if _is_discrete(components, port))
        self._indices = np.array([output_ports.index(port) for port in self.ports], dtype=np.intp)
        names = dict.fromkeys(port.component for port in self.ports)
        self._blocks = [
            (components[name], components[name].block([p.variable for p in self.ports if p.component == name]))
            for name in names
        ]

    def initial_values(self) -> Array:
        """Held values that differ from any sample: the next one counts as a jump."""
        return np.full(len(self.ports), np.nan)

    def sample(self, outputs: Array) -> Array:
        """The values to hold from now on."""
        held_values: Array = outputs[self._indices]
        return held_values

    def apply(self, outputs: Array, held_values: Array) -> None:
        """Set the outputs to the held values, in place of extrapolated or newer ones."""
        outputs[self._indices] = held_values

    def end_step(self, outputs: Array) -> None:
        """Read the values at the end of the step."""
        if self._blocks:
            for component, block in self._blocks:
                component.read(block)
            outputs[self._indices] = np.concatenate([block.values for _, block in self._blocks])


def inputs_from_discrete_outputs(components: Mapping[str, Component], connections: Sequence[Connection]) -> list[Port]:
    """The inputs that are connected to discrete outputs."""
    return [wire.target for wire in connections if _is_discrete(components, wire.source)]


def _is_discrete(components: Mapping[str, Component], port: Port) -> bool:
    return bool(components[port.component].variables[port.variable].variability == "discrete")
