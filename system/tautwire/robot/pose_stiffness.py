"""Stiffness of a pose: how the wrench on the platform answers a small displacement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws.mathematics import COMPLEX_STEP, REAL, rate_of, with_rate
from tautwire_fmu.laws.rotation import multiply, quaternion_of, rotate
from tautwire_fmu.laws.vectors import add, cross, scale, subtract

from ..array_validation import validate_array
from .active_effects import centre_of_mass
from .cable_routes import attachment_points
from .kinematics import validated_pose
from .robot_assembly import CableComponent, cable_components
from .schema import Quaternion, Robot
from .static_equilibrium import tensions_at
from .static_load import static_load

Array = NDArray[np.float64]


def stiffness_matrix(
    robot: Robot,
    tensions: Sequence[float] | Array | None = None,
    position: Sequence[float] | Array | None = None,
    orientation: Sequence[float] | None = None,
) -> Array:
    """Stiffness matrix K of a pose: ``dw = -K dx`` at fixed unstrained lengths, shape (6, 6); (3, 3) of a point mass.

    ``x`` is the displacement of the origin of the platform's frame (m) and the rotation vector (rad), ``w`` the wrench
    of cables, weight and effects (N, and N m about the origin), both in the world's axes. K contains the geometric
    stiffness by the ``tensions`` (n,) in N, by default those of static equilibrium at the position; the pose is by
    default the start. In equilibrium K is symmetric, but for forces of effects without potential.

    Raises UnreachableError where the cables cannot hold the platform, or one has no length; ArgumentError for an
    invalid argument.
    """
    array, quaternion = validated_pose("stiffness_matrix", robot, position, orientation)
    at: list[float] = array.tolist()
    if tensions is None:
        carried = tensions_at(robot, array, quaternion)
    else:
        expected = "one tension a cable in N"
        carried = validate_array("stiffness_matrix: tensions", tensions, (robot.cable_count,), expected)
    cables = cable_components(robot, carried.tolist(), REAL, at, quaternion)
    freedoms = 6 if robot.platform.is_rigid_body else 3
    columns = [_wrench_rate(robot, cables, at, quaternion, direction) for direction in np.eye(freedoms, 6).tolist()]
    return -np.array(columns)[:, :freedoms].T


def _wrench_rate(
    robot: Robot,
    cables: Sequence[CableComponent],
    position: Sequence[float],
    orientation: Quaternion,
    direction: Sequence[float],
) -> list[float]:
    """Rate of the wrench on the platform as it moves with a unit twist; by a complex step, so without truncation."""
    m = COMPLEX_STEP
    moved = [with_rate(value, rate) for value, rate in zip(position, direction[:3], strict=True)]
    rotation = quaternion_of(m, [with_rate(0.0, rate) for rate in direction[3:]])
    turned = multiply(rotation, orientation)
    load = static_load(m, robot, moved)
    force: Any = scale(-1.0, load)
    moment: Any = cross(rotate(turned, centre_of_mass(robot)), force)
    for component, point in zip(cables, attachment_points(robot, moved, turned), strict=True):
        cable_force = _cable_force(component, point)
        force = add(force, cable_force)
        moment = add(moment, cross(subtract(point, moved), cable_force))
    return [rate_of(complex(value)) for value in (*force, *moment)]


def _cable_force(component: CableComponent, point: Sequence[Any]) -> Any:
    """Force of a cable on the platform at rest with its attachment at a point (m), at its unstrained start length."""
    m, constants, effects = COMPLEX_STEP, component.constants, component.effects
    state = cable_law.start_state(constants, effects)
    line = cable_law.span(m, constants, cable_law.CableInputs(point, (0.0, 0.0, 0.0), 0.0), effects)
    motion = cable_law.cable_motion(m, constants, effects, state, line, 0.0)
    return cable_law.cable_outputs(m, constants, effects, state, motion).force
