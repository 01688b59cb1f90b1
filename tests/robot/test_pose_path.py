"""The poses of a robot along a path, and the winch speeds that take inelastic cables through them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.errors import ArgumentError, UnreachableError
from tautwire.robot.kinematics import inverse_kinematics
from tautwire.robot.pose_path import pose_path, sample_poses
from tautwire.robot.pose_trajectory import PoseTrajectory, slerp
from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import EffectSetting, Robot, TensionLimits
from tautwire.robot.trajectory import Helix, Line, Trajectory
from tautwire.robot.winch_speeds import ideal_winch_speeds
from tests.support.rigid_robots import crane_robot, octahedral_robot, suspended_robot
from tests.support.robots import example

TIMES = np.linspace(0.2, 1.8, 9)
TURN = slerp((1.0, 0.0, 0.0, 0.0), (np.cos(0.1), 0.0, 0.6 * np.sin(0.1), 0.8 * np.sin(0.1)), 2.0)


def line(robot: Robot) -> Line:
    x, y, z = robot.platform.start
    return Line((x, y, z), (x + 0.1, y - 0.15, z + 0.2), 2.0)


def length_rates(robot: Robot, path: Trajectory) -> np.ndarray:
    """Of the inverse kinematics, by central differences."""
    fine = 1e-5
    lengths = []
    for times in (TIMES + fine, TIMES - fine):
        poses = sample_poses("test", robot, pose_path(robot, path), times)
        quaternions = poses.orientation / np.linalg.norm(poses.orientation, axis=1, keepdims=True)
        pairs = zip(poses.position, quaternions.tolist(), strict=True)
        lengths.append([inverse_kinematics(robot, *pair) for pair in pairs])
    return (np.array(lengths[0]) - np.array(lengths[1])) / (2.0 * fine)


@pytest.mark.parametrize("pulleys", (False, True))
@pytest.mark.parametrize("robot", (crane_robot(), octahedral_robot()), ids=lambda robot: robot.name)
def test_winch_speeds_along_a_turning_path_are_the_rates_of_the_lengths(robot: Robot, pulleys: bool) -> None:
    if pulleys:
        robot = replace(robot, effects=(EffectSetting("pulley", {"radius": 0.05}, robot.cable_numbers),))
    path = PoseTrajectory(line(robot), TURN)
    assert ideal_winch_speeds(robot, path, TIMES) == pytest.approx(-length_rates(robot, path), abs=1e-8)


def test_a_path_without_orientation_keeps_that_of_the_start() -> None:
    robot = crane_robot()
    poses = sample_poses("test", robot, pose_path(robot, line(robot)), TIMES)
    assert np.array_equal(poses.orientation, np.tile(robot.platform.start_orientation, (9, 1)))
    assert not np.any(poses.twist[:, 3:]) and not np.any(poses.acceleration[:, 3:])
    assert np.array_equal(poses.twist[:, :3], line(robot).velocity(TIMES))


@pytest.mark.validate
def test_fewer_than_six_cables_pass_through_equilibria() -> None:
    robot = suspended_robot(3)
    path = pose_path(robot, line(robot))
    poses = sample_poses("test", robot, path, TIMES)
    for position, orientation in zip(poses.position, poses.orientation, strict=True):
        expected = np.array(static_equilibrium(robot, position).orientation)
        assert orientation == pytest.approx(expected, abs=1e-8)
    assert np.max(np.abs(poses.orientation[-1] - poses.orientation[0])) > 1e-2
    assert ideal_winch_speeds(robot, line(robot), TIMES) == pytest.approx(-length_rates(robot, line(robot)), abs=1e-8)
    ends = sample_poses("test", robot, path, np.array([0.0, 2.0]))
    assert not np.any(ends.twist) and not np.any(ends.acceleration)


@pytest.mark.validate
def test_a_path_away_from_the_middle_of_a_ring_passes_smoothly_over_a_jump_of_the_nearest_equilibrium() -> None:
    robot = replace(suspended_robot(4), tension=TensionLimits(10.0, 2000.0, 100.0))
    x, y, z = robot.platform.start
    path = Line((x, y, z), (x + 0.3, y + 0.2, z + 0.2), 2.0)
    near = [np.array([x, y, z]) + share * np.array([0.3, 0.2, 0.2]) for share in (0.005, 0.007)]
    tensions = [static_equilibrium(robot, position).tensions for position in near]
    assert np.max(np.abs(tensions[1] - tensions[0])) > 50.0
    times = np.linspace(0.0, 2.0, 2001)
    poses = sample_poses("test", robot, pose_path(robot, path), times)
    # It turns by 0.07 rad in 2 s: smoothly, as the line rises, by at most 5.8 / 4 of that.
    assert np.max(np.abs(poses.acceleration[:, 3:])) < 0.3
    for index in (0, 500, 1000, 2000):
        expected = np.array(static_equilibrium(robot, poses.position[index]).orientation)
        assert poses.orientation[index] == pytest.approx(expected, abs=5e-5)


@pytest.mark.validate
def test_a_path_of_many_turns_follows_the_equilibria_between_its_points() -> None:
    robot = suspended_robot(3)
    path = Helix((0.0, 0.0, 1.5), 0.3, 0.0, 40.0 * np.pi, 60.0)
    times = np.array([7.3, 21.9, 40.1])
    poses = sample_poses("test", robot, pose_path(robot, path), times)
    for position, orientation in zip(poses.position, poses.orientation, strict=True):
        expected = np.array(static_equilibrium(robot, position).orientation)
        assert orientation == pytest.approx(expected, abs=1e-6)


def test_a_turn_that_too_few_cables_cannot_hold_is_refused_with_the_nearest_one() -> None:
    robot = suspended_robot(3)
    path = PoseTrajectory(line(robot), slerp((1.0, 0.0, 0.0, 0.0), (np.cos(0.1), np.sin(0.1), 0.0, 0.0), 2.0))
    with pytest.raises(UnreachableError, match=r"the 3 cables leave a moment at the path's orientation at .* degrees"):
        pose_path(robot, path)


def test_the_orientation_in_equilibrium_may_be_asked_for() -> None:
    robot = suspended_robot(3)
    equilibria = pose_path(robot, line(robot))
    poses = [sample_poses("test", robot, pose_path(robot, path), TIMES) for path in (line(robot), equilibria)]
    assert poses[1].orientation == pytest.approx(poses[0].orientation, abs=1e-7)


def test_a_point_mass_does_not_turn() -> None:
    robot = example("eight")
    assert pose_path(robot, line(robot)) == line(robot)
    with pytest.raises(ArgumentError, match="turns the platform, which is a point mass"):
        ideal_winch_speeds(robot, PoseTrajectory(line(robot), TURN), TIMES)
