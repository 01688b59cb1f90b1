"""A robot at rest at a pose: rope lengths with sag, tensions, stiffness, and the margin of the wrench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws.mathematics import REAL

from .cable_routes import attachment_points
from .kinematics import structure_matrix_at, validated_pose
from .pose_stiffness import stiffness_matrix
from .rigid_equilibrium import static_equilibrium
from .robot_assembly import cable_components
from .schema import Point, Quaternion, Robot
from .static_equilibrium import tensions_at
from .workspace_criteria import RequiredMotion, degrees_of_freedom, wrench_feasible_margin

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StaticPose:
    """A robot at rest, with its platform at a ``position`` in m and ``orientation``.

    ``lengths`` (n,) are those of the taut or hanging ropes, with what lies on pulleys; ``tensions`` (n,) in N. The
    ``structure_matrix`` (d, n) is that of :func:`tautwire.robot.kinematics.structure_matrix`, ``stiffness`` (d, d) that
    of :func:`tautwire.robot.pose_stiffness.stiffness_matrix`. ``wrench_margin`` in N as in
    :class:`tautwire.robot.workspace.Workspace`; None with fewer cables than degrees of freedom.
    """

    position: Point
    orientation: Quaternion
    lengths: Array
    tensions: Array
    structure_matrix: Array
    stiffness: Array
    wrench_margin: float | None


def static_pose(
    robot: Robot,
    position: Sequence[float] | Array | None = None,
    orientation: Sequence[float] | None = None,
    rule: str = "nearest",
) -> StaticPose:
    """Inverse kinematics and statics of a robot at rest at a pose, by default its start as declared.

    Tensions that are not unique are distributed by a ``rule`` of
    :data:`tautwire.robot.tension_distribution.RULES`. With fewer than six cables a rigid platform takes the equilibrium
    orientation nearest to ``orientation``.

    Raises UnreachableError where the cables cannot hold the platform there, ArgumentError for an invalid argument.
    """
    at, quaternion = validated_pose("static_pose", robot, position, orientation)
    if robot.platform.is_rigid_body and robot.cable_count < degrees_of_freedom(robot):
        quaternion = static_equilibrium(robot, at, rule, quaternion).orientation
    tensions = tensions_at(robot, at, quaternion, rule)
    has_margin = robot.cable_count >= degrees_of_freedom(robot)
    x, y, z = at.tolist()
    return StaticPose(
        position=(x, y, z),
        orientation=quaternion,
        lengths=rope_lengths(robot, at, quaternion, tensions),
        tensions=tensions,
        structure_matrix=structure_matrix_at(robot, at, quaternion),
        stiffness=stiffness_matrix(robot, tensions, at, quaternion if robot.platform.is_rigid_body else None),
        wrench_margin=wrench_feasible_margin(robot, at, quaternion, RequiredMotion()) if has_margin else None,
    )


def rope_lengths(robot: Robot, position: Array, orientation: Quaternion, tensions: Array) -> Array:
    """Inverse kinematics of ropes under tensions (n,) in N: arc lengths with sag and pulleys, shape (n,), in m.

    Without the effect ``sag`` they are those of :func:`tautwire.robot.kinematics.inverse_kinematics`.

    Raises UnreachableError where a cable has no length.
    """
    components = cable_components(robot, tensions.tolist(), REAL, position.tolist(), orientation)
    points = attachment_points(robot, position.tolist(), orientation)
    lengths = []
    for component, point in zip(components, points, strict=True):
        constants, effects = component.constants, component.effects
        state = cable_law.start_state(constants, effects)
        span = cable_law.span(REAL, constants, cable_law.CableInputs(point, (0.0, 0.0, 0.0), 0.0), effects)
        lengths.append(float(cable_law.cable_motion(REAL, constants, effects, state, span, 0.0).arc))
    return np.array(lengths)
