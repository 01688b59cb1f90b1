"""Inverse dynamics along a path: tensions, and the reference that a controller follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, total_mass

from ..errors import UnreachableError
from ..robots.robot import Robot
from ..statics.equilibrium import load_on_tensions, platform_effects, static_tensions
from ..trajectory import Trajectory, cable_directions, ideal_winch_speeds

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """Reference of a controller at each of N samples: winch speeds (N, n) in m/s, and expected measurements.

    ``rigid`` (N, n) are the speeds for inelastic cables; ``expected`` (N, 3 + n): position in m, tensions in N.
    ``at_rest`` (n,) are the expected tensions before the start, in N.
    """

    speeds: Array
    rigid: Array
    expected: Array
    at_rest: Array


def path_tensions(robot: Robot, trajectory: Trajectory, times: Array) -> Array:
    """Inverse dynamics: tensions that carry the platform along a path, shape (N, n), in N.

    ``T = T_0 + U^+ (w + m a - U T_0)``, ``w`` the static load: of all that move it, those nearest to the start's.

    Raises UnreachableError where a cable would have to push.
    """
    start = static_tensions(robot)
    positions = trajectory.position(times)
    direction_matrix = cable_directions(robot, positions)
    constants = PointMassConstants(robot.platform.mass, robot.gravity)
    mass = total_mass(REAL, constants, platform_effects(robot))
    static_loads = np.array([load_on_tensions(robot, position, start) for position in positions.tolist()])
    load = mass * trajectory.acceleration(times) + static_loads
    change = np.linalg.pinv(direction_matrix) @ (load - direction_matrix @ start)[:, :, None]
    tensions: Array = start + change[:, :, 0]
    if np.min(tensions) < 0.0:
        sample, cable = np.unravel_index(np.argmin(tensions), tensions.shape)
        raise UnreachableError(
            robot.name,
            position=tuple(positions[sample]),
            cable=int(cable) + 1,
            tension=float(tensions[sample, cable]),
            hint=f"choose a slower path, or one that the cables can hold (it fails at {times[sample]:g} s)",
        )
    return tensions


def rigid_reference(robot: Robot, trajectory: Trajectory, times: Array) -> Reference:
    """Rigid reference: winch speeds of inelastic cables along a path, and the tensions that carry the platform there.

    Raises UnreachableError where a cable would have to push.
    """
    speeds = ideal_winch_speeds(robot, trajectory, times)
    expected = np.hstack([trajectory.position(times), path_tensions(robot, trajectory, times)])
    return Reference(speeds, speeds, expected, path_tensions(robot, trajectory, times[:1] - 1.0)[0])
