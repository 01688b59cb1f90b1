"""Kinematics of rigid platforms, against finite differences and rotations by SciPy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.errors import ArgumentError, InputError
from tautwire.linear import linearise
from tautwire.robot.cable_routes import unit_directions
from tautwire.robot.kinematics import forward_kinematics, inverse_kinematics, length_jacobian, structure_matrix
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.static_pose import static_pose
from tests.support.rigid_robots import crane_robot, octahedral_robot, suspended_robot
from tests.support.robots import example

POSITION = np.array([0.4, -0.3, 1.7])
TURN = np.array([0.2, -0.15, 0.4])
PULLEYS = EffectSetting("pulley", {"radius": 0.06}, tuple(range(1, 9)))


def quaternion(turn: np.ndarray) -> tuple[float, float, float, float]:
    """SciPy's quaternion of a rotation vector, scalar first."""
    x, y, z, w = Rotation.from_rotvec(turn).as_quat().tolist()
    return (w, x, y, z)


def test_lengths_are_the_distances_from_turned_attachments_to_anchors() -> None:
    robot = crane_robot()
    ends = POSITION + Rotation.from_rotvec(TURN).apply(robot.attachments)
    expected = np.linalg.norm(np.array(robot.anchors) - ends, axis=1)
    assert np.allclose(inverse_kinematics(robot, POSITION, quaternion(TURN)), expected, rtol=1e-14)


@pytest.mark.parametrize("robot", (crane_robot(), crane_robot().with_effect(PULLEYS)), ids=("straight", "pulleys"))
def test_the_jacobian_is_the_derivative_of_the_lengths_and_dual_to_the_structure_matrix(robot: Robot) -> None:
    step, differences = 1e-6, np.zeros((8, 6))
    for index, direction in enumerate(step * np.eye(6)):
        ends = [
            inverse_kinematics(
                robot,
                POSITION + sign * direction[:3],
                quaternion((Rotation.from_rotvec(sign * direction[3:]) * Rotation.from_rotvec(TURN)).as_rotvec()),
            )
            for sign in (1.0, -1.0)
        ]
        differences[:, index] = (ends[0] - ends[1]) / (2.0 * step)
    jacobian = length_jacobian(robot, POSITION, quaternion(TURN))
    assert np.allclose(jacobian, differences, rtol=0.0, atol=2e-9)
    assert np.array_equal(structure_matrix(robot, POSITION, quaternion(TURN)), -jacobian.T)


def test_a_tilted_swivel_axis_is_the_vertical_one_of_a_tilted_robot() -> None:
    robot = crane_robot().with_effect(PULLEYS)
    tilt = Rotation.from_rotvec([0.3, 0.7, -0.2])
    x, y, z = tilt.apply([0.0, 0.0, 1.0]).tolist()
    cables = tuple(
        replace(cable, anchor=tuple(tilt.apply(cable.anchor).tolist()), swivel_axis=(x, y, z)) for cable in robot.cables
    )
    tilted = replace(robot, cables=cables)
    turned = quaternion((tilt * Rotation.from_rotvec(TURN)).as_rotvec())
    lengths = inverse_kinematics(robot, POSITION, quaternion(TURN))
    assert np.allclose(inverse_kinematics(tilted, tilt.apply(POSITION), turned), lengths, rtol=1e-13)
    directions = tilt.inv().apply(structure_matrix(tilted, tilt.apply(POSITION), turned)[:3].T)
    assert np.allclose(directions.T, structure_matrix(robot, POSITION, quaternion(TURN))[:3], atol=1e-13)
    assert not np.allclose(inverse_kinematics(replace(tilted, effects=()), tilt.apply(POSITION), turned), lengths)


def test_a_point_mass_has_the_directions_of_its_cables() -> None:
    robot = example("eight")
    assert np.array_equal(structure_matrix(robot), unit_directions(robot))
    assert forward_kinematics(robot, inverse_kinematics(robot, [1.1, 1.0, 0.9]))[0].position == pytest.approx(
        (1.1, 1.0, 0.9), abs=1e-9
    )


@pytest.mark.parametrize("robot", (crane_robot(), crane_robot().with_effect(PULLEYS)), ids=("straight", "pulleys"))
def test_forward_kinematics_returns_to_the_pose_of_the_lengths(robot: Robot) -> None:
    first, *others = forward_kinematics(robot, inverse_kinematics(robot, POSITION, quaternion(TURN)))
    assert not others
    assert np.allclose(first.position, POSITION, rtol=0.0, atol=1e-9)
    assert np.allclose(first.orientation, quaternion(TURN), rtol=0.0, atol=1e-9)
    assert first.residual < 1e-12


def test_six_lengths_have_several_poses_each_of_which_has_them() -> None:
    robot = octahedral_robot()
    lengths = inverse_kinematics(robot)
    solutions = forward_kinematics(robot, lengths)
    assert len(solutions) >= 3
    for solution in solutions:
        assert np.allclose(inverse_kinematics(robot, solution.position, solution.orientation), lengths, atol=1e-9)
    positions = [solution.position for solution in solutions]
    assert min(np.linalg.norm(np.subtract(a, b)) for i, a in enumerate(positions) for b in positions[:i]) > 1e-3


def test_the_residual_tells_that_no_pose_has_the_lengths() -> None:
    robot = crane_robot()
    wrong = inverse_kinematics(robot) + 0.01 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    solution = forward_kinematics(robot, wrong)[0]
    missed = inverse_kinematics(robot, solution.position, solution.orientation) - wrong
    assert solution.residual == pytest.approx(float(np.sqrt(np.mean(missed**2))))
    assert solution.residual > 1e-3


def test_too_few_lengths_are_refused() -> None:
    robot = suspended_robot(4)
    with pytest.raises(ArgumentError, match="do not determine 6 degrees of freedom"):
        forward_kinematics(robot, inverse_kinematics(robot))


@pytest.mark.parametrize(
    "at_pose",
    [structure_matrix, inverse_kinematics, static_pose, lambda robot, at, q: linearise(robot, at, orientation=q)],
)
def test_a_point_mass_that_is_to_turn_is_refused(at_pose: Callable[..., object]) -> None:
    robot = example("three")
    for unturned in ((1.0, 0.0, 0.0, 0.0), (-1.0, 0.0, 0.0, 0.0)):
        at_pose(robot, robot.platform.start, unturned)
    with pytest.raises(InputError, match="point mass, which does not turn"):
        at_pose(robot, robot.platform.start, (0.8, 0.6, 0.0, 0.0))


def test_invalid_poses_are_refused() -> None:
    with pytest.raises(ArgumentError, match="orientation: has norm 2, must have 1"):
        structure_matrix(crane_robot(), None, (2.0, 0.0, 0.0, 0.0))
    with pytest.raises(ArgumentError, match=r"position: has the shape \(2,\), must have \(3,\)"):
        inverse_kinematics(crane_robot(), [0.0, 1.0])
    with pytest.raises(ArgumentError, match="robot: is 3, must be a Robot"):
        structure_matrix(3)  # type: ignore[arg-type]
