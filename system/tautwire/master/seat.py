"""The slots of a coupling: where a component finds its inputs and leaves its outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .component import Block, Component
from .wiring import Connection, Port

Array = NDArray[np.float64]
Places = NDArray[np.intp]

STAMP = "input_time"
MIDDLE_STAMP = "middle_time"
MIDDLE = "middle_"


@dataclass(frozen=True)
class Seat:
    """A component in its slot.

    ``outputs`` and ``inputs`` are parts of the coupling's arrays of all outputs and inputs, the latter at ``taken``.
    The last inputs, which are ``fed``, take the outputs at ``sources``, those before them are driven, and the first is
    the stamp where the component has one; the second is that of the middle where ``middle`` inputs are connected.
    """

    component: Component
    outputs: Block
    inputs: Block
    taken: slice
    sources: Places
    fed: Array
    stamped: bool
    middle: bool

    def gather(self, time: float, shown: Array) -> None:
        """Take all inputs at ``time`` from the outputs shown."""
        if self.stamped:
            self.inputs.values[0] = time
        if len(self.sources):
            shown.take(self.sources, out=self.fed, mode="clip")

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
        c.target.component == component.name and c.target.variable.startswith(MIDDLE) for c in connections
    )


def order_of(seats: Sequence[Seat], connections: Sequence[Connection]) -> int:
    """Of the error in the step: six where all that is connected is known in its middle, four if all is stamped."""
    taken = {c.target for c in connections}
    wanted = (Port(t.component, f"{MIDDLE}{t.variable}") for t in taken if not t.variable.startswith(MIDDLE))
    if taken.issuperset(wanted):
        return 6
    return 4 if all(seat.stamped for seat in seats if len(seat.sources)) else 2
