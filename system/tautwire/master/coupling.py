"""One macro step of a wired system, corrected until inputs and outputs agree at its end.

Every component steps over ``[t, t + h]`` on extrapolated inputs; then all go back to their saved states and step
again on inputs that run from the values at ``t`` to those just found at ``t + h`` (value and rate at both ends, a
Hermite polynomial). Converged, this is symmetric in time: the coupling neither creates nor eats energy.

Source: Kuebler and Schiehlen (2000), Mathematical and Computer Modelling of Dynamical Systems 6(2), 93-113, on
iterated coupling; the polynomial through value and rate at both ends is the Hermite form.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .component import Block, Component
from .wiring import Connection, Port, check, direct_inputs, levels

Array = NDArray[np.float64]

STAMP = "input_time"
REMEASURED = 50
LEAST_CONTRACTION = 1e-6


@dataclass(frozen=True)
class Transfer:
    """Outputs to read, where each of them goes, and inputs to write then."""

    reads: tuple[tuple[Component, Block], ...]
    copies: tuple[tuple[Array, Array, NDArray[np.intp], NDArray[np.intp]], ...]
    writes: tuple[tuple[Component, Block], ...]

    def run(self) -> None:
        """Carry values from outputs to inputs."""
        for component, block in self.reads:
            component.read(block)
        for target, source, into, out_of in self.copies:
            target[into] = source[out_of]
        for component, block in self.writes:
            component.write(block)


class Coupling:
    """A wired system of components, ready to step.

    ``drives`` are the input ports that the master itself sets; ``tolerance`` is relative to the nominal values of
    the inputs; ``redos`` bounds the corrections of a step. How much a redo shrinks the error is measured now and
    then, so that most steps need no redo whose only use is to show that nothing changed.
    """

    def __init__(
        self,
        components: Mapping[str, Component],
        connections: Sequence[Connection],
        drives: Sequence[Port],
        tolerance: float = 1e-9,
        redos: int = 8,
    ) -> None:
        check(components, connections)
        self.components = dict(components)
        self.tolerance = tolerance
        self.redos = redos if all(c.can_restore for c in components.values()) else 0
        self.stamped = {name: STAMP in c.variables for name, c in components.items()}
        self.drives = tuple(drives)
        targets: dict[str, list[str]] = {name: [] for name in components}
        for port in [*drives, *(c.target for c in connections)]:
            targets[port.component].append(port.variable)
        self.inputs = {
            name: components[name].block([STAMP, *names] if self.stamped[name] else names)
            for name, names in targets.items()
            if names or self.stamped[name]
        }
        self.nominal = {name: self._nominals(name) for name in self.inputs}
        self.drive_places = [
            (self.inputs[p.component], self.inputs[p.component].names.index(p.variable)) for p in drives
        ]
        groups = levels(components, connections)
        self._contraction, self._contraction_at, self._steps = 1.0, 0.0, 0
        self.transfers = [self._transfer(group) for group in groups]
        self.after_drives = [self._transfer(group) for group in self._downstream(groups)]

    def _nominals(self, name: str) -> Array:
        variables = self.components[name].variables
        return np.array([float(variables[n].nominal or 1.0) for n in self.inputs[name].names])

    def _transfer(self, group: Sequence[Connection]) -> Transfer:
        reads = {}
        for source in sorted({c.source.component for c in group}):
            names = sorted({c.source.variable for c in group if c.source.component == source})
            reads[source] = self.components[source].block(names)
        copies = []
        writes = []
        for target in sorted({c.target.component for c in group}):
            mine = [c for c in group if c.target.component == target]
            whole = self.inputs[target]
            part = self.components[target].block(
                ([STAMP] if self.stamped[target] else []) + [c.target.variable for c in mine]
            )
            offset = 1 if self.stamped[target] else 0
            for source in sorted({c.source.component for c in mine}):
                chosen = [c for c in mine if c.source.component == source]
                out_of = np.array([reads[source].names.index(c.source.variable) for c in chosen])
                into = np.array([offset + mine.index(c) for c in chosen])
                wide = np.array([whole.names.index(c.target.variable) for c in chosen])
                copies.append((part.values, reads[source].values, into, out_of))
                copies.append((whole.values, reads[source].values, wide, out_of))
            if offset:
                zero = np.array([0])
                copies.append((part.values, whole.values, zero, zero))
            writes.append((self.components[target], part))
        return Transfer(
            tuple((self.components[name], block) for name, block in reads.items()),
            tuple(copies),
            tuple(writes),
        )

    def _downstream(self, groups: Sequence[Sequence[Connection]]) -> list[list[Connection]]:
        """The connections whose values change at once when a driven input changes."""
        direct = {name: direct_inputs(component) for name, component in self.components.items()}
        touched = set(self.drives)
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

    def drive(self, values: Array) -> None:
        """Note what the driven inputs shall be, in the order of ``drives``; written with the next stamp."""
        for (block, place), value in zip(self.drive_places, values, strict=True):
            block.values[place] = value

    def settle(self, time: float, all_outputs: bool = True) -> None:
        """Write driven inputs stamped ``time`` and pass outputs on until all inputs hold at ``time``."""
        self._write_inputs(time)
        for transfer in self.transfers if all_outputs else self.after_drives:
            transfer.run()

    def _write_inputs(self, time: float) -> None:
        for name, block in self.inputs.items():
            if self.stamped[name]:
                block.values[0] = time
            self.components[name].write(block)

    def step(self, time: float, step: float, start: Array, end: Array) -> int:
        """One macro step under driven inputs that are ``start`` at its begin and ``end`` at its end.

        Returns the number of corrections that were made.
        """
        self.drive(start)
        self.settle(time, all_outputs=False)
        components = self.components.values()
        if self.redos:
            for component in components:
                component.save()
        self._advance(time, step, end)
        if abs(step - self._contraction_at) > 0.1 * step or self._steps % REMEASURED == 0:
            self._contraction, self._contraction_at = 1.0, step
        self._steps += 1
        earlier = np.inf
        for redo in range(self.redos):
            before = {name: block.values.copy() for name, block in self.inputs.items()}
            for component in components:
                component.restore()
            self._write_inputs(time + step)
            self._advance(time, step, end)
            change = self._change(before)
            if np.isfinite(earlier):
                self._contraction = min(1.0, max(change / earlier, LEAST_CONTRACTION))
            if change * self._contraction <= self.tolerance:
                return redo + 1
            earlier = max(change, LEAST_CONTRACTION)
        return self.redos

    def _advance(self, time: float, step: float, end: Array) -> None:
        for component in self.components.values():
            component.step(time, step)
        self.drive(end)
        self.settle(time + step)

    def _change(self, before: Mapping[str, Array]) -> float:
        """Largest change of an input since ``before``, relative to its nominal value; the stamp does not count."""
        return max(
            float(np.max(np.abs(block.values - before[name]) / self.nominal[name], initial=0.0))
            for name, block in self.inputs.items()
        )
