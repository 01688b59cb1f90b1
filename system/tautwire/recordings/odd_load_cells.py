"""Load cells that are read otherwise than in newtons from zero: one cell alone, all by one factor, or tared at rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..robot.schema import Robot
from ..robot.static_equilibrium import static_tensions
from .alternative_readings import NEGATE, Mistake, convert
from .column_corrections import ColumnCorrection, scaled
from .mistaken_motion import MIN_IMPROVEMENT
from .recording import Recording
from .weight_balance import FORCE_UNITS, ForceBalance

Array = NDArray[np.float64]

# A smaller misfit is for effects to explain, and a reading has to leave less than the second, whatever payloads do.
MIN_MISFIT, MAX_CORRECTED_MISFIT = 0.05, 0.3
# By what a payload may multiply all tensions.
MASS_RATIOS = (0.25, 10.0)
# Of the largest number that is shown: without load amplifiers show a tenth to a half of their range.
MIN_LIVE_ZERO = 0.02
POUND, MAX_POUND_ERROR = 0.45359237, 0.03  # kg
# What a tared cell begins below, of the static tension and of its own deviations, averaged over the time in s.
MAX_TARED_SHARE, MAX_TARED_DEVIATIONS, TARED_DURATION = 0.03, 0.5, 0.1
# By which changes of tared cells may be off their unit: model errors blur what little of the weight these are.
MAX_TARED_RATIO = 1.5
# Of one cell to the others: gains of cells differ by less. How far a cell may be off its unit, whatever a payload does.
CELL_RATIOS, MAX_UNIT_RATIO = (0.25, 4.0), 1.1
# Readings that leave no more than this times the least explain the forces as well.
EQUAL_RATIO, EQUAL_DIFFERENCE = 1.5, 0.005


@dataclass(frozen=True)
class CellReading:
    """A reading of the load cells: the misfit of forces that it leaves, and what was written otherwise.

    ``freedom`` counts the numbers that were fitted beside the first mistake.
    """

    misfit: float
    mistake: Mistake
    freedom: int = 0


def likely_cell_readings(robot: Robot, recording: Recording, balance: ForceBalance) -> tuple[CellReading, ...]:
    """The reading of load cells that mends the balance of forces best; empty where none mends it well."""
    misfit = balance.misfit(tuple(range(robot.cable_count)))
    if misfit <= MIN_MISFIT:
        return ()
    limit = min(MAX_CORRECTED_MISFIT, misfit / MIN_IMPROVEMENT)
    readings = [*_tared(robot, recording, balance), *_of_one_cell(balance), *_of_one_factor(balance)]
    readings += [*_of_live_zero(balance), *_of_two_factors(balance)]
    readings = [each for each in readings if each.misfit <= limit]
    best = EQUAL_RATIO * min((each.misfit for each in readings), default=0.0) + EQUAL_DIFFERENCE
    equal = [each for each in readings if each.misfit <= best]
    return tuple(sorted(equal, key=lambda each: (each.freedom, each.misfit))[:1])


def _misfit(balance: ForceBalance, factors: Array, offsets: Array | float = 0.0) -> float:
    tensions = balance.tensions * factors + np.where(balance.has_load_cell, offsets, 0.0)
    return replace(balance, tensions=tensions).misfit(tuple(range(len(factors))))


def _of_one_cell(balance: ForceBalance) -> Iterator[CellReading]:
    """One cell in another unit, or of the other sign."""
    for cell in np.flatnonzero(balance.has_load_cell):
        for unit, size in FORCE_UNITS.items():
            for sign in (1.0, -1.0):
                factors = np.ones(len(balance.has_load_cell))
                factors[cell] = sign * size
                name = f"tension_{cell + 1}"
                parts = [f"is in {unit}"] if unit != "N" else []
                parts += ["has the other sign"] if sign < 0.0 else []
                remedy = convert("it", sign * size)
                corrections = (ColumnCorrection(name, unit=unit if unit != "N" else "", factor=size, sign=sign),)
                mistake = Mistake(f"{name} alone {' and '.join(parts)}", remedy, corrections)
                if parts:
                    yield CellReading(_misfit(balance, factors), mistake)


def _of_one_factor(balance: ForceBalance) -> Iterator[CellReading]:
    """All cells by one factor that is no unit's, as the numbers of an amplifier or a converter have it."""
    count = len(balance.has_load_cell)
    factor = balance.best_factor(tuple(range(count)))
    if balance.pulls(factor) and not MASS_RATIOS[0] < factor < MASS_RATIOS[1]:
        mistake = Mistake(
            f"1 of tension_1 to tension_{count} is about {factor:.3g} N, as of an amplifier's volts or a converter's "
            f"counts, or the robot file's platform.mass is {factor:.3g} times the true one",
            "declare factor, and offset as the number without load, of each in [recording.columns], by its calibration",
        )
        yield CellReading(_misfit(balance, np.full(count, factor)), mistake)
    elif abs(factor * POUND - 1.0) <= MAX_POUND_ERROR:
        mistake = Mistake("the robot file's platform.mass is in lb", convert("it", POUND))
        yield CellReading(_misfit(balance, np.full(count, factor)), mistake)


def _of_live_zero(balance: ForceBalance) -> Iterator[CellReading]:
    """All cells by one factor that is no unit's, from one number without load, as 4 to 20 mA and 0.5 to 4.5 V have."""
    order = tuple(range(len(balance.has_load_cell)))
    ones = replace(balance, tensions=np.tile(np.where(balance.has_load_cell, 1.0, 0.0), (len(balance.tensions), 1)))
    shapes = np.column_stack([each.forces(order).ravel() for each in (balance, ones)])
    (factor, constant), _, rank, _ = np.linalg.lstsq(shapes, balance.required.ravel(), rcond=None)
    if rank < len(shapes.T) or factor <= 0.0:
        return
    zero, largest = -constant / factor, float(np.abs(balance.tensions).max())
    true = (factor * balance.tensions + constant)[:, balance.has_load_cell]
    is_newton = 1.0 / MAX_UNIT_RATIO < factor < MAX_UNIT_RATIO
    is_effect = is_newton or (MASS_RATIOS[0] < factor < MASS_RATIOS[1] and -constant < np.abs(true).mean())
    if is_effect or not MIN_LIVE_ZERO * largest < zero < largest:
        return
    names = [f"tension_{index + 1}" for index, has in enumerate(balance.has_load_cell) if has]
    shift = -float(f"{factor:.4g}") * zero
    corrections = tuple(ColumnCorrection(name, factor=float(f"{factor:.4g}"), shift=shift) for name in names)
    mistake = Mistake(
        f"1 of {names[0]} to {names[-1]} is about {factor:.3g} N above {zero:.4g}, which they show without load, as of "
        "4 to 20 mA, 0.5 to 4.5 V or a converter's counts from the middle of its range on",
        "read them so, or better by factor and offset of each cell's calibration",
        corrections,
    )
    yield CellReading(_misfit(balance, np.full(len(order), factor), constant), mistake, freedom=1)


def _of_two_factors(balance: ForceBalance) -> Iterator[CellReading]:
    """One cell of the other sign or by a factor of its own, beside others that may be in another unit."""
    cells = np.flatnonzero(balance.has_load_cell)
    pulls = np.einsum("bci,bi->bci", balance.directions, balance.tensions)
    for cell in cells if len(cells) > 1 else ():
        own, others = pulls[:, :, cell].ravel(), np.delete(pulls, cell, axis=2).sum(axis=2).ravel()
        common, factor = np.linalg.lstsq(np.column_stack([others, own]), balance.required.ravel(), rcond=None)[0]
        unit = _unit_of(common)
        if unit is None or common < 0.0 or CELL_RATIOS[0] < factor / common < CELL_RATIOS[1]:
            continue
        factors = np.full(len(balance.has_load_cell), FORCE_UNITS[unit])
        factors[cell] = sign = -FORCE_UNITS[unit] if _unit_of(-factor) == unit else factor
        yield CellReading(_misfit(balance, factors), _mistake_of_two(balance, int(cell), unit, float(sign)), freedom=1)


def _unit_of(factor: float) -> str | None:
    """The nearest unit, None where none is near."""
    unit = min(FORCE_UNITS, key=lambda symbol: abs(np.log(max(factor, 1e-300) / FORCE_UNITS[symbol])))
    return unit if 1.0 / MAX_UNIT_RATIO < factor / FORCE_UNITS[unit] < MAX_UNIT_RATIO else None


def _unit_text(unit: str) -> str:
    """The unit, with the other one that is as large but for what a small payload makes of it."""
    return {"kg": "kg or daN", "daN": "daN or kg"}.get(unit, unit)


def _mistake_of_two(balance: ForceBalance, cell: int, unit: str, factor: float) -> Mistake:
    """The mistake of a cell with a factor in N, beside others in a unit."""
    name, size = f"tension_{cell + 1}", FORCE_UNITS[unit]
    others = [f"tension_{index + 1}" for index, has in enumerate(balance.has_load_cell) if has and index != cell]
    corrections = [*scaled(others, size, unit)] if unit != "N" else []
    causes = [f"{', '.join(others)} are in {_unit_text(unit)}"] if unit != "N" else []
    if factor == -size:
        causes.append(f"{name} {'is too, and ' if causes else 'alone '}has the other sign")
        corrections.append(ColumnCorrection(name, unit=unit if unit != "N" else "", factor=size, sign=-1.0))
        return Mistake(" and ".join(causes), convert(name, factor), tuple(corrections))
    causes.append(f"1 of {name} alone is about {factor:.3g} N, as of another amplifier or converter than the others'")
    corrections.append(ColumnCorrection(name, factor=float(f"{abs(factor):.4g}"), sign=float(np.sign(factor))))
    remedy = f"{convert(name, factor)}, or better by the factor of its calibration"
    return Mistake(" and ".join(causes), remedy, tuple(corrections))


def _tared(robot: Robot, recording: Recording, balance: ForceBalance) -> Iterator[CellReading]:
    """Cells, one or all of them, that begin at zero under the static tension, in newtons or another unit."""
    try:
        static = np.array(static_tensions(robot))
    except InputError:
        return
    has_load_cell = np.array(balance.has_load_cell)
    start = recording.tension[recording.time <= recording.time[0] + TARED_DURATION]
    if not np.isfinite(start[:, has_load_cell]).any(axis=0).all():
        return
    begin = np.array(
        [np.nanmean(column) if has else np.inf for column, has in zip(start.T, has_load_cell, strict=True)]
    )
    moved = np.array(
        [np.std(each) if (each := column[np.isfinite(column)]).size else 0.0 for column in recording.tension.T]
    )
    for unit, size, sign in _units_of_tared(balance, static):
        is_small = np.abs(begin) <= np.minimum(MAX_TARED_SHARE * static / size, MAX_TARED_DEVIATIONS * moved)
        is_plain = unit == "N" and sign > 0.0
        if is_small[has_load_cell].all() or (is_plain and is_small.any()):
            factors, offsets = np.full(len(static), sign * size), np.where(is_small, static, 0.0)
            mistake = _mistake_of_taring(np.flatnonzero(is_small), offsets, unit, sign * size)
            yield CellReading(_misfit(balance, factors, offsets), mistake, freedom=int(not is_plain))


def _units_of_tared(balance: ForceBalance, static: Array) -> Iterator[tuple[str, float, float]]:
    """Units, with sizes and signs, in which the changes of cells that were all tared balance; else "" and what does.

    In newtons also where they do not, as one cell alone may have been tared. In any small unit the static tensions
    (n,) are left alone, and these balance the weight almost.
    """
    held = np.einsum("bci,i->bc", balance.directions, np.where(balance.has_load_cell, static, 0.0))
    factor = replace(balance, required=balance.required - held).best_factor(tuple(range(len(static))))
    sign = -1.0 if factor < 0.0 else 1.0
    near = [unit for unit, size in FORCE_UNITS.items() if 1.0 / MAX_TARED_RATIO < abs(factor) / size < MAX_TARED_RATIO]
    if ("N", 1.0) not in ((unit, sign) for unit in near):
        yield "N", 1.0, 1.0
    yield from ((unit, FORCE_UNITS[unit], sign) for unit in near)
    if factor and not near:
        yield "", float(f"{abs(factor):.2g}"), sign


def _mistake_of_taring(cells: NDArray[np.int64], static: Array, unit: str, factor: float) -> Mistake:
    """The mistake of cells that were tared under the static tensions (n,) in N; one of theirs is ``factor`` N.

    ``unit`` is blank where that is no unit's.
    """
    names = ", ".join(f"tension_{cell + 1}" for cell in cells)
    texts = [f"{value:.4g}" for value in static[cells]]
    own, sign = (unit if unit != "N" else ""), float(np.sign(factor))
    corrections = tuple(
        ColumnCorrection(f"tension_{cell + 1}", unit=own, factor=abs(factor), sign=sign, shift=float(static[cell]))
        for cell in cells
    )
    causes = [
        f"{names} {'were' if len(cells) > 1 else 'was'} tared at the start, where statics gives {', '.join(texts)} N"
    ]
    causes += [f"are in {_unit_text(unit)}"] if own else []
    causes += [] if unit else [f"1 of theirs is about {abs(factor):.2g} N, as of an amplifier or a converter"]
    causes += ["have the other sign"] if sign < 0.0 else []
    sign_text = f"{NEGATE}, and " if sign < 0.0 else ""
    return Mistake(", and ".join(causes), f"{sign_text}add that, or tare without load", corrections)
