"""Stiffness of a pose, against differences of the wrench and the textbook's sum."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from tautwire.robot.kinematics import inverse_kinematics, length_jacobian
from tautwire.robot.pose_stiffness import stiffness_matrix
from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.rigid_robots import crane_robot, suspended_robot, underactuated_robot
from tests.support.robots import example

PULLEYS = EffectSetting("pulley", {"radius": 0.06}, tuple(range(1, 9)))


def wrench(robot: Robot, lengths: np.ndarray, tensions: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Wrench of logarithmic cables and weight about the displaced origin, by the product's kinematics only."""
    turn = Rotation.from_rotvec(displacement[3:])
    x, y, z, w = turn.as_quat().tolist()
    position = np.array(robot.platform.start) + displacement[:3]
    moved = inverse_kinematics(robot, position, (w, x, y, z))
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    weight = np.array([0.0, 0.0, -robot.platform.mass * robot.gravity])
    moment = np.cross(turn.apply(robot.platform.centre_of_mass), weight)
    forces = -length_jacobian(robot, position, (w, x, y, z)).T @ (tensions + stiffness * np.log(moved / lengths))
    return forces + np.concatenate([weight, moment])


@pytest.mark.parametrize(
    "robot", (crane_robot(), crane_robot().with_effect(PULLEYS), suspended_robot(4)), ids=("crane", "pulleys", "four")
)
def test_it_is_the_derivative_of_the_wrench_at_fixed_unstrained_lengths(robot: Robot) -> None:
    tensions, lengths, step = static_equilibrium(robot).tensions, inverse_kinematics(robot), 1e-6
    assert np.allclose(wrench(robot, lengths, tensions, np.zeros(6)), 0.0, atol=1e-6)
    differences = np.array(
        [
            (wrench(robot, lengths, tensions, -each) - wrench(robot, lengths, tensions, each)) / (2.0 * step)
            for each in step * np.eye(6)
        ]
    ).T
    stiffness = stiffness_matrix(robot)
    assert np.allclose(stiffness, differences, rtol=1e-7, atol=1e-7 * np.max(np.abs(differences)))
    assert np.allclose(stiffness, stiffness.T, rtol=0.0, atol=1e-9 * np.max(np.abs(stiffness)))
    assert np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[0] > 0.0


def test_of_a_point_mass_it_is_the_sum_over_its_cables() -> None:
    robot = example("three")
    start, expected = np.array(robot.platform.start), np.zeros((3, 3))
    tensions = np.array([700.0, 900.0, 500.0])
    for cable, tension in zip(robot.cables, tensions, strict=True):
        line = np.array(cable.anchor) - start
        length = np.linalg.norm(line)
        along = np.outer(line, line) / length**2
        expected += (cable.modulus * cable.area * along + tension * (np.eye(3) - along)) / length
    assert np.allclose(stiffness_matrix(robot, tensions), expected, rtol=1e-12, atol=1e-9 * np.max(expected))


def test_tensions_count() -> None:
    robot = crane_robot()
    tensions = static_equilibrium(robot).tensions
    assert not np.allclose(stiffness_matrix(robot, tensions), stiffness_matrix(robot, 2.0 * tensions), rtol=1e-3)


def test_free_modes_of_a_real_robot_are_those_of_an_independent_program_on_its_published_geometry() -> None:
    robot = underactuated_robot()
    equilibrium = static_equilibrium(robot)
    assert equilibrium.moved_by < 1e-4
    # Taut lengths that its authors computed for this pose, and the modes of the free swing.
    lengths = [1.8693393672175875, 1.3900569185478946, 1.9408457217799175, 2.2697372719215845]
    frequencies = [0.823150845872805, 1.1938873382695399]
    assert inverse_kinematics(robot) == pytest.approx(lengths, abs=2e-4)
    platform, (w, x, y, z) = robot.platform, equilibrium.orientation
    turn = Rotation.from_quat((x, y, z, w)).as_matrix()
    arm = turn @ np.array(platform.centre_of_mass)
    cross = np.cross(np.eye(3), arm)
    mass = platform.mass * np.block([[np.eye(3), cross.T], [cross, cross.T @ cross]])
    mass[3:, 3:] += turn @ np.array(platform.inertia) @ turn.T
    stiffness = stiffness_matrix(robot, equilibrium.tensions, None, equilibrium.orientation)
    squares = eigh(0.5 * (stiffness + stiffness.T), mass, eigvals_only=True)
    assert np.sqrt(squares[:2]) / (2.0 * np.pi) == pytest.approx(frequencies, rel=2e-4)


def test_tensions_are_those_of_the_orientation() -> None:
    """In equilibrium it is symmetric about the centre of mass, at any pose."""
    robot = crane_robot()
    turned = tuple(np.roll(Rotation.from_rotvec([0.02, -0.05, 0.1]).as_quat(), 1).tolist())
    at_pose = static_equilibrium(robot, orientation=turned)
    expected = stiffness_matrix(robot, at_pose.tensions, orientation=turned)
    assert stiffness_matrix(robot, orientation=turned) == pytest.approx(expected, rel=1e-9, abs=1e-6)
    assert expected != pytest.approx(stiffness_matrix(robot, static_equilibrium(robot).tensions, orientation=turned))
