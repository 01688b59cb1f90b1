"""Inverse dynamics along a path: the wrench that moves the platform, and the tensions that exert it.

    w = A T_m + M (dt/dt - a_m)                w by the cables' tensions, about the origin of the platform's frame
    T = T_p + (S A)^+ (S w - S A T_p)          S divides moments by the size of the platform

``dt/dt`` is the acceleration of the path, a_m that of the model under tensions T_m at the same pose and twist, M its
mass matrix: so the equations of motion are those of the laws, with every effect. Fewer cables than degrees of freedom
exert the wrench that is nearest in the least-squares sense.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from ..errors import ArgumentError, UnreachableError
from ..name_suggestions import suggest_name
from ..robot.pose_path import PoseSamples, pose_path, sample_poses
from ..robot.pose_trajectory import rotation_vectors_between
from ..robot.rigid_equilibrium import platform_size
from ..robot.schema import Robot, TensionLimits
from ..robot.static_equilibrium import static_tensions
from ..robot.symbolic_model import SymbolicModel, symbolic_model
from ..robot.tension_distribution import DEFAULT_LIMITS, RULES, distribute_by_rule, distribute_tensions
from ..robot.trajectory import Trajectory
from ..robot.winch_speeds import structure_matrices, winch_speeds_at

Array = NDArray[np.float64]

START_RULE = "start"
PATH_RULES = (START_RULE, *RULES)
# Singular values of the structure matrix below this share of the largest are zero.
RANK_TOLERANCE = 1e-9
# A cable pushes where its tension is below this share of the largest.
PUSH_TOLERANCE = 1e-9


@dataclass(frozen=True)
class PathLaws:
    """The laws as a function of states and inputs: rates, outputs and span tensions of a ``model``."""

    model: SymbolicModel
    laws: casadi.Function

    @classmethod
    def of(cls, robot: Robot) -> PathLaws:
        """Those of a robot."""
        model = symbolic_model(robot)
        results = [model.rates, model.outputs, model.span_tensions]
        return cls(model, casadi.Function("laws", [model.states, model.inputs], results))

    def pose_states(self, poses: PoseSamples) -> Array:
        """Poses as states of the model (N, d): of a rigid body a rotation vector follows the position."""
        if self.model.indices.degrees_of_freedom == 3:
            return poses.position
        reference = np.array(self.model.reference_orientation, dtype=float)
        return np.hstack([poses.position, rotation_vectors_between(poses.orientation, reference)])


@dataclass(frozen=True)
class PathDynamics:
    """Dynamics at N poses with r independent wrenches: what the cables have to exert, and can.

    ``tensions`` (N, n) in N; ``motion_rows`` (N, r, d) times an error of acceleration is what tensions can correct of
    it; ``null_rows`` (N, n - r, n) are orthonormal self-stresses.
    """

    tensions: Array
    motion_rows: Array
    null_rows: Array


def path_tensions(robot: Robot, trajectory: Trajectory, times: Array, rule: str = START_RULE) -> Array:
    """Inverse dynamics: tensions that carry the platform along a path, shape (N, n), in N.

    Tensions that are not unique are distributed by a ``rule``: ``start``, those nearest to the start's, or one of
    :data:`tautwire.robot.tension_distribution.RULES`; within the limits of the robot file, if it has any.

    Raises UnreachableError where a cable would have to push or no tensions are within the limits, ArgumentError for
    another rule.
    """
    poses = sample_poses("path_tensions", robot, pose_path(robot, trajectory), times)
    return path_dynamics(robot, PathLaws.of(robot), poses, times, rule).tensions


def path_dynamics(robot: Robot, laws: PathLaws, poses: PoseSamples, times: Array, rule: str) -> PathDynamics:
    """Tensions along a path, and what they can do there; see :func:`path_tensions`."""
    if rule not in PATH_RULES:
        raise ArgumentError("path_tensions: rule", rule, f"is {rule!r}", f"write {suggest_name(rule, PATH_RULES)}")
    start = static_tensions(robot)
    matrices = structure_matrices(robot, poses)
    wrenches, masses = _required_wrenches(robot, laws, poses, matrices)
    scales = np.ones(matrices.shape[1])
    if robot.platform.is_rigid_body:
        scales[3:] /= platform_size(robot)
    left_vectors, singular_values, right_vectors = np.linalg.svd(scales[:, None] * matrices)
    rank = int(np.sum(singular_values[0] > RANK_TOLERANCE * singular_values[0, 0]))
    spanned = np.swapaxes(left_vectors[:, :, :rank], 1, 2) * scales
    tensions = np.zeros((len(times), robot.cable_count))
    for index, (rows, matrix, wrench) in enumerate(zip(spanned, matrices, wrenches, strict=True)):
        distributed = _distributed(robot, rows @ matrix, rows @ wrench, start, rule)
        tensions[index] = _checked(robot, distributed, poses.position[index], float(times[index]))
    return PathDynamics(tensions, spanned @ masses / robot.platform.mass, right_vectors[:, rank:])


def _required_wrenches(robot: Robot, laws: PathLaws, poses: PoseSamples, matrices: Array) -> tuple[Array, Array]:
    """The wrenches (N, d) of the tensions along the cables, and the mass matrices (N, d, d)."""
    model, count, d = laws.model, robot.cable_count, laws.model.indices.degrees_of_freedom
    pose, twist, speeds = (SX.sym(name, size) for name, size in (("x", d), ("v", d), ("s", count)))
    start = SX(casadi.evalf(model.start[2 * d :]))
    inputs, wrench = casadi.vertcat(speeds, SX(d, 1)), SX.sym("wrench", d)
    # Ropes as long as their spans carry the start tensions, so that no large numbers cancel.
    lengths = laws.laws(casadi.vertcat(pose, twist, start), inputs)[1][-count:]
    state = casadi.vertcat(pose, twist, lengths, start[count:])
    rates, _, tensions = laws.laws(state, casadi.vertcat(speeds, wrench))
    acceleration = rates[d : 2 * d]
    inverse_mass = casadi.jacobian(acceleration, wrench)
    no_wrench = [casadi.substitute(each, wrench, SX.zeros(d)) for each in (acceleration, inverse_mass, tensions)]
    evaluate = casadi.Function("dynamics", [pose, twist, speeds], no_wrench)
    columns = evaluate.map(len(poses.position))(
        laws.pose_states(poses).T, poses.twist.T, winch_speeds_at(robot, poses).T
    )
    accelerations, inverse_masses, model_tensions = (np.asarray(each, dtype=float).T for each in columns)
    # Matrices are stored side by side, so that each is transposed; mass matrices are symmetric.
    masses = np.linalg.inv(inverse_masses.reshape(-1, d, d))
    inertial = np.einsum("kij,kj->ki", masses, poses.acceleration - accelerations)
    return np.einsum("kin,kn->ki", matrices, model_tensions) + inertial, masses


def _distributed(robot: Robot, matrix: Array, wrench: Array, start: Array, rule: str) -> Array | None:
    """Tensions that exert a wrench in r coordinates, by the rule; None where the limits allow none."""
    is_redundant = len(matrix) < robot.cable_count and np.linalg.matrix_rank(matrix, RANK_TOLERANCE) == len(matrix)
    if rule != START_RULE and is_redundant:
        return distribute_by_rule(matrix, wrench, robot.tension or DEFAULT_LIMITS, rule)
    tensions: Array = start + np.linalg.pinv(matrix, RANK_TOLERANCE) @ (wrench - matrix @ start)
    if robot.tension is None or not is_redundant or _is_within(tensions, robot.tension):
        return tensions
    return distribute_tensions(matrix, wrench, robot.tension, start)


def _is_within(tensions: Array, limits: TensionLimits) -> bool:
    return bool(np.min(tensions) >= limits.minimum and np.max(tensions) <= limits.maximum)


def _checked(robot: Robot, tensions: Array | None, position: Array, time: float) -> Array:
    """The tensions, none of which pushes; raises UnreachableError."""
    hint = f"choose a slower path, or one that the cables can hold (it fails at {time:g} s)"
    at = tuple(position.tolist())
    if tensions is None:
        limits = robot.tension or DEFAULT_LIMITS
        reason = f"no tensions between {limits.minimum:g} and {limits.maximum:g} N carry the platform along the path"
        raise UnreachableError(robot.name, at, None, None, reason, hint)
    cable = int(np.argmin(tensions))
    if tensions[cable] < -PUSH_TOLERANCE * float(np.max(np.abs(tensions))):
        raise UnreachableError(robot.name, at, cable + 1, float(tensions[cable]), hint=hint)
    return tensions
