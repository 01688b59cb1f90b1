"""From rope lengths back to poses where statics has a part."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.errors import ArgumentError
from tautwire.robot.forward_statics import forward_kinematics_of_ropes
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.static_pose import rope_lengths, static_pose
from tests.support.rigid_robots import crane_robot, suspended_robot, underactuated_robot

POSITION, TILTED = (0.5, -0.4, 1.8), (float(np.cos(0.05)), 0.0, float(np.sin(0.05)), 0.0)


def heavy(robot: Robot, linear_density: float = 0.4) -> Robot:
    values = {"linear_density": linear_density, "catenary": 0.0}
    return robot.with_effect(EffectSetting("sag", values, robot.cable_numbers))


@pytest.mark.parametrize("robot", (crane_robot(), heavy(crane_robot())), ids=("straight", "sagging"))
def test_lengths_lead_back_to_the_pose(robot: Robot) -> None:
    held = static_pose(robot, POSITION, TILTED)
    poses = forward_kinematics_of_ropes(robot, held.lengths, POSITION)
    nearest = min(poses, key=lambda pose: float(np.linalg.norm(np.subtract(pose.position, POSITION))))
    assert nearest.position == pytest.approx(POSITION, abs=1e-9)
    assert abs(np.dot(nearest.orientation, TILTED)) == pytest.approx(1.0, abs=1e-14)
    assert nearest.residual < 1e-9
    at, quaternion = np.array(nearest.position), nearest.orientation
    assert rope_lengths(robot, at, quaternion, held.tensions) == pytest.approx(held.lengths, abs=1e-9)


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize(
    "robot",
    (suspended_robot(3), suspended_robot(4), heavy(suspended_robot(4), 0.2), underactuated_robot()),
    ids=("three", "four", "four that sag", "four over pulleys"),
)
def test_few_cables_lead_back_to_the_pose_in_equilibrium(robot: Robot) -> None:
    start = np.array(robot.platform.start)
    held = static_pose(robot, start + np.array([0.1, -0.05, 0.06]))
    poses = forward_kinematics_of_ropes(robot, held.lengths, start)
    distances = [float(np.linalg.norm(np.subtract(pose.position, held.position))) for pose in poses]
    nearest = poses[int(np.argmin(distances))]
    assert min(distances) < 1e-6
    assert abs(np.dot(nearest.orientation, held.orientation)) == pytest.approx(1.0, abs=1e-9)
    assert all(pose.residual < 1e-8 for pose in poses)


@pytest.mark.validate
def test_lengths_that_no_equilibrium_has_lead_nowhere() -> None:
    assert forward_kinematics_of_ropes(suspended_robot(4), (1.0, 9.0, 1.0, 9.0)) == ()
    with pytest.raises(ArgumentError, match="one length a cable"):
        forward_kinematics_of_ropes(suspended_robot(4), (1.0, 9.0))
