"""Halves the step of the experiments until the matrices, extrapolated to no step at all, hold still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..master import Port
from .experiments import Bench, IdentificationError, Responses, respond
from .realisation import TINY, Matrices, Signals, realise

Array = NDArray[np.float64]

HALVINGS = 8
WORST = 1e-3
DIVERGED = 100.0
OTHERWISE = 0.1
NO_FEEDTHROUGH = 1e-3
FASTEST, FREQUENCIES = 0.5, 12


@dataclass(frozen=True)
class Refined:
    """Matrices with the shortest step (s) taken, their relative ``error`` by estimate, and the last responses."""

    matrices: Matrices
    step: float
    error: float
    responses: Responses


def refine(bench: Bench, signals: Signals, step: float, error: float) -> Refined:
    """Begin with ``step`` (s) and halve it until extrapolated matrices change by less than ``error``.

    Raises IdentificationError where none comes near.
    """
    tables: dict[int, list[Matrices]] = {}
    best: Refined | None = None
    first: Responses | None = None
    pushes: Array | None = None
    reference: Matrices | None = None
    for length in (step / 2**halving for halving in range(HALVINGS + 1)):
        responses = respond(bench, length, pushes)
        first = first or responses
        pushes = responses.pushes
        matrices = realise(responses, signals)
        if matrices is None or (reference is not None and len(matrices.A) != len(reference.A)):
            tables, reference = {}, None
        if matrices is None:
            continue
        if reference is None:
            reference = matrices
        elif signals.states is None:
            matrices = _aligned(matrices, reference, step)
        before = tables
        # What creeps on unseen meanwhile errs in the first order, whatever that of the coupling.
        tables = {order: _extrapolated(before.get(order, []), matrices, order) for order in (bench.order, 1)}
        if not before:
            continue
        norm = _Norm(responses, signals)
        changes = {order: norm.distance(row[-1], before[order][-1]) for order, row in tables.items()}
        order = min(changes, key=changes.__getitem__)
        change = changes[order]
        if best is None or change < best.error:
            best = Refined(tables[order][-1], length, change, responses)
        if change <= error or change > DIVERGED * best.error:
            break
    if first is None or best is None or best.error > WORST:
        worst = "" if best is None else f", at {best.step:.2g} s the matrices still change by {best.error:.2g}"
        raise IdentificationError(f"no step from {step:g} s down is short enough{worst}", "begin with a shorter step")
    _refuse_another_past(best.matrices, first, signals, bench.seen)
    return best


def _refuse_another_past(matrices: Matrices, responses: Responses, signals: Signals, seen: Sequence[Port]) -> None:
    """The longest experiment must be what the matrices say: short ones do not see dead time, nor slow states."""
    order, step = len(matrices.A), responses.step
    twice = np.block([[matrices.A, np.eye(order)], [np.zeros((order, 2 * order))]])
    moved = expm(step * twice)
    states = moved[:order, order:] @ matrices.B * responses.pushes
    free = []
    for _ in responses.free:
        states = moved[:order, :order] @ states
        free.append((matrices.C @ states).T)
    places = list(signals.outputs)
    off = np.max(np.abs(np.array(free) - responses.free[:, :, places]), axis=(0, 1))
    shares = off / responses.sizes[places]
    worst = int(np.argmax(shares))
    if shares[worst] > OTHERWISE:
        raise IdentificationError(
            f"{seen[places[worst]]} is off the plant of short steps by {shares[worst]:.0%} over a longer time",
            "leave outputs with dead time away, or begin with a shorter step",
        )


def _extrapolated(table: Sequence[Matrices], matrices: Matrices, order: int) -> list[Matrices]:
    """The next row of Neville's table: matrices without the errors of order, order + 1 ... in the step."""
    row = [matrices]
    for power, coarse in enumerate(table, start=order):
        weight = 1.0 / (2.0**power - 1.0)
        fine = row[-1]
        mixed = {name: getattr(fine, name) + weight * (getattr(fine, name) - getattr(coarse, name)) for name in "ABCD"}
        row.append(Matrices(**mixed, sizes=matrices.sizes, residual=matrices.residual))
    return row


@dataclass(frozen=True)
class _Norm:
    """Compares systems in units of the largest deviations in the experiments."""

    responses: Responses
    signals: Signals

    def distance(self, one: Matrices, other: Matrices) -> float:
        """The largest relative difference in the norm of :func:`tautwire.linear.linearise_fmus`."""
        pushes = self.responses.pushes
        shown = self.responses.sizes[list(self.signals.outputs)]
        if self.signals.states is None:
            return self._in_response(one, other, pushes / shown[:, None])
        states = np.maximum(other.sizes, TINY)
        scales = {"A": (states, states), "B": (states, pushes), "C": (shown, states), "D": (shown, pushes)}
        worst = 0.0
        for name, (rows, columns) in scales.items():
            unit = columns / rows[:, None]
            size = float(np.linalg.norm(getattr(other, name) * unit))
            change = float(np.linalg.norm((getattr(one, name) - getattr(other, name)) * unit))
            # Outputs that no input reaches at once have no D but rounding.
            worst = max(worst, change / max(size, NO_FEEDTHROUGH if name == "D" else TINY))
        return worst

    def _in_response(self, one: Matrices, other: Matrices, unit: Array) -> float:
        fastest = FASTEST / self.responses.step
        instants = 1j * np.geomspace(1e-3 * fastest, fastest, FREQUENCIES)
        pairs = [(_response(one, s) * unit, _response(other, s) * unit) for s in instants]
        return max(float(np.linalg.norm(a - b) / max(float(np.linalg.norm(b)), TINY)) for a, b in pairs)


def _response(matrices: Matrices, at: complex) -> NDArray[np.complex128]:
    """``C (s I - A)^-1 B + D``."""
    moved = np.linalg.solve(at * np.eye(len(matrices.A)) - matrices.A, matrices.B)
    response: NDArray[np.complex128] = matrices.C.astype(complex) @ moved + matrices.D
    return response


def _aligned(matrices: Matrices, reference: Matrices, span: float) -> Matrices:
    """The same system in the states of another realisation of it: those that show the same for some time."""
    turn, *_ = np.linalg.lstsq(_seen(reference, span), _seen(matrices, span), rcond=None)
    back = np.linalg.inv(turn)
    return Matrices(
        A=turn @ matrices.A @ back,
        B=turn @ matrices.B,
        C=matrices.C @ back,
        D=matrices.D,
        sizes=reference.sizes,
        residual=matrices.residual,
    )


def _seen(matrices: Matrices, span: float) -> Array:
    """What each state shows in so many instants as there are states, and now, (instants p, n)."""
    return np.concatenate([matrices.C @ expm(matrices.A * span * k) for k in range(len(matrices.A) + 1)], axis=0)
