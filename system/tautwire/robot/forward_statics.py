"""Forward kinematics where statics has a part: of ropes that sag, and of platforms on fewer than six cables.

Fewer than six lengths do not determine the pose of a rigid platform: it is where these ropes hold it in equilibrium
(the direct geometrico-static problem), so that pose and tensions solve both at once,

    l_i(p, R, T_i) = L_i,    A(p, R) T = w(p, R, T),    T_i >= 0

Source: Carricato and Merlet (2013), IEEE Transactions on Robotics 29(1), 288-296.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..array_validation import validate_array
from ..errors import UnreachableError
from .active_effects import cables_have_weight
from .kinematics import (
    DEFAULT_STARTS,
    RESIDUAL_FLOOR,
    START_ANGLE,
    START_DISTANCE_RATIO,
    ForwardSolution,
    forward_kinematics,
    inverse_kinematics,
    is_same_pose,
    structure_matrix_at,
    turned_orientation,
    validated_pose,
)
from .rigid_equilibrium import FREEDOMS, load_wrench, platform_size
from .schema import Quaternion, Robot, validate_robot
from .static_equilibrium import tensions_at
from .static_pose import rope_lengths

Array = NDArray[np.float64]

# Fixed-point iteration of a pose with sag; relative to the longest rope.
MAX_SAG_ITERATIONS, SAG_TOLERANCE = 50, 1e-12
# Wrench that may be left, and tension by which a cable may push, relative to the load.
BALANCE_TOLERANCE = 1e-7
MAX_EVALUATIONS = 300


def forward_kinematics_of_ropes(
    robot: Robot,
    lengths: Sequence[float] | Array,
    position: Sequence[float] | Array | None = None,
    orientation: Sequence[float] | None = None,
) -> tuple[ForwardSolution, ...]:
    """Forward kinematics of ropes that may sag: the poses near a guess, by default the start, with lengths (n,) in m.

    Without the effect ``sag`` those of :func:`tautwire.robot.kinematics.forward_kinematics`. With it, the lengths are
    less what the ropes are longer than straight ones under their static tensions, by fixed-point iteration. With fewer
    than six cables a rigid platform is in equilibrium there, stable or not. Poses that the cables cannot hold are left
    out.

    Raises ArgumentError for invalid lengths.
    """
    validate_robot("forward_kinematics_of_ropes: robot", robot)
    if robot.platform.is_rigid_body and robot.cable_count < FREEDOMS:
        return _poses_in_equilibrium(
            robot, lengths, *validated_pose("forward_kinematics", robot, position, orientation)
        )
    straight = forward_kinematics(robot, lengths, position, orientation)
    if not cables_have_weight(robot):
        return straight
    hanging = (_with_sag(robot, np.asarray(lengths, dtype=float), each) for each in straight)
    return tuple(each for each in hanging if each is not None)


def _with_sag(robot: Robot, lengths: Array, straight: ForwardSolution) -> ForwardSolution | None:
    solution = straight
    for _ in range(MAX_SAG_ITERATIONS):
        at, quaternion = np.array(solution.position), solution.orientation
        try:
            arcs = rope_lengths(robot, at, quaternion, tensions_at(robot, at, quaternion))
        except UnreachableError:
            return None
        excess = arcs - inverse_kinematics(robot, at, quaternion)
        found = forward_kinematics(robot, lengths - excess, at, quaternion, starts=0)
        if not found:
            return None
        previous, solution = solution, found[0]
        moved = np.linalg.norm(np.subtract(solution.position, previous.position))
        if moved <= SAG_TOLERANCE * float(np.max(lengths)):
            return solution
    return None


def _poses_in_equilibrium(
    robot: Robot, lengths: Sequence[float] | Array, position: Array, orientation: Quaternion
) -> tuple[ForwardSolution, ...]:
    """Poses near a guess where so few cables of these lengths hold a rigid platform, by Newton-like least squares."""
    required = validate_array(
        "forward_kinematics_of_ropes: lengths", lengths, (robot.cable_count,), "one length a cable in m"
    )
    scale, generator = float(np.mean(required)), np.random.default_rng(0)
    solutions: list[ForwardSolution] = []
    for index in range(1 + DEFAULT_STARTS):
        offset = np.zeros(FREEDOMS) if index == 0 else generator.standard_normal(FREEDOMS)
        start = position + START_DISTANCE_RATIO * scale * offset[:3]
        solution = _pose_in_equilibrium(
            robot, required, start, turned_orientation(orientation, START_ANGLE * offset[3:])
        )
        if solution is not None and not any(is_same_pose(solution, other, scale) for other in solutions):
            solutions.append(solution)
    return tuple(sorted(solutions, key=lambda each: each.residual))


def _pose_in_equilibrium(
    robot: Robot, lengths: Array, start: Array, start_orientation: Quaternion
) -> ForwardSolution | None:
    """The pose that a search from a start leads to; None where it finds none, or a cable would have to push."""
    scale, count = float(np.mean(lengths)), len(lengths)
    load = max(float(np.linalg.norm(load_wrench(robot, start, start_orientation)[:3])), 1e-300)
    units = np.array([1.0] * 3 + [1.0 / platform_size(robot)] * 3) / load

    def pose_at(variables: Array) -> tuple[Array, Quaternion]:
        return start + scale * variables[:3], turned_orientation(start_orientation, variables[3:6])

    def residuals(variables: Array) -> Array:
        at, quaternion = pose_at(variables)
        tensions = load * variables[6:]
        try:
            missed = rope_lengths(robot, at, quaternion, tensions) - lengths
            wrench = structure_matrix_at(robot, at, quaternion) @ tensions
            return np.concatenate([missed / scale, units * (wrench - load_wrench(robot, at, quaternion, tensions))])
        except UnreachableError:
            return np.full(count + FREEDOMS, 1e3)

    guess = np.concatenate([np.zeros(FREEDOMS), np.full(count, 1.0 / count)])
    result = least_squares(residuals, guess, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=MAX_EVALUATIONS)
    missed, unbalanced = result.fun[:count], result.fun[count:]
    residual = scale * float(np.sqrt(np.mean(missed**2)))
    if residual > RESIDUAL_FLOOR * scale or np.linalg.norm(unbalanced) > BALANCE_TOLERANCE:
        return None
    if np.min(result.x[FREEDOMS:]) < -BALANCE_TOLERANCE:
        return None
    at, quaternion = pose_at(result.x)
    x, y, z = at.tolist()
    return ForwardSolution((x, y, z), quaternion, residual)
