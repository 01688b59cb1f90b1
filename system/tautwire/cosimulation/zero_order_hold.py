"""Zero-order hold of discrete outputs, which jump between macro steps only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component
from .connections import Connection, Port

Array = NDArray[np.float64]


class ZeroOrderHold:
    """Zero-order hold of the discrete outputs among ``output_ports``.

    Their value at the end of a step is for the next one; within the step their value at its beginning holds.
    """

    def __init__(self, components: Mapping[str, Component], output_ports: Sequence[Port]) -> None:
        self.ports = tuple(port for port in output_ports if _is_discrete(components, port))
        self._indices = np.array([output_ports.index(port) for port in self.ports], dtype=np.intp)
        names = dict.fromkeys(port.component for port in self.ports)
        self._blocks = [
            (components[name], components[name].block([p.variable for p in self.ports if p.component == name]))
            for name in names
        ]
        self._values: Array = np.full(len(self.ports), np.nan)

    def begin_step(self, outputs: Array) -> bool:
        """Sample the values to hold from now on; returns whether some have jumped."""
        values = outputs[self._indices]
        jumped = not np.array_equal(values, self._values)
        self._values = values
        return jumped

    def reset(self) -> None:
        """Treat the next values as jumps."""
        self._values.fill(np.nan)

    def apply(self, outputs: Array) -> None:
        """Set the outputs to the held values, in place of extrapolated or newer ones."""
        outputs[self._indices] = self._values

    def end_step(self, outputs: Array) -> None:
        """Read the values at the end of the step."""
        if self._blocks:
            for component, block in self._blocks:
                component.read(block)
            outputs[self._indices] = np.concatenate([block.values for _, block in self._blocks])

    def targets(self, connections: Sequence[Connection]) -> list[Port]:
        """The inputs that are connected to discrete outputs."""
        return [wire.target for wire in connections if wire.source in self.ports]


def _is_discrete(components: Mapping[str, Component], port: Port) -> bool:
    return bool(components[port.component].variables[port.variable].variability == "discrete")
