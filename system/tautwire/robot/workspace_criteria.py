"""What makes a pose belong to a workspace: the margin of each criterion, negative where the pose does not belong."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, total_mass
from tautwire_fmu.laws.rotation import rotate

from ..errors import InputError
from .active_effects import body_constants, cables_have_weight, platform_effects
from .cable_routes import cable_routes
from .kinematics import structure_matrix_at
from .rigid_equilibrium import FREEDOMS, load_wrench, platform_size
from .schema import Quaternion, Robot, TensionLimits
from .static_equilibrium import tensions_at
from .static_load import cable_weight_force, static_load
from .tension_distribution import DEFAULT_LIMITS
from .wrench_polytope import polytope_margin

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RequiredMotion:
    """Accelerations that the cables have to provide at rest, beside the weight.

    Each component of the acceleration of the centre of mass is at most ``acceleration`` (m/s^2), each of the angular
    acceleration about the platform's axes at most ``angular_acceleration`` (rad/s^2).
    """

    acceleration: float = 0.0
    angular_acceleration: float = 0.0

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("acceleration", self.acceleration, "m/s2"),
            ("angular acceleration", self.angular_acceleration, "rad/s2"),
        ):
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(name, f"{value:g} {unit} is negative or not finite", "give zero or more")


def wrench_feasible_margin(robot: Robot, position: Array, orientation: Quaternion, motion: RequiredMotion) -> float:
    """Smallest wrench, in N, that on top of the required ones exceeds what tensions within bounds can exert.

    Moments count by the platform's size (:func:`tautwire.robot.rigid_equilibrium.platform_size`).

    Raises UnreachableError where a cable has no length.
    """
    matrix = _scaled_structure_matrix(robot, position, orientation)
    return polytope_margin(matrix, tension_limits(robot), _required_wrenches(robot, position, orientation, motion))


def wrench_closure_margin(robot: Robot, position: Array, orientation: Quaternion, motion: RequiredMotion) -> float:
    """Least wrench, in the worst direction, that tensions from 0 to 1 N exert, in N; NaN where some exert none at all.

    Where it is a number, cables without a largest tension can exert every wrench. Load and motion do not count.

    Raises UnreachableError where a cable has no length.
    """
    del motion
    matrix = _scaled_structure_matrix(robot, position, orientation)
    if np.linalg.matrix_rank(matrix, CLOSURE_TOLERANCE) < len(matrix):
        return np.nan
    margin = polytope_margin(matrix, TensionLimits(0.0, 1.0, 0.0), np.zeros((1, len(matrix))))
    return margin if margin > CLOSURE_TOLERANCE else np.nan


def static_margin(robot: Robot, position: Array, orientation: Quaternion, motion: RequiredMotion) -> float:
    """How far the static tensions are from their bounds at least, in N; of less than six cables any near orientation.

    Raises UnreachableError where the cables cannot hold the platform.
    """
    del motion
    limits = tension_limits(robot)
    tensions = tensions_at(robot, position, orientation)
    return max(float(np.min(np.minimum(tensions - limits.minimum, limits.maximum - tensions))), 0.0)


Criterion = Callable[[Robot, Array, Quaternion, RequiredMotion], float]
CRITERIA: Mapping[str, Criterion] = {
    "wrench-feasible": wrench_feasible_margin,
    "wrench-closure": wrench_closure_margin,
    "static": static_margin,
}
CLOSURE_TOLERANCE = 1e-9


def degrees_of_freedom(robot: Robot) -> int:
    """Six of a rigid platform, three of a point mass."""
    return FREEDOMS if robot.platform.is_rigid_body else 3


def tension_limits(robot: Robot) -> TensionLimits:
    """The limits of the robot file where there are more cables than degrees of freedom; else cables only pull."""
    is_redundant = robot.cable_count > degrees_of_freedom(robot)
    return (robot.tension or DEFAULT_LIMITS) if is_redundant else DEFAULT_LIMITS


def _scaled_structure_matrix(robot: Robot, position: Array, orientation: Quaternion) -> Array:
    return _scale(robot)[:, None] * structure_matrix_at(robot, position, orientation)


def _scale(robot: Robot) -> Array:
    """By which wrenches are multiplied, so that all their coordinates are in N."""
    return np.array([1.0] * 3 + [1.0 / platform_size(robot)] * 3) if robot.platform.is_rigid_body else np.ones(3)


def _required_wrenches(robot: Robot, position: Array, orientation: Quaternion, motion: RequiredMotion) -> Array:
    """Corners of the set of required wrenches, scaled to N, shape (m, d)."""
    constants = PointMassConstants(robot.platform.mass, robot.gravity)
    force = float(total_mass(REAL, constants, platform_effects(robot))) * motion.acceleration
    forces = force * _corners(motion.acceleration)
    if not robot.platform.is_rigid_body:
        # What a planar robot cannot do it need not.
        forces[:, [axis for axis in range(3) if axis not in robot.axes_in_plane]] = 0.0
        return _point_load(robot, position, orientation) + forces
    body = body_constants(robot)
    arm = np.array(rotate(orientation, body.centre_of_mass))
    turning = motion.angular_acceleration * _corners(motion.angular_acceleration) @ np.array(body.inertia)
    moments = np.array([rotate(orientation, moment) for moment in turning.tolist()])
    corners = [np.concatenate([f, np.cross(arm, f) + m]) for f in forces for m in moments]
    return _scale(robot) * (load_wrench(robot, position, orientation) + np.array(corners))


def _corners(size: float) -> Array:
    return np.array(list(product((-1.0, 1.0), repeat=3)) if size else [(0.0, 0.0, 0.0)])


def _point_load(robot: Robot, position: Array, orientation: Quaternion) -> Array:
    """Load on the cables of a point mass; of cables with weight, each carries as much as the platform weighs."""
    load = np.array(static_load(REAL, robot, position.tolist()), dtype=float)
    if not cables_have_weight(robot):
        return load
    routes = cable_routes(REAL, robot, position.tolist(), orientation)
    tensions = [float(np.linalg.norm(load))] * len(routes)
    return load - np.array(cable_weight_force(REAL, robot, routes, tensions), dtype=float)
