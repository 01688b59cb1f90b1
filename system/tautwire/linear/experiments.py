"""Small pulses on a wired system of FMUs at rest, and what comes of them; the FMUs are black boxes.

Each pulse holds one input a little above its value at rest for one step and lets the system run free for some more;
then the same below. Half the difference is the linear response: what is even in the pulse cancels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from ..interrupt import interrupts_held
from ..master import Coupling, Port

Array = NDArray[np.float64]
Make = Callable[[], AbstractContextManager[Coupling]]

SAMPLES = 16
# The coupling agrees to rounding: what it leaves is noise on small responses.
TOLERANCE, REDOS = 1e-13, 20
FIRST_PUSH, LARGEST_PUSH, SMALLEST_PUSH = 1e-2, 1e-1, 1e-7
# The even part of a response, relative to the odd one: between them rounding and bending both stay small.
STRAIGHT, FINE, ROUNDS = 3e-4, 1e-8, 4
KINK, MOST_KINK = 1e-2, 1e-1
MOST_ORDER, PARTS = 4, 8
DRIFT, MOST_DRIFT = 1e-2, 10.0
# Of a variable's nominal value, or its value at rest: deviations that are none.
UNFELT = 1e-10
LEAST = 1e-6


class IdentificationError(TautwireError):
    """A wired system of FMUs cannot be linearised from outside; carries the ``reason`` and what to do, ``mend``."""

    def __init__(self, reason: str, mend: str) -> None:
        self.reason = reason
        self.mend = mend
        super().__init__(f"the FMUs cannot be linearised: {reason}; {mend}")


@dataclass(frozen=True)
class Responses:
    """Responses to m pulses of one step (s), seen at p ports.

    ``held`` (m, p) at the end of the pulse, ``free`` (N, m, p) after 1 ... N steps without it, both for ``pushes``
    (m,) of the inputs. ``sizes`` (p,) are the largest deviations, or what counts as none; in these units ``evenness``
    (m,) is the even part of each response relative to the odd one, and ``drifts`` (p,) is what moves without a push.
    """

    step: float
    held: Array
    free: Array
    sizes: Array
    pushes: Array
    evenness: Array
    drifts: Array


class Bench:
    """A system of FMUs at rest, ready for pulses; each begins from the same saved state, or from a new start.

    Made with :func:`on_bench`. ``rest`` (k,) are the values of the coupling's drives at rest, ``inputs`` those of
    them that are pushed, ``seen`` the ports that are read, with what counts as no deviation of each, ``unfelt``.
    ``order`` is that of the error in the step, or the least that it may be.
    """

    def __init__(
        self, stack: ExitStack, make: Make, rest: Mapping[Port, float], inputs: Sequence[Port], seen: Sequence[Port]
    ) -> None:
        self._raise_interrupt = stack.enter_context(interrupts_held())
        self._make = make
        self._given = dict(rest)
        self.inputs, self.seen = tuple(inputs), tuple(seen)
        self._coupling = self._start(stack)
        self._base = self._coupling.save() if self._coupling.can_redo else None
        if self._base is not None:
            stack.callback(self._coupling.release, self._base)
        self._whole = self._coupling.can_redo and not self._coupling.account.without.estimated
        self.order = min(self._coupling.order, MOST_ORDER) if self._whole else 1
        resting = self._resting(self._coupling)[self._places(self._coupling)]
        self.nominal = np.maximum(self._nominal(inputs), np.abs(resting))
        self.unfelt = UNFELT * np.maximum(self._nominal(seen), np.abs(self._read(self._coupling)))

    def _start(self, stack: ExitStack) -> Coupling:
        coupling = stack.enter_context(self._make())
        missing = [str(port) for port in self.inputs if port not in coupling.drives]
        if missing:
            raise IdentificationError(f"{', '.join(missing)} is no driven input", "choose among the coupling's drives")
        coupling.tolerance, coupling.redos = TOLERANCE, REDOS
        coupling.settle(0.0, self._resting(coupling))
        for component in coupling.components.values():
            component.run()
        return coupling

    def _nominal(self, ports: Sequence[Port]) -> Array:
        variables = [self._coupling.components[port.component].variables[port.variable] for port in ports]
        return np.array([abs(float(variable.nominal or 1.0)) for variable in variables])

    def _resting(self, coupling: Coupling) -> Array:
        return np.array([self._given.get(port, 0.0) for port in coupling.drives])

    def _places(self, coupling: Coupling) -> list[int]:
        return [coupling.drives.index(port) for port in self.inputs]

    @contextmanager
    def _at_rest(self) -> Iterator[Coupling]:
        if self._base is not None:
            self._coupling.restore(self._base)
            yield self._coupling
            return
        with ExitStack() as stack:
            yield self._start(stack)

    def run(self, index: int | None, push: float, step: float, samples: int) -> Array:
        """What is seen at the end of the pulse and after each free step, (1 + samples, p); None pushes nothing.

        A coupling that works something out from the past makes several steps of one, and begins each without a past:
        so what comes of a step follows from the FMUs alone.
        """
        self._raise_interrupt()
        parts = 1 if self._whole else PARTS
        with self._at_rest() as coupling:
            rest = self._resting(coupling)
            pushed = rest.copy()
            if index is not None:
                pushed[self._places(coupling)[index]] += push
            rows = np.empty((1 + samples, len(self.seen)))
            for k in range(1 + samples):
                drives = rest if k else pushed
                if not self._whole:
                    coupling.forget(k * step)
                for part in range(parts):
                    coupling.step((k + part / parts) * step, step / parts, drives, drives)
                rows[k] = self._read(coupling)
            return rows

    def _read(self, coupling: Coupling) -> Array:
        row = np.empty(len(self.seen))
        for name in dict.fromkeys(port.component for port in self.seen):
            places = [place for place, port in enumerate(self.seen) if port.component == name]
            component = coupling.components[name]
            block = component.block([self.seen[place].variable for place in places])
            component.read(block)
            if not np.all(np.isfinite(block.values)):
                component.refuse(block)
            row[places] = block.values
        return row


@contextmanager
def on_bench(make: Make, rest: Mapping[Port, float], inputs: Sequence[Port], seen: Sequence[Port]) -> Iterator[Bench]:
    """A bench that is cleared when the block ends."""
    with ExitStack() as stack:
        yield Bench(stack, make, rest, inputs, seen)


def respond(bench: Bench, step: float, pushes: Array | None = None, samples: int = SAMPLES) -> Responses:
    """Responses to a pulse on each input, pushed so far that neither rounding nor the bend of the laws is felt.

    ``pushes`` (m,) are a first guess. Raises IdentificationError where the system is not at rest, or at a kink.
    """
    pushes = FIRST_PUSH * bench.nominal if pushes is None else pushes.copy()
    still = bench.run(None, 0.0, step, samples)
    odd = np.zeros((len(pushes), *still.shape))
    even = np.zeros((len(pushes), still.shape[1]))
    wanted = np.ones(len(pushes), dtype=bool)
    for _ in range(ROUNDS):
        for index in np.flatnonzero(wanted):
            above = bench.run(int(index), pushes[index], step, samples)
            below = bench.run(int(index), -pushes[index], step, samples)
            odd[index] = 0.5 * (above - below)
            even[index] = np.max(np.abs(0.5 * (above + below) - still), axis=0)
        sizes = np.maximum(np.max(np.abs(odd), axis=(0, 1)), bench.unfelt)
        own = np.max(np.abs(odd) / sizes, axis=(1, 2), initial=0.0)
        evenness = np.max(even / sizes, axis=1, initial=0.0) / np.maximum(own, LEAST)
        better = _better_pushes(bench, pushes, evenness)
        wanted = better != pushes
        if not np.any(wanted):
            break
        last, pushes = pushes, better
    else:
        pushes = last
    _refuse_kinks(bench, evenness)
    drifts = _drifts(bench, still, sizes)
    return Responses(step, odd[:, 0], odd[:, 1:].transpose(1, 0, 2), sizes, pushes, evenness, drifts)


def _better_pushes(bench: Bench, pushes: Array, evenness: Array) -> Array:
    """Pushes whose responses should be even to about the geometric mean of the bounds; as they are where they fit."""
    aim = np.sqrt(STRAIGHT * FINE)
    factor = np.clip(aim / np.maximum(evenness, 1e-300), 1e-2, 1e2)
    factor[(evenness <= STRAIGHT) & (evenness >= FINE)] = 1.0
    better = np.clip(pushes * factor, SMALLEST_PUSH * bench.nominal, LARGEST_PUSH * bench.nominal)
    # Beyond the bound already, or so nearly there that it is not worth another run.
    return np.where(np.abs(better / pushes - 1.0) < 0.5, pushes, better)


def _refuse_kinks(bench: Bench, evenness: Array) -> None:
    worst = int(np.argmax(evenness))
    if evenness[worst] > MOST_KINK:
        raise IdentificationError(
            f"at a kink, what {bench.inputs[worst]} does upward and downward differs by {evenness[worst]:.0%}, however "
            "small the push",
            "start them where no cable is about to slacken and nothing is about to slip",
        )


def _drifts(bench: Bench, still: Array, sizes: Array) -> Array:
    """How far each port moves without a push, relative to ``sizes``."""
    moved = np.max(np.abs(still - still[0]), axis=0)
    drifts: Array = moved / sizes
    worst = int(np.argmax(drifts))
    if drifts[worst] > MOST_DRIFT:
        raise IdentificationError(
            f"they are not at rest, {bench.seen[worst]} moves by {moved[worst]:.3g} without a push",
            "start them in equilibrium, and give the drives' values there",
        )
    return drifts
