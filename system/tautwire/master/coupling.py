"""One macro step of a wired system, redone until inputs and outputs agree at its end.

The outputs at the end of the step are guessed from their past. Then each component in turn steps over ``[t, t + h]``
on inputs that run from their values at ``t`` to those last known at ``t + h`` (value and rate at both ends, a Hermite
polynomial), and shows its outputs there. While that changes more than the tolerance, all go back to their saved
states and step again. Converged, the step is symmetric in time: the coupling neither creates nor eats energy.

Source: Kuebler and Schiehlen (2000), Mathematical and Computer Modelling of Dynamical Systems 6(2), 93-113, on
iterated coupling; the polynomial through value and rate at both ends is the Hermite form.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .component import Block, Component
from .wiring import Connection, Port, check, direct_inputs, levels

Array = NDArray[np.float64]
Places = NDArray[np.intp]

STAMP = "input_time"
REMEASURED = 50
LEAST_CONTRACTION = 1e-6
PAST = 4


@dataclass(frozen=True)
class Seat:
    """A component in its slot: its connected outputs, its inputs, and where these find their values.

    ``outputs`` is a part of the coupling's array of all outputs; the last inputs take its ``sources``, those before
    them are driven, and the first is the stamp where the component has one.
    """

    component: Component
    outputs: Block
    inputs: Block
    sources: Places
    stamped: bool

    def write(self, time: float, shown: Array) -> None:
        """Set all inputs, stamped ``time``."""
        values = self.inputs.values
        if self.stamped:
            values[0] = time
        if len(self.sources):
            np.take(shown, self.sources, out=values[len(values) - len(self.sources) :], mode="clip")
        if len(values):
            self.component.write(self.inputs)


@dataclass(frozen=True)
class Level:
    """Outputs that become known together, where they belong, and the seats that they drive."""

    reads: tuple[tuple[Component, Block, Places], ...]
    writes: tuple[Seat, ...]


class Coupling:
    """A wired system of components, ready to step.

    ``drives`` are the input ports that the master itself sets; ``tolerance`` is relative to the nominal values of
    the connected outputs; ``redos`` bounds the redos of a step. How much a redo shrinks the error is measured now
    and then, so that most steps need no redo whose only use is to show that nothing changed.
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
        self.drives = tuple(drives)
        self.tolerance = tolerance
        self.redos = redos if all(c.can_restore for c in components.values()) else 0
        self.passes = 0
        sources = sorted({c.source for c in connections}, key=lambda p: (list(components).index(p.component), p))
        self._places = {port: place for place, port in enumerate(sources)}
        self._shown = np.zeros(len(sources))
        self._nominal = np.array([_nominal(components[p.component], p.variable) for p in sources])
        self._seats = {name: self._seat(name, connections) for name in components}
        self._order = self._gauss_seidel_order(connections)
        self._drive_places = [(self._seats[p.component].inputs, p.variable) for p in drives]
        self._drive_slots = [(block.values, block.names.index(name)) for block, name in self._drive_places]
        groups = levels(components, connections)
        self._levels = [self._level(group) for group in groups]
        self._after_drives = [self._level(group) for group in self._downstream(groups)]
        self._driven = np.full(len(drives), np.nan)
        self._past: deque[tuple[float, Array]] = deque(maxlen=PAST)
        self._contraction, self._contraction_at, self._steps = 1.0, 0.0, 0

    def _seat(self, name: str, connections: Sequence[Connection]) -> Seat:
        component = self.components[name]
        own = [port for port in self._places if port.component == name]
        first = self._places[own[0]] if own else 0
        stamped = STAMP in component.variables
        driven = [port.variable for port in self.drives if port.component == name]
        wired = [c for c in connections if c.target.component == name]
        return Seat(
            component=component,
            outputs=component.block([p.variable for p in own], self._shown[first : first + len(own)]),
            inputs=component.block([STAMP] * stamped + driven + [c.target.variable for c in wired]),
            sources=np.array([self._places[c.source] for c in wired], dtype=np.intp),
            stamped=stamped,
        )

    def _gauss_seidel_order(self, connections: Sequence[Connection]) -> list[Seat]:
        """Components that show some output without waiting for an input go first."""
        fed = {(c.target.component, c.target.variable) for c in connections}

        def waits(name: str) -> bool:
            direct = direct_inputs(self.components[name])
            own = [port.variable for port in self._places if port.component == name]
            return all(any((name, known) in fed for known in direct[variable]) for variable in own)

        return [self._seats[name] for name in sorted(self.components, key=waits)]

    def _level(self, group: Sequence[Connection]) -> Level:
        reads = []
        for name in dict.fromkeys(c.source.component for c in group):
            ports = list(dict.fromkeys(c.source for c in group if c.source.component == name))
            places = np.array([self._places[port] for port in ports], dtype=np.intp)
            reads.append((self.components[name], self.components[name].block([p.variable for p in ports]), places))
        targets = dict.fromkeys(c.target.component for c in group)
        return Level(tuple(reads), tuple(self._seats[name] for name in targets))

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

    def settle(self, time: float, drives: Array) -> None:
        """Set all inputs at ``time`` and pass outputs on until every input holds; for initialization."""
        self._drive(drives)
        self._pass_on(time, self._levels)
        self._past.clear()
        self._past.append((time, self._shown.copy()))

    def _drive(self, values: Array) -> None:
        for (block, place), value in zip(self._drive_slots, values, strict=True):
            block[place] = value
        self._driven = values

    def _pass_on(self, time: float, among: Sequence[Level]) -> None:
        for seat in self._order:
            seat.write(time, self._shown)
        for level in among:
            for component, block, places in level.reads:
                component.read(block)
                self._shown[places] = block.values
            for seat in level.writes:
                seat.write(time, self._shown)

    def step(self, time: float, step: float, start: Array, end: Array) -> int:
        """One macro step under driven inputs that are ``start`` at its begin and ``end`` at its end.

        Returns the number of redos.
        """
        jumped = not np.array_equal(start, self._driven)
        self._drive(start)
        self._pass_on(time, self._after_drives if jumped else ())
        if self.redos:
            for seat in self._order:
                seat.component.save()
        self._forget_contraction(step)
        self._guess(time + step)
        self._drive(end)
        change = self._pass(time, step)
        redo = 0
        while redo < self.redos and not change * self._contraction <= self.tolerance:
            for seat in self._order:
                seat.component.restore()
            redo += 1
            earlier, change = change, self._pass(time, step)
            self._contraction = min(1.0, max(change / max(earlier, LEAST_CONTRACTION), LEAST_CONTRACTION))
        self._past.append((time + step, self._shown.copy()))
        return redo

    def _forget_contraction(self, step: float) -> None:
        if abs(step - self._contraction_at) > 0.1 * step or self._steps % REMEASURED == 0:
            self._contraction, self._contraction_at = 1.0, step
        self._steps += 1

    def _guess(self, time: float) -> None:
        """Extrapolate all outputs by the polynomial through their past."""
        times = [at for at, _ in self._past]
        guess = np.zeros_like(self._shown)
        for index, (at, values) in enumerate(self._past):
            weight = 1.0
            for other in times[:index] + times[index + 1 :]:
                weight *= (time - other) / (at - other)
            guess += weight * values
        self._shown[:] = guess

    def _pass(self, time: float, step: float) -> float:
        """Each component steps in turn; returns the largest change of an output, relative to its nominal value."""
        self.passes += 1
        before = self._shown.copy()
        for seat in self._order:
            seat.write(time + step, self._shown)
            seat.component.step(time, step)
            if seat.outputs.count:
                seat.component.read(seat.outputs)
        return float(np.max(np.abs(self._shown - before) / self._nominal, initial=0.0))


def _nominal(component: Component, name: str) -> float:
    return float(component.variables[name].nominal or 1.0)
