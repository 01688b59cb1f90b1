"""What a path asks for: tensions that carry the platform along it, and the reference that a controller follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.point_mass import PointMassConstants, total_mass

from ..errors import UnreachableError
from ..robots.robot import Robot
from ..statics.equilibrium import held_by, platform_effects, static_tensions
from ..trajectory import Trajectory, cable_directions, ideal_winch_speeds

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """What a controller follows, at each of N samples: winch speeds (N, n) in m/s, and what sensors shall show.

    ``rigid`` (N, n) are the speeds for inelastic cables; ``expected`` (N, 3 + n): position in m, tensions in N.
    ``at_rest`` (n,) are the tensions that sensors show before the start, in N.
    """

    speeds: Array
    rigid: Array
    expected: Array
    at_rest: Array


def path_tensions(robot: Robot, trajectory: Trajectory, times: Array) -> Array:
    """Tensions that carry the platform along a path, shape (N, n), in N.

    ``T = T_0 + U^+ (w + m a - U T_0)``, ``w`` the load at rest: of all that move it, those nearest to the start's.

    Raises UnreachableError where a cable would have to push.
    """
    start = static_tensions(robot)
    positions = trajectory.position(times)
    unit = cable_directions(robot, positions)
    declared = PointMassConstants(robot.platform.mass, robot.gravity)
    mass = total_mass(REAL, declared, platform_effects(robot))
    held = np.array([held_by(robot, position, start) for position in positions.tolist()])
    load = mass * trajectory.acceleration(times) + held
    change = np.linalg.pinv(unit) @ (load - unit @ start)[:, :, None]
    tensions: Array = start + change[:, :, 0]
    if np.min(tensions) < 0.0:
        moment, cable = np.unravel_index(np.argmin(tensions), tensions.shape)
        raise UnreachableError(
            robot.name,
            position=tuple(positions[moment]),
            cable=int(cable) + 1,
            tension=float(tensions[moment, cable]),
            mend=f"choose a slower path, or one that the cables can hold (it fails at {times[moment]:g} s)",
        )
    return tensions


def rigid_reference(robot: Robot, trajectory: Trajectory, times: Array) -> Reference:
    """Winch speeds that reel inelastic cables along a path, and the tensions that carry the platform there.

    Raises UnreachableError where a cable would have to push.
    """
    speeds = ideal_winch_speeds(robot, trajectory, times)
    expected = np.hstack([trajectory.position(times), path_tensions(robot, trajectory, times)])
    return Reference(speeds, speeds, expected, path_tensions(robot, trajectory, times[:1] - 1.0)[0])
