"""Feedforward of platforms that turn, against the textbook equations of motion and against point masses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.control import Reference, elastic_reference, path_tensions, rigid_reference, sample_times
from tautwire.errors import ArgumentError, UnreachableError
from tautwire.robot.pose_trajectory import PoseTrajectory, slerp
from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import EffectSetting, Robot, TensionLimits
from tautwire.robot.trajectory import Line
from tests.support.rigid_motion import integrated, rotation_matrices
from tests.support.rigid_robots import crane_robot, octahedral_robot, suspended_robot
from tests.support.robots import example

Array = NDArray[np.float64]

HALF = 0.08
TURN = slerp((1.0, 0.0, 0.0, 0.0), (np.cos(HALF), 0.48 * np.sin(HALF), 0.64 * np.sin(HALF), 0.6 * np.sin(HALF)), 2.0)
ROBOTS = (crane_robot(), octahedral_robot())
TIMES = sample_times(0.01, 2.2)


def path_of(robot: Robot, duration: float = 2.0) -> PoseTrajectory:
    x, y, z = robot.platform.start
    line = Line((x, y, z), (x + 0.15, y - 0.1, z + 0.12), duration)
    return PoseTrajectory(line, slerp(TURN.start, tuple(TURN.orientation(np.array([2.0]))[0]), duration))


def errors(robot: Robot, reference: Reference) -> tuple[float, float]:
    """Largest distance (m) and angle (rad) from the path of ropes that are reeled so, by integration."""
    equilibrium = static_equilibrium(robot)
    start = np.array(equilibrium.orientation), equilibrium.tensions
    motion = integrated(robot, start, TIMES, reference.speeds)
    expected = rotation_matrices(reference.expected[:, 3:7])
    angles = Rotation.from_matrix(motion.rotation @ np.swapaxes(expected, 1, 2)).magnitude()
    distances = np.linalg.norm(motion.position - reference.expected[:, :3], axis=1)
    return float(np.max(distances)), float(np.max(angles))


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_tensions_balance_newtons_and_eulers_equations_along_a_turning_path(robot: Robot) -> None:
    path, platform, times = path_of(robot), robot.platform, np.linspace(0.0, 2.0, 11)
    tensions = path_tensions(robot, path, times)
    rotation = rotation_matrices(path.orientation(times))
    arms = rotation @ np.array(robot.attachments).T
    spans = np.array(robot.anchors).T - path.position(times)[:, :, None] - arms
    pulls = spans / np.linalg.norm(spans, axis=1, keepdims=True) * tensions[:, None]
    centre = rotation @ np.array(platform.centre_of_mass)
    omega, alpha = path.angular_velocity(times), path.angular_acceleration(times)
    of_centre = path.acceleration(times) + np.cross(alpha, centre) + np.cross(omega, np.cross(omega, centre))
    force = platform.mass * (of_centre + np.array([0.0, 0.0, robot.gravity]))
    assert pulls.sum(axis=2) == pytest.approx(force, abs=1e-7)
    moment = np.cross(arms - centre[:, :, None], pulls, axis=1).sum(axis=2)
    inertia = rotation @ np.array(platform.inertia) @ np.swapaxes(rotation, 1, 2)
    spin = np.einsum("kij,kj->ki", inertia, omega)
    assert moment == pytest.approx(np.einsum("kij,kj->ki", inertia, alpha) + np.cross(omega, spin), abs=1e-7)


@pytest.mark.validate
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_elastic_reference_moves_the_independent_robot_along_the_path(robot: Robot) -> None:
    path = path_of(robot)
    rigid, elastic = (errors(robot, f(robot, path, TIMES)) for f in (rigid_reference, elastic_reference))
    assert elastic[0] < 1e-5 and elastic[1] < 1e-5
    assert elastic[0] < 0.1 * rigid[0] and elastic[1] < 0.1 * rigid[1]


def test_sensors_are_expected_to_show_pose_and_tensions_of_the_path() -> None:
    robot = crane_robot()
    path = path_of(robot)
    elastic, rigid = (f(robot, path, TIMES) for f in (elastic_reference, rigid_reference))
    assert elastic.expected.shape == (len(TIMES), 7 + 8)
    assert elastic.expected == pytest.approx(rigid.expected, abs=1e-6)
    assert elastic.expected[:, 3:7] == pytest.approx(path.orientation(TIMES))
    assert elastic.at_rest == pytest.approx(static_equilibrium(robot).tensions)


def test_attachments_at_the_origin_are_a_point_mass() -> None:
    point = replace(example("eight"), effects=(EffectSetting("damping", {"damping": 1e8}, (1, 2)),))
    inertia = ((4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 6.0))
    rigid = replace(point, platform=replace(point.platform, inertia=inertia))
    line = Line((5.0, 4.0, 2.5), (5.7, 4.4, 2.9), 2.0)
    of_point, of_body = (elastic_reference(robot, line, TIMES) for robot in (point, rigid))
    assert of_body.speeds == pytest.approx(of_point.speeds, abs=1e-9)
    assert np.delete(of_body.expected, range(3, 7), axis=1) == pytest.approx(of_point.expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("rule", ("start", "nearest", "least_norm", "barycentre", "closed_form"))
def test_tensions_stay_within_the_bounds_by_every_rule(rule: str) -> None:
    robot = replace(crane_robot(), tension=TensionLimits(280.0, 358.0, 320.0))
    times = np.linspace(0.0, 2.0, 11)
    free = path_tensions(replace(robot, tension=crane_robot().tension), path_of(robot), times)
    assert np.min(free) < 280.0 and np.max(free) > 358.0
    bounded = path_tensions(robot, path_of(robot), times, rule)
    assert np.min(bounded) >= 280.0 - 1e-4 and np.max(bounded) <= 358.0 + 1e-4
    weights = [path_tensions(robot, path_of(robot), times, each) for each in ("least_norm", rule)]
    assert np.all(np.linalg.norm(weights[1], axis=1) >= np.linalg.norm(weights[0], axis=1) - 1e-4)


def test_elastic_ropes_follow_a_named_rule() -> None:
    robot, times = crane_robot(), TIMES[:60]
    expected = path_tensions(robot, path_of(robot), times, "least_norm")
    reference = elastic_reference(robot, path_of(robot), times, "least_norm")
    assert reference.expected[:, 7:] == pytest.approx(expected, abs=0.05)


def test_what_no_tensions_within_the_bounds_carry_is_refused() -> None:
    robot = replace(crane_robot(), tension=TensionLimits(200.0, 340.0, 270.0))
    times = np.linspace(0.0, 2.0, 11)
    with pytest.raises(UnreachableError, match=r"no tensions between 200 and 340 N carry .*it fails at 0.2 s"):
        path_tensions(robot, path_of(robot), times)
    with pytest.raises(ArgumentError, match="least_norm"):
        path_tensions(robot, path_of(robot), times, "last_norm")


@pytest.mark.validate
def test_fewer_than_six_cables_are_moved_through_equilibria() -> None:
    robot = suspended_robot(3)
    x, y, z = robot.platform.start
    line = Line((x, y, z), (x + 0.1, y, z + 0.05), 2.0)
    reference = elastic_reference(robot, line, TIMES)
    at_end = static_equilibrium(robot, line.end)
    assert reference.expected[-1, 3:7] == pytest.approx(np.array(at_end.orientation), abs=1e-8)
    assert reference.expected[-1, 7:] == pytest.approx(at_end.tensions, abs=1e-6)
    # It swings on its free modes: an independent integration is near the path, not on it.
    distance, angle = errors(robot, reference)
    assert 1e-5 < distance < 5e-3 and 1e-4 < angle < 3e-2
