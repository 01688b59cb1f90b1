"""Mistakes in the points of a rigid platform's ropes, told by winch travel: their order, and the tracker's body.

A body of markers that is turned and shifted to the platform's frame shows poses in which the ropes end at
``R b_i + d``, with ``b_i`` the attachments in the platform's frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, linear_sum_assignment
from scipy.spatial.transform import Rotation

from ..robot.rigid_equilibrium import platform_size
from ..robot.schema import AXES, Robot
from .alternative_readings import winding_as_declared
from .geometry_reading import GeometryReading, RecordedPoses, recorded_poses, signed_axes
from .mistaken_motion import EQUAL_DIFFERENCE, EQUAL_RATIO, MIN_IMPROVEMENT
from .motion_regression import centred, moving_rows, rope_motion, wound_lengths_in
from .recording import Recording

Array = NDArray[np.float64]

MAX_LEFT = 0.06  # of misfits
# Of signed axes: those that are fitted further, and how near to them a fitted frame is (rad) to be called theirs.
FITTED_AXES, MAX_AXES_ERROR = 4, np.radians(3.0)
MIN_SHIFT = 0.05  # of the platform's size, to be told
ROWS_FITTED = 200


@dataclass(frozen=True)
class PointMistake:
    """Points elsewhere than the robot file says: the ``cause`` as a clause, what mends it, and the misfit then left."""

    cause: str
    remedy: str
    misfit: float


@dataclass(frozen=True)
class _Motion:
    """A rigid platform's poses in the rows where it moves, and the lengths wound (M, n) in m about their means."""

    robot: Robot
    poses: RecordedPoses
    wound: Array

    def lengths(self, robot: Robot) -> Array:
        """Rope lengths (M, n) in m about their means of a robot with other points."""
        return centred(np.nan_to_num(GeometryReading().directions(robot, self.poses)[0]))

    def misfit(self, robot: Robot) -> float:
        """Misfit between these lengths and what was wound."""
        winding = winding_as_declared(robot.cable_count)
        return rope_motion(robot, GeometryReading(), self.poses).misfit(self.wound, winding)


def point_mistake(robot: Robot, recording: Recording) -> PointMistake | None:
    """The mistake in attachments, anchors or the tracker's body that explains what was wound; None where none does.

    Tried are other orders of the attachments or of the anchors, of the quaternion's vector with signs, other axes of
    the attachments and, where none of these explains it nearly as well, a frame of theirs that is turned and shifted.
    """
    rows = moving_rows(robot, recording) if robot.platform.is_rigid_body else None
    if rows is None or not recording.has_orientation:
        return None
    motion = _Motion(robot, recorded_poses(recording, rows), wound_lengths_in(rows, recording))
    limit = min(motion.misfit(robot) / MIN_IMPROVEMENT, MAX_LEFT)
    axes = _likely_axes(motion)
    exact = [*_in_another_order(motion), *_with_another_vector(motion), *_along_other_axes(motion, axes)]
    fitted = min(_in_fitted_frames(motion, axes), key=attrgetter("misfit"))
    simple = min(exact, key=attrgetter("misfit"))
    best = simple if simple.misfit <= EQUAL_RATIO * fitted.misfit + EQUAL_DIFFERENCE else fitted
    return best if best.misfit <= limit else None


def _in_another_order(motion: _Motion) -> Iterator[PointMistake]:
    """Orders of attachments, and of anchors, by linear assignment of each winch to the rope that it may have moved."""
    count = motion.robot.cable_count
    for key in ("attachment", "anchor"):
        costs = np.empty((count, count))
        for shift in range(count):
            sources = np.roll(np.arange(count), -shift)
            missed = motion.lengths(_reordered(motion.robot, key, sources.tolist())) + motion.wound
            costs[np.arange(count), sources] = np.sum(missed**2, axis=0)
        order = linear_sum_assignment(costs)[1].tolist()
        if order == list(range(count)):
            continue
        moved = [cable for cable, source in enumerate(order) if cable != source]
        names, others = _numbers(moved), _numbers([order[cable] for cable in moved])
        yield PointMistake(
            f"the {key}s of cables {names} in the robot file are those of cables {others}",
            f"give cables {names} the {key}s of cables {others}",
            motion.misfit(_reordered(motion.robot, key, order)),
        )


def _numbers(cables: list[int]) -> str:
    return ", ".join(str(cable + 1) for cable in cables)


def _reordered(robot: Robot, key: str, sources: list[int]) -> Robot:
    points = [getattr(robot.cables[source], key) for source in sources]
    cables = tuple(replace(cable, **{key: point}) for cable, point in zip(robot.cables, points, strict=True))
    return replace(robot, cables=cables)


def _with_another_vector(motion: _Motion) -> Iterator[PointMistake]:
    """Orders and signs of the quaternion's qx, qy, qz."""
    shown = motion.poses.orientation
    for matrix in _signed_axes():
        names = _axes_text(matrix, "q")
        poses = RecordedPoses(motion.poses.position, np.column_stack([shown[:, 0], shown[:, 1:] @ matrix.T]))
        yield PointMistake(
            f"the platform's qx, qy, qz are the recorded {names}",
            f"write the columns {names} as qx, qy, qz",
            replace(motion, poses=poses).misfit(motion.robot),
        )


def _along_other_axes(motion: _Motion, axes: Sequence[Array]) -> Iterator[PointMistake]:
    """Attachments along other axes."""
    for matrix in axes:
        if not np.array_equal(matrix, np.eye(len(AXES))):
            yield _frame_mistake(motion, matrix, np.zeros(len(AXES)))


def _in_fitted_frames(motion: _Motion, axes: Sequence[Array]) -> Iterator[PointMistake]:
    """Frames of the attachments that are turned and shifted as fits best, near likely axes or their own."""
    for matrix in (np.eye(len(AXES)), *axes):
        yield _frame_mistake(motion, *_fitted_frame(motion, matrix))


def _likely_axes(motion: _Motion) -> list[Array]:
    """The signed axes along which attachments fit best."""
    unshifted = np.zeros(len(AXES))
    axes = [np.eye(len(AXES)), *_signed_axes()]
    return sorted(axes, key=lambda matrix: motion.misfit(_moved(motion.robot, matrix, unshifted)))[:FITTED_AXES]


def _signed_axes() -> list[Array]:
    """Matrices (3, 3) that map a vector on its components in other orders and with other signs."""
    identity = np.eye(len(AXES))
    matrices = [identity[list(axes)] * np.array(signs)[:, None] for axes, signs in signed_axes()]
    return [matrix for matrix in matrices if not np.array_equal(matrix, identity)]


def _axes_text(matrix: Array, prefix: str = "") -> str:
    """As in "y, -x, z"."""
    rows = [(row.sum(), AXES[int(np.argmax(np.abs(row)))]) for row in matrix]
    return ", ".join(f"{'-' if sign < 0.0 else ''}{prefix}{axis}" for sign, axis in rows)


def _fitted_frame(motion: _Motion, matrix: Array) -> tuple[Array, Array]:
    """The orthogonal matrix near another, and the shift in m, with which attachments fit best."""
    step = max(1, len(motion.wound) // ROWS_FITTED)
    poses = RecordedPoses(motion.poses.position[::step], motion.poses.orientation[::step])
    part = _Motion(motion.robot, poses, centred(motion.wound[::step]))

    def frame(parameters: Array) -> tuple[Array, Array]:
        return Rotation.from_rotvec(parameters[:3]).as_matrix() @ matrix, parameters[3:]

    def missed(parameters: Array) -> Array:
        return np.asarray((part.lengths(_moved(motion.robot, *frame(parameters))) + part.wound).ravel())

    scale = np.concatenate([np.ones(3), np.full(3, platform_size(motion.robot))])
    return frame(least_squares(missed, np.zeros(6), x_scale=scale, loss="soft_l1").x)


def _moved(robot: Robot, matrix: Array, shift: Array) -> Robot:
    cables = tuple(
        replace(cable, attachment=tuple((matrix @ np.array(cable.attachment) + shift).tolist()))
        for cable in robot.cables
    )
    return replace(robot, cables=cables)


def _frame_mistake(motion: _Motion, rotation: Array, shift: Array) -> PointMistake:
    nearest, angle = _nearest_axes(rotation)
    is_of_axes = angle <= MAX_AXES_ERROR
    matrix = nearest if is_of_axes else rotation
    is_shifted = np.linalg.norm(shift) > MIN_SHIFT * platform_size(motion.robot)
    offset = shift if is_shifted else np.zeros(len(AXES))
    parts = []
    if not is_of_axes:
        degrees = np.degrees(Rotation.from_matrix(rotation * np.linalg.det(rotation)).magnitude())
        parts.append(f"turned by about {degrees:.3g} degrees")
    elif not np.array_equal(nearest, np.eye(len(AXES))):
        mirrored = ", mirrored" if np.linalg.det(nearest) < 0.0 else ""
        parts.append(f"their {_axes_text(nearest)} are x, y, z of the recorded pose{mirrored}")
    written = ", ".join(f"{coordinate:.3g}" for coordinate in offset)
    parts += [f"shifted by about [{written}] m"] if is_shifted else []
    rows = ", ".join("[" + ", ".join(f"{entry:.4g}" for entry in row) + "]" for row in matrix)
    return PointMistake(
        f"the attachments are in another frame than the recorded pose: {' and '.join(parts)}",
        "record the pose of the robot file's frame, or write R b + d in place of each attachment b, with "
        f"R = [{rows}] and d = [{written}] m, and of the centre of mass",
        motion.misfit(_moved(motion.robot, matrix, offset)),
    )


def _nearest_axes(rotation: Array) -> tuple[Array, float]:
    """The signed axes nearest to an orthogonal matrix, and the angle in between, in rad."""
    largest = np.argmax(np.abs(rotation), axis=1)
    nearest = np.eye(len(AXES))[largest] * np.sign(rotation[range(len(AXES)), largest])[:, None]
    return nearest, float(np.arccos(np.clip((np.trace(rotation @ nearest.T) - 1.0) / 2.0, -1.0, 1.0)))
