"""What recorded numbers add to a proposal of columns where names say nothing, or no unit, and the numbers decide."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import UnreachableError
from ..number_format import format_significant
from ..robot.schema import AXES, Robot
from ..robot.static_equilibrium import static_tensions
from .column_proposal import NO_UNIT, NOTHING_SAID, ColumnProposal, ProposedColumn, sorted_columns
from .column_samples import ColumnSamples
from .geometry_reading import GeometryReading, unturned
from .units import UNITS, Unit, quantity_of

Array = NDArray[np.float64]

PLAUSIBLE_RATES = (10.0, 10_000.0)  # samples per second
MIN_ROWS = 20
# Steps that are even: this share of them within so much of their median.
EVEN_SHARE, EVEN_SPREAD = 0.99, 0.1
# How far first values may be from the robot's start: of the shortest rope's length, and of each tension or length.
POSITION_TOLERANCE, TENSION_TOLERANCE, LENGTH_TOLERANCE = 0.02, 0.15, 0.02
# Over what range a platform moves, in m, or at least by its share of the anchors' where these are known.
RANGES_IN_M, SMALLEST_SHARE = (0.1, 20.0), 0.005

_TIME_UNITS = ("s", "ms", "us", "ns")
BY_VALUES = "by its values"


def with_values(
    proposal: ColumnProposal, samples: ColumnSamples, cable_count: int, robot: Robot | None = None
) -> ColumnProposal:
    """The proposal of a recording of n = ``cable_count`` cables, with what its samples decide.

    A column whose name says nothing is proposed where its numbers fit one quantity, and a unit where they fit one; the
    doubt of each tells by what figure. Positions, tensions and rope lengths are compared with those of the ``robot`` at
    its start.
    """
    values = samples.values
    unnamed = [name for name in values if proposal.unused.get(name) == NOTHING_SAID]
    told = {each.column.rpartition("_")[0] or each.column for each in proposal.columns}
    known = proposal.columns if samples.units else _with_units(proposal.columns, values, robot)
    known = [_of_clock(each) if each.name in samples.clocks else each for each in known]
    found = list(_found_columns(unnamed, values, told, cable_count, robot))
    names, columns = ([getattr(each, key) for each in found] for key in ("name", "column"))
    found = [each for each in found if names.count(each.name) == columns.count(each.column) == 1]
    found = [replace(each, unit="") for each in found] if samples.units else found
    found = [replace(each, unit="") if each.name in samples.clocks else each for each in found]
    rescaled = {each.column for each in known if each.unit} & proposal.standard_names
    unused = {name: reason for name, reason in proposal.unused.items() if name not in {each.name for each in found}}
    return ColumnProposal(sorted_columns([*known, *found]), proposal.standard_names - rescaled, unused)


def _of_clock(column: ProposedColumn) -> ProposedColumn:
    """A column of clock times, which have no unit."""
    return replace(column, unit="", doubt="" if column.column == "time" else column.doubt)


def _found_columns(
    unnamed: Sequence[str], values: Mapping[str, Array], told: set[str], cable_count: int, robot: Robot | None
) -> Iterator[ProposedColumn]:
    """Columns of kinds that no name tells, by their values."""
    rising = {name: time_unit(values[name]) for name in unnamed if not _counts_rows(values[name])}
    times = {name: unit_and_figure for name, unit_and_figure in rising.items() if unit_and_figure is not None}
    if "time" not in told and len(times) == 1:
        ((name, (symbol, figure)),) = times.items()
        yield ProposedColumn("time", name, symbol, f"{BY_VALUES}: {figure}")
    others = [name for name in unnamed if name not in times and np.isfinite(values[name]).any()]
    runs = _Runs(others, values)
    for kind, columns, expected, tolerance, unit_names in _expected_starts(robot, cable_count):
        if kind in told or told.intersection(columns):
            continue
        matches = list(runs.beginning_at(expected, tolerance, _units(columns[0], unit_names)))
        if len(matches) == 1:
            names, unit, begins = matches[0]
            for column, name, begin, value in zip(columns, names, begins, expected, strict=True):
                figure = f"{BY_VALUES}: {_comparison(begin, value, unit)}, in the file's order"
                yield ProposedColumn(column, name, unit.symbol, figure)


def _expected_starts(
    robot: Robot | None, cable_count: int
) -> Iterator[tuple[str, list[str], Array, Array, tuple[str, ...]]]:
    """What a recording of the robot begins with: the kind, its columns, their values, tolerances, and likely units."""
    if robot is None:
        return
    start, axes = np.array(robot.platform.start, dtype=float), list(robot.axes_in_plane)
    lengths = GeometryReading().directions(robot, unturned(start[None]))[0][0]
    tolerance = np.full(len(axes), POSITION_TOLERANCE * lengths.min())
    yield "position", [AXES[axis] for axis in axes], start[axes], tolerance, ("m", "cm", "mm")
    if cable_count:
        cables = range(1, cable_count + 1)
        names = [f"rope_length_{cable}" for cable in cables]
        yield "rope_length", names, lengths, LENGTH_TOLERANCE * lengths, ("m", "cm", "mm")
        tensions = _start_tensions(robot)
        names = [f"tension_{cable}" for cable in cables]
        if tensions is not None:
            yield "tension", names, tensions, TENSION_TOLERANCE * tensions, ("N", "kN")


class _Runs:
    """Adjacent columns without a name, in the file's order."""

    def __init__(self, names: Sequence[str], values: Mapping[str, Array]) -> None:
        self._values, places = values, list(values)
        self._names, self._places = names, [places.index(name) for name in names]

    def beginning_at(
        self, expected: Array, tolerance: Array, units: Sequence[Unit]
    ) -> Iterator[tuple[list[str], Unit, Array]]:
        """Runs that move and begin within a tolerance (k,) of expected values (k,) in SI units, and their first values.

        In each of the units where they do.
        """
        count = len(expected)
        for first in range(len(self._names) - count + 1):
            names = list(self._names[first : first + count])
            columns = [_finite(self._values[name]) for name in names]
            is_adjacent = self._places[first + count - 1] - self._places[first] == count - 1
            if not is_adjacent or all(np.ptp(column) == 0.0 for column in columns):
                continue
            begins = np.array([_beginning(column) for column in columns])
            for unit in units:
                if np.all(np.abs(unit.to_si(begins) - expected) <= tolerance):
                    yield names, unit, begins


def _comparison(begin: float, expected: float, unit: Unit) -> str:
    declared = format_significant(expected / unit.to_si(1.0), 4)
    return f"begins at {format_significant(begin, 4)}, the robot at {declared} {unit.symbol}"


def _with_units(
    columns: Sequence[ProposedColumn], values: Mapping[str, Array], robot: Robot | None
) -> list[ProposedColumn]:
    """The columns, with a unit where none is known of them and their values decide it."""
    open_columns = {
        each.column: values[each.name]
        for each in columns
        if each.name in values and not each.unit and (NO_UNIT in each.doubt or not each.doubt)
    }
    units: dict[str, tuple[str, str]] = {}
    unit_of_time = time_unit(open_columns["time"]) if "time" in open_columns else None
    units |= {"time": unit_of_time} if unit_of_time else {}
    axes = [axis for axis in AXES if axis in open_columns]
    position_unit = _position_unit([_finite(open_columns[axis]) for axis in axes], axes, robot) if axes else None
    units |= dict.fromkeys(axes, position_unit) if position_unit else {}
    tensions = {column: _finite(numbers) for column, numbers in open_columns.items() if column.startswith("tension_")}
    units |= _tension_units(tensions, robot)
    return [_with_unit(each, *units[each.column]) if each.column in units else each for each in columns]


def _with_unit(column: ProposedColumn, unit: str, figure: str) -> ProposedColumn:
    # What is read by its standard name is in SI units unless a line says otherwise.
    is_standard, is_si = not column.doubt, unit in ("s", "m", "N")
    if is_standard and is_si:
        return column
    told = f"{unit} by its values: {figure}"
    return replace(column, unit=unit, doubt=told if is_standard else column.doubt.replace(NO_UNIT, told))


def _position_unit(columns: Sequence[Array], axes: Sequence[str], robot: Robot | None) -> tuple[str, str] | None:
    """The unit of coordinates: by the robot's start, or else by the longest range."""
    if not all(column.size for column in columns):
        return None
    if robot is not None:
        starts = np.array(robot.platform.start, dtype=float)
        tolerance = POSITION_TOLERANCE * np.linalg.norm(np.array(robot.anchors) - starts, axis=1).min()
        expected, begins = starts[[AXES.index(axis) for axis in axes]], np.array([_beginning(each) for each in columns])
        fitting = [
            unit for unit in _units("x", ("m", "cm", "mm")) if np.abs(unit.to_si(begins) - expected).max() <= tolerance
        ]
        if len(fitting) == 1:
            farthest = int(np.argmax(np.abs(expected)))
            figure = _comparison(float(begins[farthest]), float(expected[farthest]), fitting[0])
            return fitting[0].symbol, f"{axes[farthest]} {figure}"
    longest = max(float(np.ptp(column)) for column in columns)
    smallest, largest = RANGES_IN_M
    if robot is not None:
        largest = float(np.linalg.norm(np.ptp(robot.anchors, axis=0)))
        smallest = SMALLEST_SHARE * largest
    fitting = [unit for unit in _units("x", ("m", "mm")) if smallest <= unit.to_si(longest) <= largest]
    figure = f"the longest range is {format_significant(longest)} {fitting[0].symbol}" if fitting else ""
    return (fitting[0].symbol, figure) if len(fitting) == 1 else None


def _tension_units(tensions: Mapping[str, Array], robot: Robot | None) -> dict[str, tuple[str, str]]:
    """The unit of tensions by the robot's static ones at its start, within a factor of two."""
    expected = None if robot is None else _start_tensions(robot)
    if expected is None or not tensions or not all(column.size for column in tensions.values()):
        return {}
    statics = [expected[int(column.rpartition("_")[2]) - 1] for column in tensions]
    ratio = float(
        np.median([_beginning(tensions[column]) / static for column, static in zip(tensions, statics, strict=True)])
    )
    fitting = [unit for unit in _units("tension_1", ("N", "kN")) if 0.5 <= unit.to_si(ratio) <= 2.0]
    if len(fitting) != 1:
        return {}
    share = format_significant(fitting[0].to_si(ratio))
    return dict.fromkeys(tensions, (fitting[0].symbol, f"they begin at {share} of the robot's static tensions"))


def _start_tensions(robot: Robot) -> Array | None:
    with suppress(UnreachableError):
        tensions = static_tensions(robot)
        return tensions if (tensions > 0.0).all() else None
    return None


def time_unit(values: Array) -> tuple[str, str] | None:
    """The unit of a time, and the figure; None where the numbers are none, or their unit is not clear."""
    if len(values) < MIN_ROWS or not np.isfinite(values).all():
        return None
    steps = np.diff(values)
    step = float(np.median(steps))
    if steps.min() <= 0.0 or np.mean(np.abs(steps - step) <= EVEN_SPREAD * step) < EVEN_SHARE:
        return None
    rates = {unit.symbol: float(1.0 / unit.to_si(step)) for unit in _units("time", _TIME_UNITS)}
    # At a bound the last digits must not decide.
    slowest, fastest = PLAUSIBLE_RATES[0] / 1.001, PLAUSIBLE_RATES[1] * 1.001
    plausible = [symbol for symbol, rate in rates.items() if slowest <= rate <= fastest]
    if len(plausible) != 1:
        return None
    rate = format_significant(rates[plausible[0]])
    return plausible[0], f"rises evenly by {format_significant(step)} a row, {rate} Hz"


def _counts_rows(values: Array) -> bool:
    """Whether a column may be the number of the row, or of a frame."""
    return bool(np.all(np.diff(values) == 1.0))


def _units(column: str, symbols: Sequence[str]) -> list[Unit]:
    return [unit for unit in UNITS[quantity_of(column)] if unit.symbol in symbols]


def _finite(values: Array) -> Array:
    return values[np.isfinite(values)]


def _beginning(values: Array) -> float:
    return float(np.median(values[:5]))
