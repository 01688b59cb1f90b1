"""Mistakes in units, signs or order of load cells, told by the balance of forces and moments on the platform."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .alternative_readings import NEGATE, REORDER, Mistake, WindingReading, convert
from .column_corrections import negated, reordered, scaled
from .geometry_reading import GeometryReading
from .mistaken_motion import MIN_IMPROVEMENT
from .odd_load_cells import likely_cell_readings
from .recording import Recording
from .weight_balance import FORCE_UNITS, ForceBalance, force_balance

Array = NDArray[np.float64]

# What swapped load cells leave at least, of the weight, whatever the unit; and right ones in another unit at most.
MIN_SWAPPED_MISFIT, MAX_SCALED_MISFIT = 0.03, 0.3
# What right ones leave at most, of the weight or of larger tensions: lifelike platforms on four cables leave 0.038.
MAX_ORDER_MISFIT = 0.04
# Standard deviation of the ropes' directions from which on the motion tells one load cell from another.
MIN_DIRECTION_DEVIATION = 0.01
EQUAL_RATIO = 1.5
# Gains that are off by less, of single cells, go before another order where they balance as well, or to this misfit.
MAX_CELL_GAIN_ERROR, MAX_MISFIT_BY_GAINS = 0.1, 0.015
# How far payloads and gains may be off, and by how much where the unit is of the size of a wrong mass.
MAX_UNIT_RATIO, MAX_NEAR_UNIT_RATIO, NEAR_UNITS = 1.3, 1.1, ("daN", "kg", "lbf")
MAX_PERMUTED_CABLES = 5
# Of the weight, whatever payloads and gains do; of tensions that are larger, by which gains and zeros may be off; and
# the misfit below which zeros of single cells, an effect, explain all.
CARRIED, MAX_GAIN_ERROR, MAX_MISFIT_BESIDE_ZEROS = (0.1, 10.0), 0.5, 0.1


@dataclass(frozen=True)
class TensionReading:
    """How the load cells are read: ``unit``, a common ``sign``, and the cell of each cable, counted from 0."""

    unit: str
    sign: int
    order: tuple[int, ...]

    @property
    def factor(self) -> float:
        """Tension in N by what is read as one."""
        return self.sign * FORCE_UNITS[self.unit]

    def mistakes(self) -> Iterator[Mistake]:
        """What this reading changes."""
        declared = [f"tension_{cable + 1}" for cable in range(len(self.order))]
        columns = [declared[cable] for cable in self.order]
        names = f"tension_1 to tension_{len(columns)}"
        if self.unit != "N":
            factor = FORCE_UNITS[self.unit]
            other = f", or the robot file's platform.mass is {factor:.4g} times the true one"
            corrections = scaled(columns, factor, self.unit)
            yield Mistake(f"{names} are in {self.unit}{other}", convert(names, factor), corrections)
        if self.sign < 0:
            remedy = f"{NEGATE}: a rope that pulls has a positive tension"
            yield Mistake(f"{names} have the other sign", remedy, negated(columns))
        if list(self.order) != sorted(self.order):
            cause = f"the load cells of cables 1 to {len(columns)} are {', '.join(columns)}"
            yield Mistake(cause, REORDER, reordered(declared, columns))


@dataclass(frozen=True)
class TensionCheck:
    """Tensions against weight and inertia: the part ``carried``, the misfit as read, and readings that mend it.

    ``order`` is the order of cells of the first of these. ``is_hopeless`` where neither a mistake nor an effect
    explains them.
    """

    carried: float
    misfit: float
    corrected_misfit: float
    mistakes: tuple[tuple[Mistake, ...], ...]
    order: tuple[int, ...] = ()
    is_hopeless: bool = False


def check_tensions(
    robot: Robot, recording: Recording, geometry: GeometryReading, winding: WindingReading
) -> TensionCheck | None:
    """Test the load cells by the balance of forces on the platform, ``sum_i T_i u_i = m (a + g)``.

    Of a rigid platform whose orientation was recorded the moments about its centre of mass have to balance too. Forces
    are averaged over a quarter second; a cable without load cell may pull as it likes. The misfit is the rms of what is
    not balanced, over that of weight and inertia. Another order of load cells is told by the misfit that is left
    whatever the unit, another unit or sign by the factor that balances best. None where too little was measured.
    """
    balance = force_balance(robot, recording, geometry, winding)
    if balance is None:
        return None
    declared = tuple(range(robot.cable_count))
    is_as_read = geometry == GeometryReading() and winding == WindingReading()
    readings = [reading for order in _likely_orders(balance) for reading in _unit_readings(balance, order)]
    fewest = min((len(tuple(reading.mistakes())) for reading in readings), default=0)
    readings = [reading for reading in readings if len(tuple(reading.mistakes())) == fewest]
    mistakes = tuple(tuple(reading.mistakes()) for reading in readings) if fewest else ()
    corrected_misfit = min((balance.misfit(reading.order, reading.factor) for reading in readings), default=np.inf)
    if is_as_read:
        cells = likely_cell_readings(robot, recording, balance)
        # A unit may be near by chance, one factor is no more than that and a payload.
        is_chance = bool(cells and cells[0].freedom) and MIN_IMPROVEMENT * cells[0].misfit < corrected_misfit
        if cells and (is_chance or not mistakes):
            mistakes, corrected_misfit = tuple((cell.mistake,) for cell in cells), cells[0].misfit
    carried, misfit = balance.carried(declared), balance.misfit(declared)
    is_carried = CARRIED[0] < carried < CARRIED[1] or misfit < MAX_GAIN_ERROR * balance.tension_to_weight()
    is_explained = is_carried or mistakes or balance.explains_beside_zeros(MAX_MISFIT_BESIDE_ZEROS)
    is_hopeless = is_as_read and not is_explained
    order = readings[0].order if readings else ()
    return TensionCheck(carried, misfit, corrected_misfit, mistakes, order, is_hopeless)


def _likely_orders(balance: ForceBalance) -> list[tuple[int, ...]]:
    """The declared order of load cells, or those that divide the misfit, whatever the unit, by the factor."""
    orders = list(_orders(balance))
    misfits = [balance.misfit(order, balance.best_factor(order)) for order in orders]
    best = min(misfits)
    tells_cells_apart = float(np.std(balance.directions, axis=0).max()) > MIN_DIRECTION_DEVIATION
    factor = balance.best_factor(orders[misfits.index(best)])
    is_right = best <= MAX_ORDER_MISFIT * max(1.0, balance.tension_to_weight(factor))
    is_better = misfits[0] > max(MIN_SWAPPED_MISFIT, MIN_IMPROVEMENT * best)
    if not (tells_cells_apart and is_right and is_better):
        return orders[:1]
    max_misfit = max(EQUAL_RATIO * best, MAX_MISFIT_BY_GAINS)
    if balance.explains_by_gains(balance.best_factor(orders[0]), MAX_CELL_GAIN_ERROR, max_misfit):
        return orders[:1]
    return [order for order, misfit in zip(orders, misfits, strict=True) if misfit <= EQUAL_RATIO * best]


def _unit_readings(balance: ForceBalance, order: tuple[int, ...]) -> Iterator[TensionReading]:
    """The unit and sign that the best factor on tensions in this order suggests; none where it is no unit's."""
    factor = balance.best_factor(order)
    if balance.misfit(order, factor) > MAX_SCALED_MISFIT or not balance.pulls(factor):
        return
    for unit, size in FORCE_UNITS.items():
        limit = MAX_NEAR_UNIT_RATIO if unit in NEAR_UNITS else MAX_UNIT_RATIO
        if 1.0 / limit < abs(factor) / size < limit:
            yield TensionReading(unit, -1 if factor < 0.0 else 1, order)


def _orders(balance: ForceBalance) -> Iterator[tuple[int, ...]]:
    """Orders of the load cells, the declared one first: all of a few, else what swapping two at a time leads to."""
    cells = [index for index, has in enumerate(balance.has_load_cell) if has]
    declared = tuple(range(len(balance.has_load_cell)))
    if len(cells) <= MAX_PERMUTED_CABLES:
        yield from (_with_cells(declared, cells, permuted) for permuted in permutations(cells))
        return
    yield declared
    shifted = (cells[shift:] + cells[:shift] for shift in range(len(cells)))
    starts = [_with_cells(declared, cells, permuted) for permuted in (*shifted, cells[::-1])]
    reached = dict.fromkeys(_best_by_swaps(balance, start, cells) for start in starts)
    yield from (order for order in reached if order != declared)


def _with_cells(order: tuple[int, ...], cells: Sequence[int], sources: Sequence[int]) -> tuple[int, ...]:
    """The order with the load cells of some cables read from others."""
    changed = list(order)
    for cell, source in zip(cells, sources, strict=True):
        changed[cell] = source
    return tuple(changed)


def _best_by_swaps(balance: ForceBalance, order: tuple[int, ...], cells: Sequence[int]) -> tuple[int, ...]:
    """The order that steepest descent by swaps of two load cells reaches, with the least misfit whatever the unit."""

    def misfit(order: tuple[int, ...]) -> float:
        return balance.misfit(order, balance.best_factor(order))

    least = misfit(order)
    while True:
        swapped = [_with_cells(order, pair, (order[pair[1]], order[pair[0]])) for pair in combinations(cells, 2)]
        misfits = [misfit(each) for each in swapped]
        if not min(misfits) < least:
            return order
        least = min(misfits)
        order = swapped[misfits.index(least)]
