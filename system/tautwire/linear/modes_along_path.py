"""Modes along a path, tracked by their shapes through frequency crossings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from ..array_validation import validate_array, validate_increasing
from ..errors import ArgumentError
from ..robot.pose_trajectory import turns
from ..robot.schema import Robot, validate_robot
from ..robot.trajectory import Trajectory, require_trajectory
from ..validation import validate_integer
from .linear_plant import LinearPlant, linearise
from .modes import Modes, cable_shares, translational_shares
from .operating_point import Pose

Array = NDArray[np.float64]
_PathPose = tuple[Array, Array | None]

DEFAULT_POINTS = 101
MIN_MODAL_ASSURANCE = 0.9
MAX_BISECTIONS = 6
FREQUENCY_TOLERANCE = 1e-3


@dataclass(frozen=True)
class _LocalModes:
    """Modes at one position, with the root W (d, d) of the mass matrix ``W' W`` there.

    ``with_shapes`` gives the modes with other shapes of the same motions.
    """

    modes: Modes
    mass_root: Array
    with_shapes: Callable[[Array], Modes]

    def fields(self, shapes: Array) -> Array:
        """Unit columns (d, k) of ``W phi``, which are orthogonal for the modes of this position."""
        weighted: Array = self.mass_root @ shapes
        return weighted / np.linalg.norm(weighted, axis=0)


@dataclass(frozen=True)
class ModesAlong:
    """Modes at N points of a path; column k of every array is one tracked mode, by frequency at the first point.

    ``abscissa`` (N,) is time in s, or distance travelled in m where ``is_timed`` is False; ``positions`` (N, 3) in m;
    ``frequencies`` and ``damped_frequencies`` (N, d) in Hz; ``damping_ratios`` (N, d); ``shapes`` (N, d, d) as
    :class:`tautwire.linear.Modes` has them; ``cable_shares`` (N, n, d) and ``translational_shares`` (N, d) of energy.
    ``modal_assurance`` (N - 1,) is the smallest modal assurance criterion, ``(phi_a' M phi_b)^2`` over the same of each
    with itself, between neighbours: near 1 the tracking is certain, below 0.5 the path is too coarse there, or modes of
    equal frequency mix.
    """

    abscissa: Array
    is_timed: bool
    positions: Array
    frequencies: Array
    damping_ratios: Array
    damped_frequencies: Array
    shapes: Array
    cable_shares: Array
    translational_shares: Array
    modal_assurance: Array


def modes_along(
    robot: Robot, path: Trajectory | ArrayLike, times: ArrayLike | None = None, points: int = DEFAULT_POINTS
) -> ModesAlong:
    """Computes the modes of a robot at rest at points of a path, tracked by shape; the paper's Fig. 15 in one call.

    ``path`` is a trajectory, taken at ``times`` (N,) in s or at ``points`` equidistant times of its duration, or
    positions (N, 3) in m, optionally with ``times``. Modes are matched by shape; between neighbours whose shapes differ
    much the path is bisected, up to six times. Shapes of modes whose frequencies differ by less than 0.1 % are not
    unique: they are rotated to match the previous ones, so that modes that come so near cross. A rigid platform has the
    orientation of the trajectory, or keeps its start orientation; fewer than six cables hold it in equilibrium.

    Raises ArgumentError for an invalid argument or a path of fewer than two points, and what
    :func:`tautwire.linear.linearise` raises.
    """
    validate_robot("modes_along: robot", robot)
    validate_integer("modes_along: points", points, 2, "give two or more")
    pose_at, abscissa, is_timed = _path_poses(path, times, points)
    count = len(abscissa)

    def modes_at(coordinate: float) -> _LocalModes:
        position, orientation = pose_at(coordinate)
        return _local_modes(robot, linearise(robot, position, 0.0, orientation))

    local_modes = [modes_at(float(index)) for index in range(count)]
    tracked_modes = _track_modes(modes_at, local_modes)
    stacked = {field.name: np.array([getattr(modes, field.name) for modes in tracked_modes]) for field in fields(Modes)}
    assurance = [
        np.min(_modal_assurance(local, a, b).diagonal())
        for local, (a, b) in zip(local_modes[1:], pairwise(tracked_modes), strict=True)
    ]
    positions = np.array([pose_at(float(index))[0] for index in range(count)])
    return ModesAlong(
        abscissa=abscissa, is_timed=is_timed, positions=positions, modal_assurance=np.array(assurance), **stacked
    )


def _local_modes(robot: Robot, plant: LinearPlant) -> _LocalModes:
    pose, degrees = Pose(robot, plant.position, plant.orientation), len(plant.modes.shapes)
    mass = np.linalg.inv(plant.system.B[degrees : 2 * degrees, robot.cable_count :])
    mass_root: Array = np.asarray(np.linalg.cholesky(0.5 * (mass + mass.T)), dtype=np.float64).T

    def with_shapes(shapes: Array) -> Modes:
        shapes = shapes / np.linalg.norm(pose.displacements(shapes), axis=1).max(axis=0)
        return replace(
            plant.modes,
            shapes=shapes,
            cable_shares=cable_shares(pose, plant.tensions, plant.tension_slopes, shapes),
            translational_shares=translational_shares(pose, mass, shapes),
        )

    return _LocalModes(plant.modes, mass_root, with_shapes)


def _path_poses(
    path: Trajectory | ArrayLike, times: ArrayLike | None, points: int
) -> tuple[Callable[[float], _PathPose], Array, bool]:
    """The pose as a function of the (fractional) point number, the abscissa, and whether that is time."""
    if not hasattr(path, "__len__"):
        trajectory = require_trajectory("modes_along: path", path)
        requested_times = np.linspace(0.0, trajectory.duration, points) if times is None else times
        instants = validate_increasing(
            "modes_along: times", requested_times, "finite times (N,) in s that rise, two or more"
        )
        numbers = np.arange(len(instants))

        def pose_at(where: float) -> _PathPose:
            time = np.array([np.interp(where, numbers, instants)])
            orientation = trajectory.orientation(time)[0] if turns(trajectory) else None
            return trajectory.position(time)[0], orientation

        return pose_at, instants, True
    positions = validate_array("modes_along: path", path, (None, 3), "a path, or finite positions (N, 3) in m")
    if len(positions) < 2:
        raise ArgumentError("modes_along: path", path, f"has {len(positions)} places", "give two or more")
    numbers = np.arange(len(positions))
    distances = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    abscissa = distances
    if times is not None:
        meaning = f"one time for each of {len(positions)} positions, in s"
        abscissa = validate_array("modes_along: times", times, (len(positions),), meaning)
    return (
        (lambda where: (np.array([np.interp(where, numbers, axis) for axis in positions.T]), None)),
        abscissa,
        times is not None,
    )


def _track_modes(modes_at: Callable[[float], _LocalModes], local_modes: Sequence[_LocalModes]) -> list[Modes]:
    """Modes at 0 ... count - 1, tracked in both directions from where the frequencies differ most."""
    count = len(local_modes)
    first = int(np.argmax([_min_relative_gap(local.modes.frequencies) for local in local_modes]))
    tracked = {first: local_modes[first].modes}
    for sign, indices in ((1, range(first + 1, count)), (-1, range(first - 1, -1, -1))):
        for index in indices:
            previous = index - sign
            tracked[index] = _track_interval(
                modes_at, tracked[previous], previous, local_modes[index], index, MAX_BISECTIONS
            )
    order = np.argsort(tracked[0].frequencies)
    return [_reorder(tracked[index], order) for index in range(count)]


def _track_interval(
    modes_at: Callable[[float], _LocalModes],
    previous: Modes,
    begin: float,
    following: _LocalModes,
    end: float,
    bisections: int,
) -> Modes:
    """The modes at ``end`` in the order and with the signs of the ``previous`` ones at ``begin``."""
    rotated = _rotate_degenerate(following, previous)
    assurance = _modal_assurance(following, previous, rotated)
    rows, columns = linear_sum_assignment(-assurance)
    if bisections == 0 or np.min(assurance[rows, columns]) > MIN_MODAL_ASSURANCE:
        return _align_signs(_reorder(rotated, columns), previous)
    middle = 0.5 * (begin + end)
    middle_modes = _track_interval(modes_at, previous, begin, modes_at(middle), middle, bisections - 1)
    return _track_interval(modes_at, middle_modes, middle, following, end, bisections - 1)


def _modal_assurance(local: _LocalModes, a: Modes, b: Modes) -> Array:
    """Modal assurance criterion (MAC) of each mode of one set with each of another, weighted by the local mass."""
    assurance: Array = (local.fields(a.shapes).T @ local.fields(b.shapes)) ** 2
    return assurance


def _reorder(modes: Modes, order: NDArray[np.intp]) -> Modes:
    return Modes(**{field.name: getattr(modes, field.name)[..., order] for field in fields(Modes)})


def _align_signs(modes: Modes, previous: Modes) -> Modes:
    """Modes with shapes of the same sign as the previous ones."""
    is_opposite = np.sum(previous.shapes * modes.shapes, axis=0) < 0.0
    return replace(modes, shapes=np.where(is_opposite, -modes.shapes, modes.shapes))


def _rotate_degenerate(local: _LocalModes, reference: Modes) -> Modes:
    """Rotates shapes of nearly equal frequency to match those of ``reference`` (orthogonal Procrustes problem).

    Each gets the frequency whose rank its Rayleigh quotient has.
    """
    modes, shapes, goal = local.modes, local.fields(local.modes.shapes), local.fields(reference.shapes)
    order = np.arange(len(modes.frequencies))
    for group in _degenerate_groups(modes.frequencies):
        _, columns = linear_sum_assignment(-((shapes[:, group].T @ goal) ** 2))
        left_vectors, _, right_vectors = np.linalg.svd(shapes[:, group].T @ goal[:, columns])
        rotation = left_vectors @ right_vectors
        shapes[:, group] = shapes[:, group] @ rotation
        quotients = (rotation**2).T @ modes.frequencies[group] ** 2
        order[group] = np.array(group)[np.argsort(np.argsort(quotients))]
    rotated = local.with_shapes(np.asarray(np.linalg.solve(local.mass_root, shapes), dtype=np.float64))
    named = ("shapes", "cable_shares", "translational_shares")
    return replace(_reorder(modes, order), **{name: getattr(rotated, name) for name in named})


def _degenerate_groups(frequencies: Array) -> list[list[int]]:
    """Groups of modes, by ascending frequency, that differ by less than :data:`FREQUENCY_TOLERANCE` from the next."""
    groups: list[list[int]] = [[0]]
    for mode, (lower, upper) in enumerate(pairwise(frequencies), start=1):
        if upper - lower <= FREQUENCY_TOLERANCE * upper:
            groups[-1].append(mode)
        else:
            groups.append([mode])
    return [group for group in groups if len(group) > 1]


def _min_relative_gap(frequencies: Array) -> float:
    return float(np.min(np.diff(frequencies) / frequencies[1:]))
