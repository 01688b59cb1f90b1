"""How time and winch columns may be read: units, signs, order and clock other than the format's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..robot.recorded_columns import LOG_TABLE, TRACKER_TABLE
from .column_corrections import (
    ColumnCorrection,
    corrected_lines,
    negated,
    recorded_corrections,
    reordered,
    scaled,
)
from .recording import Recording
from .units import UNITS

DRUM_RADII = (0.005, 0.5)  # m
MAX_DRUM_RATIO = 4.0  # of a drum and its gear to those that were taken for it
NEGATE = "multiply by -1"
REORDER = "rename the columns in this order"

# Those that recordings are written in by mistake, and what one of each is in SI units.
TIME_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["time"]}
SPEED_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["speed"]}
LENGTH_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["length"]}
ANCHOR_UNITS = ("m", "cm", "mm", "in", "ft")
ATTACHMENT_UNITS = ("m", "cm", "mm")


@dataclass(frozen=True)
class Mistake:
    """What was written otherwise than it is read: ``cause`` as a clause, ``remedy`` as an instruction.

    ``corrections`` are those of columns that do the same without another file; a tracker's are in a table of its own.
    """

    cause: str
    remedy: str
    corrections: tuple[ColumnCorrection, ...] = ()
    is_of_tracker: bool = False


def mistakes_text(
    alternatives: Sequence[Sequence[Mistake]], recording: Recording, tracker: Recording | None = None
) -> tuple[str, str]:
    """Causes and remedies of alternative sets of mistakes, each as one clause.

    A remedy begins with the lines of TOML that read the recording right, or the tracker's file, where lines can.
    """
    causes = ", or if ".join(" and ".join(mistake.cause for mistake in mistakes) for mistakes in alternatives)
    return causes, ", or ".join(_remedies(mistakes, recording, tracker) for mistakes in alternatives)


def _remedies(mistakes: Sequence[Mistake], recording: Recording, tracker: Recording | None) -> str:
    with_lines, parts = [], []
    for is_of_tracker, source, table in ((True, tracker, TRACKER_TABLE), (False, recording, LOG_TABLE)):
        own = [each for each in mistakes if each.is_of_tracker == is_of_tracker]
        group = [each for each in own if source is not None and recorded_corrections(source, each.corrections)]
        parts += [each.remedy for each in own if each not in group]
        if group and source is not None:
            tables = corrected_lines(source, [mistake.corrections for mistake in group], table)
            written = ", and into ".join(f"[{name}] {' and '.join(lines)}" for name, lines in tables.items())
            by_hand = ", and ".join(mistake.remedy for mistake in group)
            with_lines.append(f"write into {written}, which is to {by_hand}")
    return ", and ".join([*parts, *with_lines])


@dataclass(frozen=True)
class WindingReading:
    """How time and winch speeds are read: units (None: an angle), signs and order by cable, and a clock's lead."""

    time_unit: str = "s"
    speed_unit: str | None = "m/s"
    signs: tuple[int, ...] = ()
    order: tuple[int, ...] = ()
    radius: float = 0.0
    clock_offset: float = 0.0

    @property
    def factor(self) -> float:
        """Rope length in m by what is read as one."""
        speed = self.radius if self.speed_unit is None else SPEED_UNITS[self.speed_unit]
        return TIME_UNITS[self.time_unit] * speed

    def mistakes(self, recording: Recording) -> Iterator[Mistake]:
        """What this reading changes."""
        names = [
            f"rope_length_{cable}" if cable in recording.rope_lengths else f"winch_speed_{cable}"
            for cable in range(1, recording.cable_count + 1)
        ]
        if self.time_unit != "s":
            unit = self.time_unit
            factor = TIME_UNITS[unit]
            yield Mistake(f"time is in {unit}", convert("time", factor), scaled(("time",), factor, unit))
        if self.speed_unit is None:
            yield Mistake(
                factor_text(names, self.radius, bool(recording.rope_lengths)),
                f"multiply {_range_text(names)} by {self.radius:.4g}, or better by the factor that follows from the "
                "drum's radius and what is recorded in one turn of it",
                scaled(names, float(f"{self.radius:.6g}")),
            )
        elif self.speed_unit != "m/s":
            unit = self.speed_unit.removesuffix("/s") if recording.rope_lengths else self.speed_unit
            factor = SPEED_UNITS[self.speed_unit]
            remedy = convert(_range_text(names), factor)
            units = {name: self.speed_unit.removesuffix("/s" if name.startswith("rope_") else "") for name in names}
            corrections = tuple(ColumnCorrection(name, unit=own, factor=factor) for name, own in units.items())
            yield Mistake(f"{_range_text(names)} are in {unit}", remedy, corrections)
        if any(sign < 0 for sign in self.signs):
            wrong = [names[column] for column, sign in sorted(zip(self.order, self.signs, strict=True)) if sign < 0]
            verb = "has" if len(wrong) == 1 else "have"
            subject = _range_text(wrong) if len(wrong) == len(names) else ", ".join(wrong)
            yield Mistake(
                f"{subject} {verb} the other sign",
                f"{NEGATE}: a winch that reels in has a positive speed",
                negated(wrong),
            )
        if self.order != tuple(range(len(self.order))):
            written = [names[column] for column in self.order]
            is_one_kind = len(recording.rope_lengths) in (0, len(names))
            corrections = reordered(names, written) if is_one_kind else ()
            yield Mistake(f"the winches of cables 1 to {len(names)} are {', '.join(written)}", REORDER, corrections)
        if self.clock_offset:
            side, remedy = (
                ("ahead of", "subtract that from the winches' times")
                if self.clock_offset > 0.0
                else ("behind", "add that to the winches' times")
            )
            offset = f"{abs(self.clock_offset):.2g} s"
            yield Mistake(f"the winches' clock is {offset} {side} the tracker's", remedy)


def winding_as_declared(cable_count: int) -> WindingReading:
    """Winches as the format has them."""
    return WindingReading(signs=(1,) * cable_count, order=tuple(range(cable_count)))


def convert(what: str, factor: float) -> str:
    """The remedy for columns in a unit of so many SI units."""
    return f"multiply {what} by {factor:.4g}"


def _range_text(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"


def likely_drum_radii(ratio: float) -> dict[str, float]:
    """Radii (m) of drums, by the unit of the angles that were recorded as rope speeds, ``ratio`` m of rope each."""
    turn = ratio / (2.0 * np.pi)
    by_unit = {"rad/s": ratio, "deg/s": 360.0 * turn, "rpm": 60.0 * turn, "turns/s": turn}
    return {unit: radius for unit, radius in by_unit.items() if DRUM_RADII[0] <= radius <= DRUM_RADII[1]}


def factor_text(names: list[str], ratio: float, are_lengths: bool) -> str:
    """What columns are one of whose units is ``ratio`` m of rope, or m/s: angles, or counts."""
    radii = likely_drum_radii(ratio)
    if are_lengths:
        radii = {unit.removesuffix("/s"): radius for unit, radius in radii.items() if unit.endswith("/s")}
    likely = " or ".join(f"{radius:.4g} m if in {unit}" for unit, radius in radii.items())
    unit, kind = ("m", "lengths") if are_lengths else ("m/s", "speeds")
    near = min(SPEED_UNITS, key=lambda symbol: abs(ratio / SPEED_UNITS[symbol] - 1.0))
    error = ratio / SPEED_UNITS[near] - 1.0
    near = near.removesuffix("/s") if are_lengths else near
    parts = [f"1 of {'theirs' if len(names) > 1 else 'it'} is {ratio:.4g} {unit}"]
    parts += (
        [f"{100.0 * abs(error):.2g} % {'more' if error > 0.0 else 'less'} than one {near}"] if abs(error) < 0.1 else []
    )
    is_gear = 1.0 / MAX_DRUM_RATIO < ratio < MAX_DRUM_RATIO
    causes = [f"as of angles of drums with a radius of {likely}"] if likely else []
    causes += [f"as of gears, drums or intervals of time {ratio:.3g} times those that were taken"] if is_gear else []
    causes = causes or ["as of an encoder's counts" if ratio < 1.0 else "as of a gear or another unit"]
    parts += [" or ".join(causes)]
    is_no = f"is no {kind.removesuffix('s')} of a rope" if len(names) == 1 else f"are not {kind} of ropes"
    return f"{_range_text(names)} {is_no} in {unit}: {', '.join(parts)}"
