"""How a recording may be read: units, signs, order, axes and origin other than the format's, and what each changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import AXES, Robot
from .recording import Recording
from .units import UNITS

Array = NDArray[np.float64]

DRUM_RADII = (0.005, 0.5)  # m
NEGATE = "multiply by -1, or declare sign = -1 in [recording.columns]"
REORDER = "rename the columns in this order, or declare their names so in [recording.columns]"

# Those that recordings are written in by mistake, and what one of each is in SI units.
TIME_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["time"]}
SPEED_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["speed"]}
LENGTH_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["length"]}
ANCHOR_UNITS = ("m", "cm", "mm")
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Mistake:
    """What was written otherwise than it is read: ``cause`` as a clause, ``remedy`` as an instruction."""

    cause: str
    remedy: str


@dataclass(frozen=True)
class GeometryReading:
    """How positions and anchors are read: units, axes with their signs, and the frame of the positions.

    ``p = rotation @ (signs * shown[axes] * unit) + origin``, in the robot file's frame. The recorded ``odd_axis`` is in
    a unit of its own.
    """

    position_unit: str = "m"
    anchor_unit: str = "m"
    axes: tuple[int, ...] = (0, 1, 2)
    signs: tuple[int, ...] = (1, 1, 1)
    origin: tuple[float, ...] = (0.0, 0.0, 0.0)
    rotation: tuple[tuple[float, ...], ...] = IDENTITY
    odd_axis: int | None = None
    odd_unit: str = "m"

    def positions(self, robot: Robot, shown: Array) -> Array:
        """Positions (N, 3) in m in the robot file's frame; a coordinate that was not measured is the start's."""
        start = np.array(robot.platform.start) * LENGTH_UNITS[self.anchor_unit]
        sizes = np.full(len(AXES), LENGTH_UNITS[self.position_unit])
        if self.odd_axis is not None:
            sizes[self.odd_axis] = LENGTH_UNITS[self.odd_unit]
        read = (shown * sizes)[:, self.axes] * self.signs
        for axis in range(len(AXES)):
            if axis not in robot.axes_in_plane or not np.isfinite(read[:, axis]).any():
                read[:, axis] = start[axis]
        return read @ np.transpose(self.rotation) + self.origin

    def directions(self, robot: Robot, shown: Array) -> tuple[Array, Array]:
        """Rope lengths (N, n) in m, and unit vectors (N, n, 3) from the platform to the anchors."""
        anchors = np.array(robot.anchors) * LENGTH_UNITS[self.anchor_unit]
        vectors = anchors - self.positions(robot, shown)[:, None]
        lengths = np.linalg.norm(vectors, axis=2)
        return lengths, vectors / np.maximum(lengths, 1e-12)[..., None]

    def mistakes(self) -> Iterator[Mistake]:
        """What this reading changes."""
        others = [axis for index, axis in enumerate(AXES) if index != self.odd_axis]
        if self.position_unit != "m":
            unit, names = self.position_unit, ", ".join(others)
            yield Mistake(f"{names} are in {unit}", convert(names, unit, LENGTH_UNITS[unit], others[0]))
        if self.odd_axis is not None and self.odd_unit != "m":
            unit, name = self.odd_unit, AXES[self.odd_axis]
            yield Mistake(f"{name} is in {unit}", convert(name, unit, LENGTH_UNITS[unit], name))
        if self.anchor_unit != "m":
            unit = self.anchor_unit
            yield Mistake(
                f"anchors in the robot file are in {unit}", f"multiply its coordinates by {LENGTH_UNITS[unit]:g}"
            )
        shown = [("-" if sign < 0 else "") + AXES[axis] for axis, sign in zip(self.axes, self.signs, strict=True)]
        if shown != list(AXES):
            yield Mistake(
                f"the robot file's x, y, z are the recording's {', '.join(shown)}",
                f"write the columns {', '.join(shown)} as x, y, z",
            )
        offset = ", ".join(f"{coordinate:.3g}" for coordinate in self.origin)
        if self.rotation != IDENTITY:
            yield self._turned_frame(offset)
        elif any(self.origin):
            yield Mistake(
                f"x, y, z have another origin, about [{offset}] m in the robot file's frame", "add that vector"
            )

    def _turned_frame(self, offset: str) -> Mistake:
        angle = np.degrees(np.arccos(np.clip((np.trace(self.rotation) - 1.0) / 2.0, -1.0, 1.0)))
        rows = ", ".join("[" + ", ".join(f"{entry:.4g}" for entry in row) + "]" for row in self.rotation)
        return Mistake(
            f"x, y, z are in a frame that is turned by about {angle:.3g} degrees, with its origin at [{offset}] m",
            f"write R (x, y, z) + [{offset}] as x, y, z, in m, with R = [{rows}] or what a survey of the tracker says",
        )


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
            yield Mistake(f"time is in {unit}", convert("time", unit, TIME_UNITS[unit], "time"))
        if self.speed_unit is None:
            yield Mistake(
                _factor_text(names, self.radius, bool(recording.rope_lengths)),
                f"multiply them by {self.radius:.4g}, or declare that as factor in [recording.columns], better the one "
                "that follows from the drum's radius and what is recorded in one turn of it",
            )
        elif self.speed_unit != "m/s":
            unit = self.speed_unit.removesuffix("/s") if recording.rope_lengths else self.speed_unit
            remedy = convert("them", unit, SPEED_UNITS[self.speed_unit], names[0])
            yield Mistake(f"{_range_text(names)} are in {unit}", remedy)
        if any(sign < 0 for sign in self.signs):
            wrong = [names[column] for column, sign in sorted(zip(self.order, self.signs, strict=True)) if sign < 0]
            verb = "has" if len(wrong) == 1 else "have"
            subject = _range_text(wrong) if len(wrong) == len(names) else ", ".join(wrong)
            yield Mistake(
                f"{subject} {verb} the other sign",
                f"{NEGATE}: a winch that reels in has a positive speed",
            )
        if self.order != tuple(range(len(self.order))):
            written = ", ".join(names[column] for column in self.order)
            yield Mistake(f"the winches of cables 1 to {len(names)} are {written}", REORDER)
        if self.clock_offset:
            side, remedy = (
                ("ahead of", "subtract that from the winches' times")
                if self.clock_offset > 0.0
                else ("behind", "add that to the winches' times")
            )
            offset = f"{abs(self.clock_offset):.2g} s"
            yield Mistake(f"the winches' clock is {offset} {side} the tracker's", remedy)


def convert(what: str, unit: str, factor: float, column: str) -> str:
    """The remedy for columns in another unit: convert them, or declare the unit."""
    declared = f'{column} [{unit}] in the header of a CSV file, unit = "{unit}" in [recording.columns]'
    return f"multiply {what} by {factor:.4g}, or declare the unit: {declared}"


def _range_text(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"


def likely_drum_radii(ratio: float) -> dict[str, float]:
    """Radii (m) of drums, by the unit of the angles that were recorded as rope speeds, ``ratio`` m of rope each."""
    turn = ratio / (2.0 * np.pi)
    by_unit = {"rad/s": ratio, "deg/s": 360.0 * turn, "rpm": 60.0 * turn, "turns/s": turn}
    return {unit: radius for unit, radius in by_unit.items() if DRUM_RADII[0] <= radius <= DRUM_RADII[1]}


def _factor_text(names: list[str], ratio: float, are_lengths: bool) -> str:
    """What columns are one of whose units is ``ratio`` m of rope, or m/s: angles, or counts."""
    radii = likely_drum_radii(ratio)
    if are_lengths:
        radii = {unit.removesuffix("/s"): radius for unit, radius in radii.items() if unit.endswith("/s")}
    likely = " or ".join(f"{radius:.4g} m if in {unit}" for unit, radius in radii.items())
    unit, kind = ("m", "lengths") if are_lengths else ("m/s", "speeds")
    near = min(SPEED_UNITS, key=lambda symbol: abs(ratio / SPEED_UNITS[symbol] - 1.0))
    error = ratio / SPEED_UNITS[near] - 1.0
    near = near.removesuffix("/s") if are_lengths else near
    parts = [f"1 of theirs is {ratio:.4g} {unit}"]
    parts += (
        [f"{100.0 * abs(error):.2g} % {'more' if error > 0.0 else 'less'} than one {near}"] if abs(error) < 0.1 else []
    )
    parts += [f"as of angles of drums with a radius of {likely}" if likely else "as of an encoder's counts"]
    return f"{_range_text(names)} are not {kind} of ropes in {unit}: {', '.join(parts)}"
