"""The slots of a coupling: where a component finds its inputs and leaves its outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .component import Block, Component
from .wiring import Connection, Port, direct_inputs

Array = NDArray[np.float64]
Places = NDArray[np.intp]

STAMP = "input_time"
MIDDLE_STAMP = "middle_time"


@dataclass(frozen=True)
class Seat:
    """A component in its slot.

    ``outputs`` and ``inputs`` are parts of the coupling's arrays of all outputs and inputs, the latter at ``taken``.
    The last inputs take the outputs at ``sources``, those before them are driven, and the first is the stamp where
    the component has one; the second is that of the middle where ``middle`` inputs are connected.
    """

    component: Component
    outputs: Block
    inputs: Block
    taken: slice
    sources: Places
    stamped: bool
    middle: bool

    def gather(self, time: float, shown: Array) -> None:
        """Take all inputs at ``time`` from the outputs shown."""
        values = self.inputs.values
        if self.stamped:
            values[0] = time
        if len(self.sources):
            np.take(shown, self.sources, out=values[len(values) - len(self.sources) :], mode="clip")

    def write(self, time: float, shown: Array) -> None:
        """Set all inputs as they hold at ``time``."""
        self.gather(time, shown)
        if self.inputs.count:
            self.component.write(self.inputs)

    def advance(self, time: float, step: float, begun: Array, shown: Array) -> None:
        """One macro step, then show the outputs at its end.

        A component that knows no stamp holds its inputs over the step: it gets the mean of those with which the step
        has ``begun`` and those at its end, which is of second order and symmetric in time, and the end values before
        its outputs are read.
        """
        if self.stamped:
            if self.middle:
                self.inputs.values[1] = time + 0.5 * step
            self.write(time + step, shown)
            self.component.step(time, step)
        else:
            self.gather(time, shown)
            end = self.inputs.values.copy()
            self.inputs.values[:] = 0.5 * (begun[self.taken] + end)
            if self.inputs.count:
                self.component.write(self.inputs)
            self.component.step(time, step)
            self.inputs.values[:] = end
            if self.inputs.count:
                self.component.write(self.inputs)
        self.show()

    def show(self) -> None:
        """Read the outputs."""
        if self.outputs.count:
            self.component.read(self.outputs)


@dataclass(frozen=True)
class Level:
    """Outputs that become known together, where they belong, and the seats that they drive."""

    reads: tuple[tuple[Component, Block, Places], ...]
    writes: tuple[Seat, ...]

    def pass_on(self, time: float, shown: Array) -> None:
        """Read the outputs and set the inputs that take them."""
        for component, block, places in self.reads:
            component.read(block)
            shown[places] = block.values
        for seat in self.writes:
            seat.write(time, shown)


def takes_middle(component: Component, connections: Sequence[Connection]) -> bool:
    """Whether a component is given what holds in the middle of a step."""
    return MIDDLE_STAMP in component.variables and any(
        c.target.component == component.name and c.target.variable.startswith("middle_") for c in connections
    )


def gauss_seidel_order(
    components: Mapping[str, Component], connections: Sequence[Connection], shown: Sequence[Port]
) -> list[str]:
    """Components that show some output without waiting for an input go first."""
    fed = {(c.target.component, c.target.variable) for c in connections}

    def waits(name: str) -> bool:
        direct = direct_inputs(components[name])
        own = [port.variable for port in shown if port.component == name]
        return all(any((name, known) in fed for known in direct[variable]) for variable in own)

    return sorted(components, key=waits)


def fed_back(order: Sequence[str], connections: Sequence[Connection], shown: Sequence[Port]) -> Places:
    """Places of the outputs that a pass in this order uses before it has found them."""
    back = {c.source for c in connections if order.index(c.source.component) >= order.index(c.target.component)}
    return np.array([place for place, port in enumerate(shown) if port in back], dtype=np.intp)


def downstream(
    components: Mapping[str, Component], groups: Sequence[Sequence[Connection]], drives: Sequence[Port]
) -> list[list[Connection]]:
    """The connections whose values change at once when a driven input changes, group by group."""
    direct = {name: direct_inputs(component) for name, component in components.items()}
    touched = set(drives)
    found = []
    for group in groups:
        moved = [
            c
            for c in group
            if any(Port(c.source.component, n) in touched for n in direct[c.source.component][c.source.variable])
        ]
        touched |= {c.target for c in moved}
        if moved:
            found.append(moved)
    return found
