"""Robots at rest at a pose: lengths with sag, tensions by rule, and back to the pose."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.robot.kinematics import inverse_kinematics, structure_matrix
from tautwire.robot.pose_stiffness import stiffness_matrix
from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.static_pose import static_pose
from tautwire.robot.workspace import wrench_margin
from tests.support.rigid_robots import crane_robot, suspended_robot
from tests.support.robots import example

POSITION, TILTED = (0.5, -0.4, 1.8), (float(np.cos(0.05)), 0.0, float(np.sin(0.05)), 0.0)


def heavy(robot: Robot, linear_density: float = 0.4) -> Robot:
    values = {"linear_density": linear_density, "catenary": 0.0}
    return robot.with_effect(EffectSetting("sag", values, robot.cable_numbers))


def test_it_holds_what_the_functions_of_each_give() -> None:
    robot = crane_robot()
    held = static_pose(robot, POSITION, TILTED)
    assert held.lengths == pytest.approx(inverse_kinematics(robot, POSITION, TILTED), rel=1e-14)
    assert held.tensions == pytest.approx(static_equilibrium(robot, POSITION, orientation=TILTED).tensions)
    assert held.stiffness == pytest.approx(stiffness_matrix(robot, held.tensions, POSITION, TILTED))
    assert held.structure_matrix == pytest.approx(structure_matrix(robot, POSITION, TILTED))
    assert static_pose(robot, POSITION).wrench_margin == pytest.approx(wrench_margin(robot, np.array(POSITION)))


def test_a_point_mass_takes_tensions_by_rule() -> None:
    robot = example("eight")
    position = np.array([7.0, 5.0, 4.5])
    least = static_pose(robot, position, rule="least_norm").tensions
    nearest = static_pose(robot, position).tensions
    assert np.linalg.norm(least) < np.linalg.norm(nearest)
    matrix = structure_matrix(robot, position)
    assert matrix @ least == pytest.approx(matrix @ nearest, abs=1e-6)
    assert robot.tension is not None
    assert np.min(least) >= robot.tension.minimum - 1e-9


def test_sagging_ropes_are_longer_by_the_arc_of_a_parabola() -> None:
    robot = heavy(crane_robot())
    held = static_pose(robot, POSITION)
    straight = inverse_kinematics(robot, POSITION)
    level = np.hypot(*held.structure_matrix[:2])
    ratio = 0.4 * robot.gravity * straight / (2.0 * held.tensions)
    assert held.lengths == pytest.approx(straight * (1.0 + level**2 * ratio**2 / 6.0), rel=1e-9)
    assert np.min(held.lengths - straight) > 1e-4


def test_four_cables_hang_in_equilibrium_and_have_no_margin() -> None:
    held = static_pose(suspended_robot(4), (0.4, 0.2, 1.4))
    assert held.wrench_margin is None
    assert held.orientation == pytest.approx(static_equilibrium(suspended_robot(4), (0.4, 0.2, 1.4)).orientation)
    assert np.linalg.norm(np.array(held.orientation) - (1.0, 0.0, 0.0, 0.0)) > 1e-4
