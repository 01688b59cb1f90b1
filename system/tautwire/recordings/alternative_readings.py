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
TIME_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["time"] if unit.symbol in ("s", "ms", "us")}
SPEED_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["speed"]}
LENGTH_UNITS = {unit.symbol: unit.to_si(1.0) for unit in UNITS["length"] if unit.symbol in ("m", "cm", "mm")}


@dataclass(frozen=True)
class Mistake:
    """What was written otherwise than it is read: ``cause`` as a clause, ``remedy`` as an instruction."""

    cause: str
    remedy: str


@dataclass(frozen=True)
class GeometryReading:
    """How positions and anchors are read: units, axes with their signs, and the origin of the positions."""

    position_unit: str = "m"
    anchor_unit: str = "m"
    axes: tuple[int, ...] = (0, 1, 2)
    signs: tuple[int, ...] = (1, 1, 1)
    origin: tuple[float, ...] = (0.0, 0.0, 0.0)

    def positions(self, robot: Robot, shown: Array) -> Array:
        """Positions (N, 3) in m in the robot file's frame; a coordinate that was not measured is the start's."""
        start = np.array(robot.platform.start) * LENGTH_UNITS[self.anchor_unit]
        read = shown[:, self.axes] * self.signs * LENGTH_UNITS[self.position_unit]
        for axis in range(len(AXES)):
            if axis not in robot.axes_in_plane or not np.isfinite(read[:, axis]).any():
                read[:, axis] = start[axis]
        return read + self.origin

    def directions(self, robot: Robot, shown: Array) -> tuple[Array, Array]:
        """Rope lengths (N, n) in m, and unit vectors (N, n, 3) from the platform to the anchors."""
        anchors = np.array(robot.anchors) * LENGTH_UNITS[self.anchor_unit]
        vectors = anchors - self.positions(robot, shown)[:, None]
        lengths = np.linalg.norm(vectors, axis=2)
        return lengths, vectors / np.maximum(lengths, 1e-12)[..., None]

    def mistakes(self) -> Iterator[Mistake]:
        """What this reading changes."""
        if self.position_unit != "m":
            unit = self.position_unit
            yield Mistake(f"x, y, z are in {unit}", convert("x, y, z", unit, LENGTH_UNITS[unit], "x"))
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
        if any(self.origin):
            offset = ", ".join(f"{coordinate:.3g}" for coordinate in self.origin)
            yield Mistake(
                f"x, y, z have another origin, about [{offset}] m in the robot file's frame", "add that vector"
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
                _drum_angle_text(names, self.radius),
                "multiply them by the drum's radius, or declare it as factor in [recording.columns]",
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
    by_unit = {"rad/s": ratio, "deg/s": ratio * 180.0 / np.pi, "rpm": ratio * 30.0 / np.pi}
    return {unit: radius for unit, radius in by_unit.items() if DRUM_RADII[0] <= radius <= DRUM_RADII[1]}


def _drum_angle_text(names: list[str], ratio: float) -> str:
    likely = " or ".join(f"{radius:.4g} m if in {unit}" for unit, radius in likely_drum_radii(ratio).items())
    return f"{_range_text(names)} are not speeds of ropes but of angles of drums with a radius of {likely}"
