"""Load cells that are read otherwise than in newtons from zero: one cell alone, all by one factor, or tared at rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..robot.schema import Robot
from ..robot.static_equilibrium import static_tensions
from .alternative_readings import Mistake, convert
from .column_corrections import ColumnCorrection
from .mistaken_motion import MIN_IMPROVEMENT
from .recording import Recording
from .weight_balance import FORCE_UNITS, ForceBalance

Array = NDArray[np.float64]

# A smaller misfit is for effects to explain, and a reading has to leave less than the second, whatever payloads do.
MIN_MISFIT, MAX_CORRECTED_MISFIT = 0.05, 0.3
# By what a payload may multiply all tensions.
MASS_RATIOS = (0.25, 10.0)
POUND, MAX_POUND_ERROR = 0.45359237, 0.03  # kg
# Share of the static tension below which a tared cell begins, and the time over which that is averaged.
MAX_TARED_SHARE, TARED_DURATION = 0.03, 0.1


@dataclass(frozen=True)
class CellReading:
    """A reading of the load cells: the misfit of forces that it leaves, and what was written otherwise."""

    misfit: float
    mistake: Mistake


def likely_cell_readings(robot: Robot, recording: Recording, balance: ForceBalance) -> tuple[CellReading, ...]:
    """The reading of load cells that mends the balance of forces best; empty where none mends it well."""
    misfit = balance.misfit(tuple(range(robot.cable_count)))
    if misfit <= MIN_MISFIT:
        return ()
    limit = min(MAX_CORRECTED_MISFIT, misfit / MIN_IMPROVEMENT)
    readings = [*_tared(robot, recording, balance), *_of_one_cell(balance), *_of_one_factor(balance)]
    return tuple(sorted((each for each in readings if each.misfit <= limit), key=lambda each: each.misfit)[:1])


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
    if factor and not MASS_RATIOS[0] < factor < MASS_RATIOS[1]:
        mistake = Mistake(
            f"1 of tension_1 to tension_{count} is about {factor:.3g} N, as of an amplifier's volts or a converter's "
            f"counts, or the robot file's platform.mass is {factor:.3g} times the true one",
            "declare factor, and offset as the number without load, of each in [recording.columns], by its calibration",
        )
        yield CellReading(_misfit(balance, np.full(count, factor)), mistake)
    elif abs(factor * POUND - 1.0) <= MAX_POUND_ERROR:
        mistake = Mistake("the robot file's platform.mass is in lb", convert("it", POUND))
        yield CellReading(_misfit(balance, np.full(count, factor)), mistake)


def _tared(robot: Robot, recording: Recording, balance: ForceBalance) -> Iterator[CellReading]:
    """Cells, one or all of them, that begin at zero under the static tension."""
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
    is_tared = np.abs(begin) <= MAX_TARED_SHARE * static
    if not is_tared.any():
        return
    cells = np.flatnonzero(is_tared)
    names = ", ".join(f"tension_{cell + 1}" for cell in cells)
    texts = [f"{value:.4g}" for value in static[cells]]
    corrections = tuple(ColumnCorrection(f"tension_{cell + 1}", shift=float(static[cell])) for cell in cells)
    mistake = Mistake(
        f"{names} {'were' if len(cells) > 1 else 'was'} tared at the start, where statics gives {', '.join(texts)} N",
        "add that, or tare without load",
        corrections,
    )
    yield CellReading(_misfit(balance, np.ones(len(static)), np.where(is_tared, static, 0.0)), mistake)
