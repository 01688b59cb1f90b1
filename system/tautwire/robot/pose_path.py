"""The poses that a robot takes along a path: those of the path, and in equilibrium where too few cables hold any.

A path without orientations keeps the start orientation. With fewer than six cables statics decides the orientation, so
that the platform follows in position, at the orientation in equilibrium nearest to that of the robot file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

from ..errors import ArgumentError, UnreachableError
from .pose_trajectory import (
    OrientationTrajectory,
    PoseTrajectory,
    evaluate_path,
    rotation_vectors_between,
    turns,
)
from .rigid_equilibrium import FREEDOMS, static_equilibrium
from .schema import Quaternion, Robot
from .static_equilibrium import start_orientation
from .trajectory import Line, Trajectory

Array = NDArray[np.float64]

# Points of the orientation in equilibrium along a path, at first and at most; they are doubled until a quintic spline
# through them, which is smooth in acceleration, meets those between them within a tolerance in rad.
FIRST_POINTS, MAX_POINTS, SPLINE_DEGREE, SPLINE_TOLERANCE = 11, 641, 5, 1e-6
# After so many doublings an error that does not fall below this share of the one before is that of a jump, where a
# spline meets the positions, whose motion it has to follow first, within a share of their extent.
SMOOTH_DOUBLINGS, JUMP_RATIO, RESOLVED_SHARE = 3, 0.75, 1e-3
# rad: a path may turn this far from the orientation in equilibrium, as one rounded to three decimals does.
MAX_EQUILIBRIUM_DEVIATION = 2e-3


@dataclass(frozen=True)
class PoseSamples:
    """Poses at N times: ``position`` (N, 3) in m, ``orientation`` (N, 4), ``twist`` and ``acceleration`` (N, d).

    Of a rigid body d is 6, and the angular velocity (rad/s) and acceleration (rad/s^2) follow those of the origin; of a
    point mass d is 3, and the orientation is that of the robot file.
    """

    position: Array
    orientation: Array
    twist: Array
    acceleration: Array


@dataclass(frozen=True)
class SplineTrajectory:
    """A trajectory by a spline in time, (N, 3), from 0 s to ``duration``; it rests before and after."""

    spline: BSpline
    duration: float

    def position(self, times: Array) -> Array:
        """Reference position."""
        return np.asarray(self.spline(np.clip(times, 0.0, self.duration)), dtype=np.float64)

    def velocity(self, times: Array) -> Array:
        """Its rate."""
        return self._derivative(times, 1)

    def acceleration(self, times: Array) -> Array:
        """Its second rate."""
        return self._derivative(times, 2)

    def _derivative(self, times: Array, order: int) -> Array:
        instants = np.asarray(times, dtype=float)
        moves = (instants > 0.0) & (instants < self.duration)
        return np.where(moves[:, None], self.spline(np.clip(instants, 0.0, self.duration), order), 0.0)


def pose_path(robot: Robot, trajectory: Trajectory) -> Trajectory:
    """The path of poses that a robot takes along a trajectory; that itself for a point mass.

    Raises UnreachableError where fewer than six cables hold the platform nowhere near the orientation of the path,
    ArgumentError where a point mass is to turn.
    """
    if not robot.platform.is_rigid_body:
        if turns(trajectory):
            problem = "turns the platform, which is a point mass"
            hint = "leave its orientation out, or give [platform] an inertia"
            raise ArgumentError(f"{robot.name}: trajectory", trajectory, problem, hint)
        return trajectory
    if robot.cable_count < FREEDOMS:
        return PoseTrajectory(trajectory, _equilibrium_orientations(robot, trajectory))
    if turns(trajectory):
        return trajectory
    # With six cables or more the start orientation is the declared one.
    return PoseTrajectory(trajectory, _held_orientation(robot.platform.start_orientation, trajectory))


def sample_poses(caller: str, robot: Robot, path: Trajectory, times: Array) -> PoseSamples:
    """Samples of a path as :func:`pose_path` returns it; raises ArgumentError for values that are not finite."""
    position, velocity, acceleration = (
        evaluate_path(caller, path, name, times) for name in ("position", "velocity", "acceleration")
    )
    if not turns(path):
        held = np.tile(robot.platform.start_orientation, (len(times), 1))
        return PoseSamples(position, held, velocity, acceleration)
    orientation, angular_velocity, angular_acceleration = (
        evaluate_path(caller, path, name, times) for name in ("orientation", "angular_velocity", "angular_acceleration")
    )
    return PoseSamples(
        position,
        orientation,
        np.hstack([velocity, angular_velocity]),
        np.hstack([acceleration, angular_acceleration]),
    )


def _held_orientation(orientation: Quaternion, trajectory: Trajectory) -> OrientationTrajectory:
    origin = (0.0, 0.0, 0.0)
    return OrientationTrajectory(orientation, Line(origin, origin, trajectory.duration))


def _equilibrium_orientations(robot: Robot, trajectory: Trajectory) -> OrientationTrajectory:
    """Orientations in equilibrium along a path, nearest to those of the path or of the robot file."""
    start = start_orientation(robot)

    def vectors_at(times: Array) -> Array:
        return rotation_vectors_between(_equilibria_along(robot, trajectory, times), np.array(start))

    times = np.linspace(0.0, trajectory.duration, FIRST_POINTS)
    vectors, error = vectors_at(times), np.inf
    errors: list[float] = []
    spline = make_interp_spline(times, vectors, SPLINE_DEGREE)
    while error > SPLINE_TOLERANCE and len(times) < MAX_POINTS and not _meets_a_jump(errors):
        middles = 0.5 * (times[1:] + times[:-1])
        between = vectors_at(middles)
        error = float(np.max(np.abs(spline(middles) - between)))
        errors = [*errors, error] if _is_resolved(trajectory, times, middles) else []
        indices = np.arange(1, len(times))
        times, vectors = np.insert(times, indices, middles), np.insert(vectors, indices, between, axis=0)
        spline = make_interp_spline(times, vectors, SPLINE_DEGREE)
    return OrientationTrajectory(start, SplineTrajectory(spline, trajectory.duration))


def _is_resolved(trajectory: Trajectory, times: Array, middles: Array) -> bool:
    """Whether a spline through the positions at times (N,) meets those at the times between them (N - 1,)."""
    positions, between = (evaluate_path("pose_path", trajectory, "position", each) for each in (times, middles))
    errors = make_interp_spline(times, positions, SPLINE_DEGREE)(middles) - between
    return bool(np.max(np.abs(errors)) <= RESOLVED_SHARE * np.max(np.ptp(positions, axis=0)))


def _meets_a_jump(errors: list[float]) -> bool:
    """Whether more points no longer help: a jump between two equilibria would only become steeper."""
    return len(errors) >= SMOOTH_DOUBLINGS and errors[-1] > JUMP_RATIO * errors[-2]


def _equilibria_along(robot: Robot, trajectory: Trajectory, times: Array) -> Array:
    """Orientations in equilibrium at times of a path, (N, 4)."""
    positions = evaluate_path("pose_path", trajectory, "position", times)
    if not turns(trajectory):
        return np.array([static_equilibrium(robot, position).orientation for position in positions])
    orientations = []
    asked_orientations = evaluate_path("pose_path", trajectory, "orientation", times)
    for time, position, asked in zip(times.tolist(), positions, asked_orientations, strict=True):
        w, x, y, z = (asked / np.linalg.norm(asked)).tolist()
        equilibrium = static_equilibrium(robot, position, orientation=(w, x, y, z))
        if equilibrium.moved_by > MAX_EQUILIBRIUM_DEVIATION:
            angle = np.degrees(equilibrium.moved_by)
            reason = (
                f"the {robot.cable_count} cables leave a moment at the path's orientation at {time:g} s, the nearest "
                f"in equilibrium is {angle:.3g} degrees away"
            )
            hint = "leave the orientation out of the path: with fewer than six cables statics decides it"
            raise UnreachableError(robot.name, position.tolist(), None, None, reason, hint)
        orientations.append(equilibrium.orientation)
    return np.array(orientations)
