"""One macro step of a wired system, redone until inputs and outputs agree at its end.

The outputs at the end of the step are guessed from their past. Then each component in turn steps over ``[t, t + h]``
on inputs that run from their values at ``t`` to those last known at ``t + h`` (value and rate at both ends and in the
middle, a Hermite polynomial), and shows its outputs there. While that changes more than the tolerance, all go back to
their saved states and step again. Converged, the step is symmetric in time: the coupling neither creates nor eats
energy.

Source: Kuebler and Schiehlen (2000), Mathematical and Computer Modelling of Dynamical Systems 6(2), 93-113, on
iterated coupling; the polynomial through value and rate at both ends is the Hermite form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .acceleration import Lessons, Secants
from .agreement import Agreement
from .audit import Account, Bond
from .bends import Bends
from .checkpoint import Checkpoint
from .component import Component, ComponentError
from .fallback import fallback
from .held import Held
from .hermite import chains_of
from .prediction import Prediction
from .rates import Rates
from .seat import MIDDLE_STAMP, STAMP, Level, Places, Seat, order_of, takes_middle
from .turns import downstream, fed_back, gauss_seidel_order
from .units import nominal_of
from .wiring import Connection, Port, WiringError, check, check_rates, levels

Array = NDArray[np.float64]

MOST_ROUNDS, SETTLED = 20, 1e-12
ROUNDING = 1e-13
# Of nominal values: who errs by more after all redos has not merely rounded.
LOST = 1e-3


class Coupling:
    """A wired system of components, ready to step.

    ``drives`` are the input ports that the master itself sets; ``bonds`` are audited for energy; ``kinks`` are
    outputs at whose sign changes other outputs have a kink, see :mod:`.kinks`. ``tolerance`` is relative to the
    nominal values of the connected outputs; with a ``share``, that of what the polynomials of a step miss is enough,
    see :class:`Agreement`. ``redos`` bounds the redos of a step. What a redo is given is improved by what earlier
    ones have shown, see :class:`Secants`. ``can_redo`` and ``can_cut`` are False where some FMU cannot save its
    state: then no step is redone, or cut at kinks. ``order`` is that of the error in the step. ``rates`` are pairs
    whose target takes the rate of the source, worked out from its past, see :class:`Rates`. ``memory`` gives the array
    in which the values of all inputs stand, so that a watching process may see them.
    """

    def __init__(
        self,
        components: Mapping[str, Component],
        connections: Sequence[Connection],
        drives: Sequence[Port],
        bonds: Sequence[Bond] = (),
        kinks: Sequence[Port] = (),
        tolerance: float = 1e-10,
        redos: int = 8,
        memory: Callable[[Sequence[Port]], Array] | None = None,
        rates: Sequence[Connection] = (),
    ) -> None:
        check(components, connections)
        check_rates(components, rates)
        self.components = dict(components)
        self.drives = tuple(drives)
        self.tolerance = tolerance
        self.redos = redos
        self.share = 0.0
        self.can_redo = all(c.can_restore for c in components.values())
        self.can_cut = self.can_redo and all(c.takes_any_step for c in components.values())
        without = fallback(components, connections, drives, rates)
        self.account = Account(without=without, doubted=np.zeros(len(without.estimated)))
        names = list(components)
        connected = {wire.source for wire in (*connections, *rates)}
        shown = sorted(connected | set(kinks), key=lambda p: (names.index(p.component), p))
        estimated = list(dict.fromkeys(pair.source for pair in rates))
        # Estimated rates stand behind all outputs, as if some nameless component showed them.
        all_shown = [*shown, *map(_rate_of, estimated)]
        wires = [*connections, *(Connection(_rate_of(pair.source), pair.target) for pair in rates)]
        self._shown = np.zeros(len(all_shown))
        self._rates = Rates(_places(shown, estimated), np.arange(len(shown), len(all_shown)))
        self._nominal = np.array([nominal_of(components[p.component].variables[p.variable]) for p in shown])
        given = [port for name in names for port in self._inputs_of(name, wires)]
        self._given = np.zeros(len(given)) if memory is None else memory(given)
        self._seats = {name: self._seat(name, wires, all_shown, given) for name in names}
        self._order = [self._seats[name] for name in gauss_seidel_order(components, connections, shown)]
        self._drive_places = _places(given, drives)
        groups = levels(components, connections)
        self._levels = [self._level(group, shown) for group in groups]
        self._held = Held(components, shown)
        jumping = [*drives, *self._held.targets(connections)]
        self._jumping = [self._seats[name] for name in dict.fromkeys(port.component for port in jumping)]
        self._after_jumps = [self._level(group, shown) for group in downstream(components, groups, jumping)]
        efforts, flows = [bond.effort for bond in bonds], [bond.flow for bond in bonds]
        self._bond_sent = _places(shown, [c.source for c in efforts]), _places(shown, [c.source for c in flows])
        self._bond_given = _places(given, [c.target for c in efforts]), _places(given, [c.target for c in flows])
        self._kink_places = _places(shown, kinks)
        self._driven = np.full(len(drives), np.nan)
        self._reached: float | None = None
        self.lost = False
        self._fed_back = fed_back([seat.component.name for seat in self._order], (*connections, *rates), shown)
        self._scale = self._nominal[self._fed_back]
        self._guessing = [seat for seat in self._order if np.isin(seat.sources, self._fed_back).any()]
        chains = chains_of(components, shown, set(self._fed_back.tolist()))
        self._prediction = Prediction(chains, self._fed_back, self._scale)
        self._agreement = Agreement(Bends(chains, self._nominal))
        self.order = order_of(self._order, wires)
        self._lessons = Lessons(len(self._fed_back))
        self._secants = Secants(len(self._fed_back))

    def _inputs_of(self, name: str, connections: Sequence[Connection]) -> list[Port]:
        component = self.components[name]
        stamp = [Port(name, STAMP)] * (STAMP in component.variables)
        stamp += [Port(name, MIDDLE_STAMP)] * takes_middle(component, connections)
        driven = [port for port in self.drives if port.component == name]
        return [*stamp, *driven, *(c.target for c in connections if c.target.component == name)]

    def _seat(self, name: str, connections: Sequence[Connection], shown: Sequence[Port], given: Sequence[Port]) -> Seat:
        component = self.components[name]
        outputs = [place for place, port in enumerate(shown) if port.component == name]
        inputs = [place for place, port in enumerate(given) if port.component == name]
        mine, taken = slice(*_ends(outputs)), slice(*_ends(inputs))
        sources = _places(shown, [c.source for c in connections if c.target.component == name])
        return Seat(
            component=component,
            outputs=component.block([port.variable for port in shown[mine]], self._shown[mine]),
            inputs=component.block([port.variable for port in given[taken]], self._given[taken]),
            taken=taken,
            sources=sources,
            fed=self._given[taken][len(inputs) - len(sources) :],
            stamped=STAMP in component.variables,
            middle=takes_middle(component, connections),
        )

    def _level(self, group: Sequence[Connection], shown: Sequence[Port]) -> Level:
        reads = []
        for name in dict.fromkeys(c.source.component for c in group):
            ports = list(dict.fromkeys(c.source for c in group if c.source.component == name))
            block = self.components[name].block([port.variable for port in ports])
            reads.append((self.components[name], block, _places(shown, ports)))
        targets = dict.fromkeys(c.target.component for c in group)
        return Level(tuple(reads), tuple(self._seats[name] for name in targets))

    def settle(self, time: float, drives: Array) -> None:
        """Set all inputs at ``time`` and pass outputs on until every input holds; for initialization."""
        self._drive(drives)
        for _ in range(MOST_ROUNDS):
            before = self._shown.copy()
            self._pass_on(time, self._order, self._levels)
            if np.allclose(self._shown, before, rtol=SETTLED, atol=SETTLED, equal_nan=True):
                break
        else:
            raise WiringError(f"outputs at {time:g} s do not settle: they depend on each other without delay")
        for seat in self._order:
            seat.show()
        self.forget(time)

    def forget(self, time: float) -> None:
        """Carry nothing over ``time``, which is now: some output has a kink there."""
        self._lessons.forget()
        self._agreement.forget()
        self._prediction.forget(time, self._shown)

    def kinks(self) -> Array:
        """The outputs whose signs tell of kinks, as last shown."""
        values: Array = self._shown[self._kink_places]
        return values

    def _drive(self, values: Array) -> None:
        self._given[self._drive_places] = values
        self._driven = values

    def _pass_on(self, time: float, seats: Sequence[Seat], among: Sequence[Level] = ()) -> None:
        for seat in seats:
            seat.write(time, self._shown)
        for level in among:
            level.pass_on(time, self._shown)

    def step(self, time: float, step: float, start: Array, end: Array) -> None:
        """One macro step under driven inputs that are ``start`` at its begin and ``end`` at its end."""
        before = self.attempt(time, step, start, end)
        if before is not None:
            self.release(before)
        self.pass_on_guessed()

    def attempt(self, time: float, step: float, start: Array, end: Array) -> Checkpoint | None:
        """A step as :meth:`step` makes it; returns where it began, to be let go, if the components can go back.

        Where an FMU fails that can go back all of them have done so when ComponentError is raised.
        """
        jumped = not (np.abs(start - self._driven) <= ROUNDING * np.abs(start)).all()
        jumped |= self._held.begin(self._shown)
        if jumped:
            self._drive(start)
            self._pass_on(time, self._jumping, self._after_jumps)
        before = self.save() if self.can_redo else None
        try:
            redos, agreed = self._iterate(time, step, end, before)
        except BaseException as error:
            if before is not None:
                if isinstance(error, ComponentError) and error.can_restore:
                    self.restore(before)
                self.release(before)
            raise
        self._enter_books(step, redos, agreed)
        self.lost = not agreed and redos > 0 and not self._secants.error() < LOST
        self._reached = time + step
        if not agreed:
            self.pass_on_guessed()
        self._held.end(self._shown)
        self._prediction.end(time + step, self._shown)
        return before

    def pass_on_guessed(self) -> None:
        """Set the inputs that were guessed for the end of the last attempt as they are known now.

        Where inputs and outputs agree that moves what is shown by no more than these differ: it waits until it is read.
        """
        if self._reached is not None:
            self._pass_on(self._reached, self._guessing)
            self._reached = None

    def _iterate(self, time: float, step: float, end: Array, before: Checkpoint | None) -> tuple[int, bool]:
        """Pass until outputs agree with what was guessed of them; returns the number of redos, and if they do."""
        begun, shown = self._given.copy(), self._shown.copy()
        self._secants = self._lessons.of(step)
        self._secants.begin()
        self._prediction.begin(time + step, self._shown)
        self._rates.begin(self._prediction.memory.past, time + step)
        self._drive(end)
        error = self._pass(time, step, begun, self._shown[self._fed_back] / self._scale)
        redos = 0
        most = 0 if before is None else self.redos
        while self._agreement.lacking(error, self.tolerance, self.share, shown, self._shown, step, last=redos == most):
            if before is None or redos == most:
                return redos, False
            guess = self._secants.next()
            self._shown[self._fed_back] = guess * self._scale
            self._restore_states(before)
            redos += 1
            error = self._pass(time, step, begun, guess)
        return redos, True

    def _pass(self, time: float, step: float, begun: Array, given: Array) -> float:
        """Each component steps in turn; returns by how much outputs still err at most.

        Like what is ``given`` of those fed back, relative to nominal values.
        """
        self.account.passes += 1
        self._rates.fill(self._shown)
        self._held.hold(self._shown)
        for seat in self._order:
            seat.advance(time, step, begun, self._shown)
            self._rates.fill(self._shown)
            self._held.hold(self._shown)
        shown = self._shown[self._fed_back] / self._scale
        self._secants.learn(given, shown)
        return self._secants.error()

    def _enter_books(self, step: float, redos: int, agreed: bool) -> None:
        (sent_effort, sent_flow), (given_effort, given_flow) = self._bond_sent, self._bond_given
        self.account.enter(
            step,
            redos,
            agreed,
            (self._shown[sent_effort], self._shown[sent_flow]),
            (self._given[given_effort], self._given[given_flow]),
        )
        if self._rates.count:
            self.account.doubt(self._rates.doubts(self._shown))

    def save(self) -> Checkpoint:
        """Where everything is now; let it go with :meth:`release`."""
        states = tuple(seat.component.save() for seat in self._order)
        return Checkpoint(
            states, self._shown.copy(), self._given.copy(), self._driven, copy(self.account), self._prediction.memory
        )

    def restore(self, checkpoint: Checkpoint) -> None:
        """Go back to a checkpoint."""
        self._restore_states(checkpoint)
        self._shown[:] = checkpoint.shown
        self._given[:] = checkpoint.given
        self._held.forget()
        self._driven = checkpoint.driven
        self.account = replace(checkpoint.account, passes=self.account.passes)
        self._reached = None
        self._prediction.memory = checkpoint.memory

    def release(self, checkpoint: Checkpoint) -> None:
        """Let a checkpoint go."""
        for seat, state in zip(self._order, checkpoint.states, strict=True):
            seat.component.release(state)

    def _restore_states(self, checkpoint: Checkpoint) -> None:
        for seat, state in zip(self._order, checkpoint.states, strict=True):
            seat.component.restore(state)


def _rate_of(port: Port) -> Port:
    return Port("", f"rate of {port}")


def _places(among: Sequence[Port], ports: Sequence[Port]) -> Places:
    return np.array([among.index(port) for port in ports], dtype=np.intp)


def _ends(places: Sequence[int]) -> tuple[int, int]:
    """The slice that covers places which follow each other."""
    return (places[0], places[-1] + 1) if places else (0, 0)
