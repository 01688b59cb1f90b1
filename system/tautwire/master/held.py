"""Outputs that hold over a step and jump between steps: those of discrete variability, as sampled controllers have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from .component import Component
from .wiring import Connection, Port

Array = NDArray[np.float64]


class Held:
    """The discrete outputs among those ``shown``.

    What such an output shows at the end of a step is for the next one; within the step its value at the begin holds.
    """

    def __init__(self, components: Mapping[str, Component], shown: Sequence[Port]) -> None:
        self.ports = tuple(port for port in shown if _is_discrete(components, port))
        self._places = np.array([shown.index(port) for port in self.ports], dtype=np.intp)
        names = dict.fromkeys(port.component for port in self.ports)
        self._blocks = [
            (components[name], components[name].block([p.variable for p in self.ports if p.component == name]))
            for name in names
        ]
        self._values: Array = np.full(len(self.ports), np.nan)

    def begin(self, shown: Array) -> bool:
        """Take the values that hold from now on; returns whether some have jumped."""
        now = shown[self._places]
        jumped = not np.array_equal(now, self._values)
        self._values = now
        return jumped

    def forget(self) -> None:
        """Take the next values for new ones."""
        self._values.fill(np.nan)

    def hold(self, shown: Array) -> None:
        """Show the values that hold, whatever is guessed or already known of the next step."""
        shown[self._places] = self._values

    def end(self, shown: Array) -> None:
        """Show what the components do at the end of the step."""
        if self._blocks:
            for component, block in self._blocks:
                component.read(block)
            shown[self._places] = np.concatenate([block.values for _, block in self._blocks])

    def targets(self, connections: Sequence[Connection]) -> list[Port]:
        """The inputs that take discrete outputs."""
        return [wire.target for wire in connections if wire.source in self.ports]


def _is_discrete(components: Mapping[str, Component], port: Port) -> bool:
    return bool(components[port.component].variables[port.variable].variability == "discrete")
