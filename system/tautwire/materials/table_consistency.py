"""Checks that the columns of a table agree with each other within the digits that were written.

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

from .material_table import MaterialRow, MaterialTable, Quantity

Agreement = Literal["agrees", "agrees if cut off", "disagrees"]

_RELATIVE_STEP = 1e-6

_STRESS = ("stress_amplitude", "strain_amplitude")
_POLAR = ("dynamic_modulus", "phase")
_DERIVED = ("storage_modulus", "loss_factor")


@dataclass(frozen=True)
class Relation:
    """How ``column`` follows from the columns ``inputs``; ``formula`` in words, ``value(f, *inputs)`` in numbers.

    ``has_independent_inputs`` where the inputs are what a test measures, so that their errors are independent.
    """

    column: str
    formula: str
    inputs: tuple[str, ...]
    value: Callable[..., float]
    has_independent_inputs: bool = True


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
class ConsistencyCheck:
    """Consistency check of one relation in one row: the ``written`` and the ``recomputed`` value, in SI units.

    ``low`` and ``high`` bound the recomputed value for the digits of its inputs; ``uncertainty`` is propagated from
    theirs, None where one has none or they are not independent; ``range_gap`` is the gap between the two ranges.
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
    range_gap: float
    agreement: Agreement


def consistency_checks(table: MaterialTable) -> tuple[ConsistencyCheck, ...]:
    """Check every relation whose columns a row has, row by row."""
    return tuple(check for row in table.rows for check in _checks_of_row(row))


def disagreements(checks: Sequence[ConsistencyCheck]) -> tuple[ConsistencyCheck, ...]:
    """Checks that fail, including those that agree only if digits were cut off rather than rounded."""
    return tuple(check for check in checks if check.agreement != "agrees")


def understated_uncertainties(checks: Sequence[ConsistencyCheck]) -> tuple[ConsistencyCheck, ...]:
    """Checks whose written uncertainty is below the propagated one by more than a tenth of it."""
    return tuple(
        check
        for check in checks
        if check.uncertainty is not None
        and check.written_uncertainty is not None
        and check.written_uncertainty < 0.9 * check.uncertainty
    )


def _checks_of_row(row: MaterialRow) -> Iterator[ConsistencyCheck]:
    for relation in RELATIONS:
        written = row.quantities.get(relation.column)
        inputs = [row.quantities[name] for name in relation.inputs if name in row.quantities]
        if written is not None and len(inputs) == len(relation.inputs):
            yield _check_relation(row.frequency, relation, written, inputs)


def _check_relation(
    frequency: float, relation: Relation, written: Quantity, inputs: Sequence[Quantity]
) -> ConsistencyCheck:
    def value(*numbers: float) -> float:
        return relation.value(frequency, *numbers)

    nominal = [quantity.value for quantity in inputs]
    # Every relation is monotonic in each of its inputs, so the corners bound it.
    corners = [
        value(*corner)
        for corner in product(*((q.value - 0.5 * q.resolution, q.value + 0.5 * q.resolution) for q in inputs))
    ]
    low, high = min(corners), max(corners)
    rounded_gap = _range_gap(
        written.value - 0.5 * written.resolution, written.value + 0.5 * written.resolution, low, high
    )
    truncated_gap = _range_gap(written.value, written.value + written.resolution, low, high)
    return ConsistencyCheck(
        frequency=frequency,
        column=relation.column,
        formula=relation.formula,
        written=written.value,
        recomputed=value(*nominal),
        low=low,
        high=high,
        uncertainty=_propagated_uncertainty(value, inputs) if relation.has_independent_inputs else None,
        written_uncertainty=written.uncertainty,
        range_gap=rounded_gap,
        agreement="agrees" if rounded_gap == 0.0 else "agrees if cut off" if truncated_gap == 0.0 else "disagrees",
    )


def _range_gap(low: float, high: float, other_low: float, other_high: float) -> float:
    """Gap between two ranges; rounding of the arithmetic itself is no gap."""
    gap = max(other_low - high, low - other_high, 0.0)
    return gap if gap > 1e-12 * max(abs(high), abs(other_high)) else 0.0


def _propagated_uncertainty(value: Callable[..., float], inputs: Sequence[Quantity]) -> float | None:
    """One standard deviation of the value, to first order, for independent inputs."""
    if any(quantity.uncertainty is None for quantity in inputs):
        return None
    nominal = np.array([quantity.value for quantity in inputs])
    variance = 0.0
    for index, quantity in enumerate(inputs):
        step = np.zeros(len(inputs))
        step[index] = _RELATIVE_STEP * max(abs(quantity.value), 1e-3)
        slope = (value(*(nominal + step)) - value(*(nominal - step))) / (2.0 * step[index])
        variance += (slope * float(quantity.uncertainty or 0.0)) ** 2
    return math.sqrt(variance)
