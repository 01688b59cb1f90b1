"""Cable, scale and sign of winch columns in a proposal, by the coordinates of the recording or of a tracker's file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..number_format import format_percent
from ..robot.schema import AXES, QUATERNION_COLUMNS, Robot
from .column_proposal import ADD_FACTOR, NO_UNIT, NOTHING_SAID, SIGNS, ColumnProposal, ProposedColumn, sorted_columns
from .column_samples import ColumnSamples
from .encoder_counts import RopeScales, are_counts, rope_scales
from .geometry_reading import GeometryReading, RecordedPoses, unturned
from .quaternion_columns import are_valid, unit_quaternions, zero_quaternions
from .tracked_rows import scales_by_tracker
from .units import UNITS, find_unit, quantity_of
from .value_proposal import BY_VALUES, time_unit

Array = NDArray[np.float64]

# A scale is that of a unit within the first; scales of alike drums differ by less than the second.
UNIT_TOLERANCE, ALIKE_DRUMS = 0.05, 0.02
MAX_UNNAMED, MIN_FINITE = 32, 0.9
KINDS = ("rope_length", "winch_speed")
_PER_COUNT = f"{ADD_FACTOR}metres per count"
# In the remark on a factor that a proposal estimates.
ESTIMATED_FACTOR = "an estimate with the errors of drum and rope in it"


@dataclass(frozen=True)
class ProposedFile:
    """The proposal of a file's columns, and the samples of it."""

    proposal: ColumnProposal
    samples: ColumnSamples

    def si_values(self, column: str) -> Array | None:
        """Numbers (N,) of a standard column in SI units; None without it, or where its unit is not known."""
        proposed = next((each for each in self.proposal.columns if each.column == column), None)
        if proposed is None or proposed.name not in self.samples.values:
            return None
        if proposed.name in self.samples.clocks:
            return self.samples.values[proposed.name]
        text = proposed.unit or self.samples.units.get(proposed.name, "")
        unit = find_unit(text, column)
        if unit is None and (text or proposed.doubt):
            return None
        values = self.samples.values[proposed.name]
        return values if unit is None else unit.to_si(values)

    def rope_lengths(self, robot: Robot) -> Array | None:
        """Rope lengths (N, n) in m by the poses, NaN where these are lost.

        None where a coordinate in which the robot moves is not known, or a rigid platform's orientation.
        """
        position = self._columns([AXES[axis] for axis in robot.axes_in_plane])
        if position is None:
            return None
        poses = unturned(np.full((len(position), len(AXES)), np.nan))
        poses.position[:, robot.axes_in_plane] = position
        if robot.platform.is_rigid_body:
            quaternions = self._columns(QUATERNION_COLUMNS)
            if quaternions is None:
                return None
            quaternions[zero_quaternions(quaternions)] = np.nan
            if not are_valid(quaternions):
                return None
            poses = RecordedPoses(poses.position, unit_quaternions(quaternions))
        return GeometryReading().directions(robot, poses)[0]

    def _columns(self, names: Sequence[str]) -> Array | None:
        """Columns side by side in SI units; None where one is not known."""
        columns = [values for values in map(self.si_values, names) if values is not None]
        return np.column_stack(columns) if len(columns) == len(names) else None


def with_winch_scales(
    log: ProposedFile, cable_count: int, robot: Robot | None, tracker: ProposedFile | None = None
) -> ColumnProposal:
    """The proposal of a log, with what the coordinates tell of its winch columns by regression of rope lengths.

    A column whose name says nothing is proposed where it, or its integral, is the length of one rope; another has the
    factor, sign or unit that it lacks. Without coordinates only counts are proposed, in the file's order.
    """
    regression = None if robot is None else _Regression(robot, log, tracker)
    told = {each.column.rpartition("_")[0] for each in log.proposal.columns}
    if told.intersection(KINDS) or not cable_count:
        return log.proposal if regression is None else _with_named_scales(log, regression)
    values = log.samples.values
    unnamed = [name for name in values if log.proposal.unused.get(name) == NOTHING_SAID]
    counts = [name for name in unnamed if are_counts(values[name]) and time_unit(values[name]) is None]
    found: list[ProposedColumn] = []
    if regression is not None and cable_count <= len(unnamed) <= MAX_UNNAMED:
        found = _of_unnamed("rope_length", unnamed, regression) or _of_unnamed("winch_speed", unnamed, regression)
    if not found and len(counts) == cable_count:
        found = _in_order(counts, values)
    names = {each.name for each in found}
    unused = {name: reason for name, reason in log.proposal.unused.items() if name not in names}
    columns = sorted_columns([*log.proposal.columns, *found])
    return ColumnProposal(columns, log.proposal.standard_names, unused)


@dataclass(frozen=True)
class _Regression:
    """Regression of rope lengths on columns of a log by the positions in it, or else of a tracker."""

    robot: Robot
    log: ProposedFile
    tracker: ProposedFile | None

    @property
    def source(self) -> str:
        """Where the coordinates are from."""
        return "the coordinates" if self.tracker is None else "the tracker's coordinates"

    def of(self, kind: str, names: Sequence[str], cables: Sequence[int] | None = None) -> RopeScales | None:
        """Scales of columns of a kind; those of speeds are of what they have reeled in, whose length falls."""
        signals = [self._signal(kind, self.log.samples.values[name]) for name in names]
        if any(signal is None or len(signal) < 2 or np.ptp(signal) == 0.0 for signal in signals):
            return None
        known = [signal for signal in signals if signal is not None]
        if self.tracker is None:
            lengths = self.log.rope_lengths(self.robot)
            return None if lengths is None else rope_scales(lengths, known, cables)
        time, lengths = self.log.si_values("time"), self.tracker.rope_lengths(self.robot)
        tracker_time = self.tracker.si_values("time")
        if time is None or lengths is None or tracker_time is None:
            return None
        return scales_by_tracker(time, known, (tracker_time, lengths), cables)

    def _signal(self, kind: str, values: Array) -> Array | None:
        if kind == "rope_length":
            return values
        time, finite = self.log.si_values("time"), np.isfinite(values)
        if time is None or not np.isfinite(time).all() or np.count_nonzero(finite) < 2:
            return None
        speeds = np.interp(time, time[finite], values[finite])
        reeled_in = np.concatenate([[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(time))])
        return np.asarray(-reeled_in)


def _with_named_scales(log: ProposedFile, regression: _Regression) -> ColumnProposal:
    """The proposal with the scales of its winch columns, where all of a kind fit."""
    columns = {each.column: each for each in log.proposal.columns}
    for kind in KINDS:
        named = [each for each in log.proposal.columns if each.column.startswith(kind) and each.doubt]
        is_open = [each for each in named if each.name in log.samples.values]
        cables = [int(each.column.rpartition("_")[2]) - 1 for each in is_open]
        scales = regression.of(kind, [each.name for each in is_open], cables) if is_open else None
        if scales is not None:
            columns |= {each.column: each for each in _scaled(is_open, scales, regression.source, log.samples.units)}
    return ColumnProposal(sorted_columns(columns.values()), log.proposal.standard_names, log.proposal.unused)


def _of_unnamed(kind: str, names: Sequence[str], regression: _Regression) -> list[ProposedColumn]:
    """Columns of the kind that the coordinates tell among those whose names say nothing; none where they do not."""
    values, source = regression.log.samples.values, regression.source
    moving = [name for name in names if np.isfinite(values[name]).mean() > MIN_FINITE and np.nanstd(values[name]) > 0.0]
    scales = regression.of(kind, moving) if moving else None
    if scales is None:
        return []
    used = np.flatnonzero(scales.cables >= 0)
    columns = []
    for name, cable in zip([moving[index] for index in used], scales.cables[used], strict=True):
        told, scale = f"changes as the length of a rope{' if summed up' if kind == 'winch_speed' else ''}", NO_UNIT
        if kind == "rope_length" and _are_whole(values[name]):
            told, scale = _extent(values[name]), _PER_COUNT
        doubt = f"{BY_VALUES}: {told}; cable by {source}; {scale}; {SIGNS[kind]}"
        columns.append(ProposedColumn(f"{kind}_{cable + 1}", name, "", doubt))
    chosen = RopeScales(scales.cables[used], scales.scales[used], scales.misfits[used])
    return _scaled(columns, chosen, source, regression.log.samples.units)


def _in_order(names: Sequence[str], values: Mapping[str, Array]) -> list[ProposedColumn]:
    """Columns of counts as rope lengths of the cables in the file's order."""
    end = f"cables in the file's order; {_PER_COUNT}; {SIGNS['rope_length']}"
    return [
        ProposedColumn(f"rope_length_{cable}", name, "", f"{BY_VALUES}: {_extent(values[name])}; {end}")
        for cable, name in enumerate(names, 1)
    ]


def _are_whole(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return bool(np.all(finite == np.round(finite)))


def _extent(values: Array) -> str:
    return f"whole numbers over a range of {np.nanmax(values) - np.nanmin(values):.0f}, as counts of an encoder"


def _scaled(
    columns: Sequence[ProposedColumn], found: RopeScales, source: str, units: Mapping[str, str]
) -> list[ProposedColumn]:
    """Columns of one kind with the unit, or else the factor, and the sign of their scales."""
    sizes = np.abs(found.scales)
    median = float(np.median(sizes))
    spread = float(np.max(np.abs(sizes / median - 1.0)))
    factors = [median if spread <= ALIKE_DRUMS else float(size) for size in sizes]
    alike = f"; cables alike to {format_percent(spread)}" if spread <= ALIKE_DRUMS else ""
    scaled = []
    for column, scale, factor, misfit in zip(columns, found.scales, factors, found.misfits, strict=True):
        stated = find_unit(column.unit or units.get(column.name, ""), column.column)
        size = abs(float(scale)) / (1.0 if stated is None else stated.to_si(1.0))
        unit = "" if ADD_FACTOR in column.doubt else _unit_of_scale(column.column, size)
        rms = f"to {format_percent(float(np.sqrt(misfit)))} (rms"
        asked = SIGNS[column.column.rpartition("_")[0]]
        doubt = column.doubt.replace(asked, f"sign by {source}, {rms})")
        changed = replace(column, sign=-1 if scale < 0.0 else 1)
        if stated is not None:
            # A unit that the file states and the coordinates contradict is left for the reader, and so is the sign.
            scaled.append(replace(changed, doubt=doubt) if abs(size - 1.0) <= UNIT_TOLERANCE else column)
        elif unit:
            scaled.append(replace(changed, unit=unit, doubt=doubt.replace(NO_UNIT, f"{unit} by {source}")))
        else:
            formula = column.doubt.partition(ADD_FACTOR)[2].partition("; ")[0] or "the data sheet's"
            remedy = (
                "as above" if any(ESTIMATED_FACTOR in each.doubt for each in scaled) else f"replace it by {formula}"
            )
            told = f"factor and sign by {source}, {rms}{alike}): {ESTIMATED_FACTOR}, {remedy}"
            rest = column.doubt.replace(f"{ADD_FACTOR}{formula}", told).replace(NO_UNIT, told).replace(f"; {asked}", "")
            scaled.append(replace(changed, factor=float(f"{factor:.4g}"), doubt=rest))
    return scaled


def _unit_of_scale(column: str, size: float) -> str:
    """The unit whose size in SI units is that of a scale; blank where none is."""
    units = UNITS[quantity_of(column)]
    return next((unit.symbol for unit in units if abs(size / unit.to_si(1.0) - 1.0) <= UNIT_TOLERANCE), "")
