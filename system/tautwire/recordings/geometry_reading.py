"""How poses and the robot file's points may be read: units, axes, origin and quaternion other than the format's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire_fmu.laws.rotation import multiply, rotate

from ..robot.cable_routes import cable_routes
from ..robot.robot_assembly import NUMPY_MATHEMATICS
from ..robot.schema import AXES, QUATERNION_COLUMNS, Point, Robot
from .alternative_readings import LENGTH_UNITS, Mistake, convert
from .column_corrections import ColumnCorrection, scaled
from .recording import Recording

Array = NDArray[np.float64]

MIN_LENGTH = 1e-12  # m
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class RecordedPoses:
    """Poses as recorded: ``position`` (N, 3) and quaternion ``orientation`` (N, 4), NaN where not measured."""

    position: Array
    orientation: Array

    @property
    def has_orientation(self) -> bool:
        """Whether the orientation was measured in any sample."""
        return bool(np.isfinite(self.orientation).any())


def signed_axes() -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """The 48 orders of axes with signs, mirrored ones too, by which a point may be read; the first is as shown."""
    return list(product(permutations(range(len(AXES))), product((1, -1), repeat=len(AXES))))


def recorded_poses(recording: Recording, rows: NDArray[np.int64] | slice = slice(None)) -> RecordedPoses:
    """The poses of a recording in these rows."""
    return RecordedPoses(recording.position[rows], recording.orientation[rows])


def unturned(position: Array) -> RecordedPoses:
    """Positions (N, 3) without an orientation."""
    return RecordedPoses(position, np.full((len(position), len(QUATERNION_COLUMNS)), np.nan))


@dataclass(frozen=True)
class QuaternionReading:
    """How the four numbers of a quaternion are read: their order, and from which frame to which they turn."""

    is_scalar_last: bool = False
    is_inverse: bool = False

    def read(self, recorded: Array) -> Array:
        """Quaternions w, x, y, z, platform to world, of recorded ones (N, 4)."""
        ordered = recorded[:, [3, 0, 1, 2]] if self.is_scalar_last else recorded
        return np.asarray(ordered * ([1.0, -1.0, -1.0, -1.0] if self.is_inverse else 1.0))

    def mistakes(self) -> Iterator[Mistake]:
        """What this reading changes."""
        columns = ("qz", "qw", "qx", "qy") if self.is_scalar_last else QUATERNION_COLUMNS
        signs = (1.0, -1.0, -1.0, -1.0) if self.is_inverse else (1.0, 1.0, 1.0, 1.0)
        causes = ["is written as x, y, z, w"] if self.is_scalar_last else []
        causes += ["turns from the world's frame to the platform's"] if self.is_inverse else []
        remedies = [f"read {', '.join(columns)} as qw, qx, qy, qz"] if self.is_scalar_last else []
        remedies += ["negate qx, qy, qz"] if self.is_inverse else []
        corrections = tuple(
            ColumnCorrection(part, column, sign=sign)
            for part, column, sign in zip(QUATERNION_COLUMNS, columns, signs, strict=True)
            if (part, 1.0) != (column, sign)
        )
        if causes:
            yield Mistake(f"the quaternion {' and '.join(causes)}", " and ".join(remedies), corrections)


@dataclass(frozen=True)
class GeometryReading:
    """How poses and the robot file's points are read: units, axes with their signs, frame, and quaternion.

    ``p = rotation @ (signs * shown[axes] * unit) + origin``, in the robot file's frame. The recorded ``odd_axis`` is in
    a unit of its own; positions were read as if they were in their ``stated_unit``. ``attachment_unit`` is also that of
    the centre of mass, whose positions are recorded where ``is_centre_of_mass``.
    """

    position_unit: str = "m"
    anchor_unit: str = "m"
    axes: tuple[int, ...] = (0, 1, 2)
    signs: tuple[int, ...] = (1, 1, 1)
    origin: tuple[float, ...] = (0.0, 0.0, 0.0)
    rotation: tuple[tuple[float, ...], ...] = IDENTITY
    odd_axis: int | None = None
    odd_unit: str = "m"
    attachment_unit: str = "m"
    quaternion: QuaternionReading = QuaternionReading()
    is_centre_of_mass: bool = False
    stated_unit: str = "m"

    def robot(self, declared: Robot) -> Robot:
        """The robot with its points in m."""
        anchor, attachment = LENGTH_UNITS[self.anchor_unit], LENGTH_UNITS[self.attachment_unit]
        if anchor == attachment == 1.0:
            return declared
        cables = tuple(
            replace(cable, anchor=_scaled(cable.anchor, anchor), attachment=_scaled(cable.attachment, attachment))
            for cable in declared.cables
        )
        platform = declared.platform
        start, centre = _scaled(platform.start, anchor), _scaled(platform.centre_of_mass, attachment)
        return replace(declared, cables=cables, platform=replace(platform, start=start, centre_of_mass=centre))

    def orientations(self, declared: Robot, shown: RecordedPoses) -> Array:
        """Quaternions w, x, y, z (N, 4), platform to world; the declared start's where none was measured."""
        if not declared.platform.is_rigid_body or not shown.has_orientation:
            return np.tile(declared.platform.start_orientation, (len(shown.position), 1))
        quaternion = self.quaternion.read(shown.orientation)
        # A rotation seen in other axes turns about the mapped axis, the other way round where these are mirrored.
        if (self.axes, self.signs, self.rotation) == ((0, 1, 2), (1, 1, 1), IDENTITY):
            return quaternion
        axis = self._handedness * quaternion[:, 1:][:, self.axes] * self.signs
        in_frame = Rotation.from_matrix(self.rotation).as_quat()[[3, 0, 1, 2]].tolist()
        return np.column_stack(multiply(in_frame, (quaternion[:, 0], *axis.T)))

    def _factor(self, unit: str) -> float:
        """By what positions in a unit, read in the stated one, have to be multiplied."""
        return LENGTH_UNITS[unit] / LENGTH_UNITS[self.stated_unit]

    @property
    def _handedness(self) -> float:
        """1 where the axes are right-handed as recorded, -1 where they are mirrored."""
        return float(np.linalg.det(np.eye(len(AXES))[list(self.axes)] * np.array(self.signs)[:, None]))

    def positions(self, declared: Robot, shown: RecordedPoses) -> Array:
        """Positions (N, 3) of the platform's origin in m, in the robot file's frame.

        A coordinate that was not measured is the start's.
        """
        robot = self.robot(declared)
        sizes = np.full(len(AXES), self._factor(self.position_unit))
        if self.odd_axis is not None:
            sizes[self.odd_axis] = self._factor(self.odd_unit)
        read = (shown.position * sizes)[:, self.axes] * self.signs
        for axis in range(len(AXES)):
            if axis not in declared.axes_in_plane or not np.isfinite(read[:, axis]).any():
                read[:, axis] = robot.platform.start[axis]
        read = read @ np.transpose(self.rotation) + self.origin
        if self.is_centre_of_mass:
            read = read - turned(self.orientations(declared, shown), robot.platform.centre_of_mass)
        return read

    def directions(self, declared: Robot, shown: RecordedPoses) -> tuple[Array, Array]:
        """Rope lengths (N, n) in m, with those on pulleys, and unit vectors (N, n, 3) along them at the platform."""
        positions, orientations = self.positions(declared, shown), self.orientations(declared, shown)
        with np.errstate(invalid="ignore", divide="ignore"):
            routes = cable_routes(NUMPY_MATHEMATICS, self.robot(declared), positions.T, orientations.T)
        lengths = np.column_stack([route.length for route in routes])
        directions = np.stack([np.column_stack(route.direction) for route in routes], axis=1)
        return lengths, np.where(lengths[..., None] > MIN_LENGTH, directions, 0.0)

    def mistakes(self, has_orientation: bool) -> Iterator[Mistake]:
        """What this reading changes, also of quaternions where there are any."""
        yield from self.quaternion.mistakes()
        others = [axis for index, axis in enumerate(AXES) if index != self.odd_axis]
        stated = "" if self.stated_unit == "m" else f", not in {self.stated_unit}"
        if self.position_unit != self.stated_unit:
            unit, names, factor = self.position_unit, ", ".join(others), self._factor(self.position_unit)
            yield Mistake(f"{names} are in {unit}{stated}", convert(names, factor), scaled(others, factor, unit))
        if self.odd_axis is not None and self.odd_unit != self.stated_unit:
            unit, name, factor = self.odd_unit, AXES[self.odd_axis], self._factor(self.odd_unit)
            yield Mistake(f"{name} is in {unit}{stated}", convert(name, factor), scaled((name,), factor, unit))
        if self.anchor_unit != "m":
            yield _in_other_unit("anchors in the robot file are", self.anchor_unit)
        if self.attachment_unit != "m":
            yield _in_other_unit("attachments in the robot file are", self.attachment_unit)
        shown = [("-" if sign < 0 else "") + AXES[axis] for axis, sign in zip(self.axes, self.signs, strict=True)]
        if shown != list(AXES):
            names = ", ".join(shown)
            signs = [int(self._handedness * sign) for sign in self.signs]
            parts = [f"{'-' if sign < 0 else ''}q{AXES[axis]}" for axis, sign in zip(self.axes, signs, strict=True)]
            quaternion = f", and {', '.join(parts)} as qx, qy, qz" if has_orientation else ""
            remedy = f"write the columns {names} as x, y, z{quaternion}"
            corrections = self._axis_corrections(has_orientation)
            yield Mistake(f"the robot file's x, y, z are the recording's {names}", remedy, corrections)
        offset = ", ".join(f"{coordinate:.3g}" for coordinate in self.origin)
        if self.rotation != IDENTITY:
            yield self._turned_frame(offset, has_orientation)
        elif any(self.origin):
            cause = f"x, y, z have another origin, about [{offset}] m in the robot file's frame"
            shifts = zip(AXES, self.origin, strict=True)
            corrections = tuple(ColumnCorrection(axis, shift=shift) for axis, shift in shifts if shift)
            yield Mistake(cause, "add that vector, or subtract it from the anchors if theirs is another", corrections)
        if self.is_centre_of_mass:
            cause = "x, y, z are those of the centre of mass"
            remedy = "record the frame's origin, or subtract centre_of_mass from all attachments and from itself"
            yield Mistake(cause, remedy)

    def _axis_corrections(self, has_orientation: bool) -> tuple[ColumnCorrection, ...]:
        """Positions along other axes, and the vector parts of quaternions, which turn the other way if mirrored."""
        parts = [("", 1.0)] + ([("q", self._handedness)] if has_orientation else [])
        return tuple(
            ColumnCorrection(f"{part}{AXES[index]}", f"{part}{AXES[axis]}", sign=handedness * sign)
            for part, handedness in parts
            for index, (axis, sign) in enumerate(zip(self.axes, self.signs, strict=True))
            if (axis, handedness * sign) != (index, 1.0)
        )

    def _turned_frame(self, offset: str, has_orientation: bool) -> Mistake:
        angle = np.degrees(np.arccos(np.clip((np.trace(self.rotation) - 1.0) / 2.0, -1.0, 1.0)))
        rows = ", ".join("[" + ", ".join(f"{entry + 0.0:.4g}" for entry in row) + "]" for row in self.rotation)
        quaternion = ""
        if has_orientation:
            parts = ", ".join(
                f"{part + 0.0:.4g}" for part in Rotation.from_matrix(self.rotation).as_quat()[[3, 0, 1, 2]]
            )
            quaternion = f", and the product of quaternions ({parts}) (qw, qx, qy, qz) as qw, qx, qy, qz"
        return Mistake(
            f"{'poses' if has_orientation else 'x, y, z'} are in a frame that is turned by about {angle:.3g} degrees, "
            f"with its origin at [{offset}] m",
            f"write R (x, y, z) + [{offset}] as x, y, z, in m, with R = [{rows}] or what a survey of the tracker says"
            f"{quaternion}",
        )


def turned(quaternions: Array, vector: Point) -> Array:
    """A vector of the platform's frame in the world's axes, (N, 3), by unit quaternions (N, 4)."""
    return np.column_stack(rotate(quaternions.T, vector))


def _scaled(point: Point, factor: float) -> Point:
    x, y, z = point
    return (factor * x, factor * y, factor * z)


def _in_other_unit(what: str, unit: str) -> Mistake:
    return Mistake(f"{what} in {unit}", f"multiply their coordinates by {LENGTH_UNITS[unit]:g}")
