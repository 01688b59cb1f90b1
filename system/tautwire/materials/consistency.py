"""Whether the columns of a table agree with each other, within the digits that were written.

    |E*| = sigma / eps,  E' = |E*| cos(phi),  E'' = |E*| sin(phi),  eta = tan(phi) = E'' / E',
    |E*| = sqrt(E'^2 + E''^2),  c = E' eta / (2 pi f) = E'' / (2 pi f)

Every input may be off by half a unit of its last digit, so each relation gives a range; the written value agrees where
its own range meets that one.

Source: Baklouti et al. 2017, Eqs. 8 and 9 and the text before them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from .table import MaterialRow, MaterialTable, Quantity

Agreement = Literal["agrees", "agrees if cut off", "disagrees"]

_SLOPE_STEP = 1e-6


@dataclass(frozen=True)
class Relation:
    """How ``column`` follows from the columns ``given``; ``formula`` in words, ``value(f, *given)`` in numbers.

    ``measured`` where the given columns are what a test measures, so that their errors are independent.
    """

    column: str
    formula: str
    given: tuple[str, ...]
    value: Callable[..., float]
    measured: bool = True


_STRESS = ("stress_amplitude", "strain_amplitude")
_POLAR = ("dynamic_modulus", "phase")
_DERIVED = ("storage_modulus", "loss_factor")
RELATIONS: tuple[Relation, ...] = (
    Relation("dynamic_modulus", "sigma / eps", _STRESS, lambda f, stress, strain: stress / strain),
    Relation("storage_modulus", "|E*| cos phi", _POLAR, lambda f, size, phase: size * math.cos(phase)),
    Relation("loss_modulus", "|E*| sin phi", _POLAR, lambda f, size, phase: size * math.sin(phase)),
    Relation("loss_factor", "tan phi", ("phase",), lambda f, phase: math.tan(phase)),
    Relation(
        "loss_factor", "E'' / E'", ("loss_modulus", "storage_modulus"), lambda f, loss, storage: loss / storage, False
    ),
    Relation(
        "dynamic_modulus", "E' sqrt(1 + eta^2)", _DERIVED, lambda f, storage, eta: storage * math.hypot(1.0, eta), False
    ),
    Relation("damping", "E' eta / (2 pi f)", _DERIVED, lambda f, storage, eta: storage * eta / (2.0 * math.pi * f)),
    Relation(
        "damping",
        "|E*| sin phi / (2 pi f)",
        _POLAR,
        lambda f, size, phase: size * math.sin(phase) / (2.0 * math.pi * f),
    ),
    Relation("damping", "E'' / (2 pi f)", ("loss_modulus",), lambda f, loss: loss / (2.0 * math.pi * f)),
)


@dataclass(frozen=True)
class Check:
    """One relation in one row: the ``written`` value beside the ``recomputed`` one, in SI units.

    ``low`` and ``high`` bound the recomputed value for the digits of its inputs; ``uncertainty`` is propagated from
    theirs, None where one has none or they are not independent; ``off`` is by how much the ranges miss each other.
    """

    frequency: float
    column: str
    formula: str
    written: float
    recomputed: float
    low: float
    high: float
    uncertainty: float | None
    written_uncertainty: float | None
    off: float
    agreement: Agreement


def checks(table: MaterialTable) -> tuple[Check, ...]:
    """Every relation whose columns a row has, row by row."""
    return tuple(check for row in table.rows for check in _row_checks(row))


def disagreements(found: Sequence[Check]) -> tuple[Check, ...]:
    """The checks that fail, those that only fit digits cut off rather than rounded included."""
    return tuple(check for check in found if check.agreement != "agrees")


def understated(found: Sequence[Check]) -> tuple[Check, ...]:
    """The checks whose written uncertainty is below the propagated one by more than a tenth of it."""
    return tuple(
        check
        for check in found
        if check.uncertainty is not None
        and check.written_uncertainty is not None
        and check.written_uncertainty < 0.9 * check.uncertainty
    )


def _row_checks(row: MaterialRow) -> Iterator[Check]:
    for relation in RELATIONS:
        written = row.quantities.get(relation.column)
        given = [row.quantities[name] for name in relation.given if name in row.quantities]
        if written is not None and len(given) == len(relation.given):
            yield _check(row.frequency, relation, written, given)


def _check(frequency: float, relation: Relation, written: Quantity, given: Sequence[Quantity]) -> Check:
    def value(*numbers: float) -> float:
        return relation.value(frequency, *numbers)

    middle = [quantity.value for quantity in given]
    # Every relation is monotonic in each of its inputs, so the corners bound it.
    corners = [
        value(*corner) for corner in product(*((q.value - 0.5 * q.digit, q.value + 0.5 * q.digit) for q in given))
    ]
    low, high = min(corners), max(corners)
    off = _gap(written.value - 0.5 * written.digit, written.value + 0.5 * written.digit, low, high)
    cut = _gap(written.value, written.value + written.digit, low, high)
    return Check(
        frequency=frequency,
        column=relation.column,
        formula=relation.formula,
        written=written.value,
        recomputed=value(*middle),
        low=low,
        high=high,
        uncertainty=_propagated(value, given) if relation.measured else None,
        written_uncertainty=written.uncertainty,
        off=off,
        agreement="agrees" if off == 0.0 else "agrees if cut off" if cut == 0.0 else "disagrees",
    )


def _gap(low: float, high: float, other_low: float, other_high: float) -> float:
    """By how much two ranges miss each other; rounding of the arithmetic itself is no gap."""
    gap = max(other_low - high, low - other_high, 0.0)
    return gap if gap > 1e-12 * max(abs(high), abs(other_high)) else 0.0


def _propagated(value: Callable[..., float], given: Sequence[Quantity]) -> float | None:
    """One standard deviation of the value, to first order, for independent inputs."""
    if any(quantity.uncertainty is None for quantity in given):
        return None
    middle = np.array([quantity.value for quantity in given])
    total = 0.0
    for place, quantity in enumerate(given):
        step = np.zeros(len(given))
        step[place] = _SLOPE_STEP * max(abs(quantity.value), 1e-3)
        slope = (value(*(middle + step)) - value(*(middle - step))) / (2.0 * step[place])
        total += (slope * float(quantity.uncertainty or 0.0)) ** 2
    return math.sqrt(total)
