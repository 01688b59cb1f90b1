"""Symbols of a platform against Newton's and Euler's equations about the origin, written with numpy and scipy."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from casadi import SX
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.robot.platform_symbols import PlatformSymbols, StateIndices, platform_symbols
from tautwire.robot.symbolic_equations import CASADI_MATHEMATICS
from tautwire_fmu.laws.point_mass import PointMassConstants
from tests.support.rigid_robots import crane_robot

Array = NDArray[np.float64]

ROBOT = crane_robot()
GRAVITY = np.array([0.0, 0.0, -ROBOT.gravity])
START = Rotation.from_euler("zyx", [0.4, -0.2, 0.3])


def symbols() -> PlatformSymbols:
    x, y, z, w = START.as_quat()
    constants = PointMassConstants(ROBOT.platform.mass, ROBOT.gravity)
    return platform_symbols(CASADI_MATHEMATICS, ROBOT, constants, (w, x, y, z))


def evaluated(
    platform: PlatformSymbols, expressions: list[SX], pose: Array, twist: Array, wrench: Array
) -> list[Array]:
    function = casadi.Function("f", [platform.pose, platform.twist, platform.external_wrench], expressions)
    values = function(pose, twist, wrench)
    return [np.asarray(value, dtype=float).ravel() for value in (values if len(expressions) > 1 else [values])]


def state(angle: float) -> tuple[Array, Array, Array]:
    random = np.random.default_rng(3)
    pose, twist, wrench = random.normal(size=(3, 6))
    pose[3:] *= angle / np.linalg.norm(pose[3:])
    return pose, twist, 100.0 * wrench


def origin_accelerations(pose: Array, twist: Array, wrench: Array, forces: Array) -> Array:
    """Accelerations of the origin by the 6 x 6 mass matrix there: independent of the product's equations."""
    rotation = (Rotation.from_rotvec(pose[3:]) * START).as_matrix()
    assert ROBOT.platform.inertia is not None
    mass, turning = ROBOT.platform.mass, twist[3:]
    centre = rotation @ np.array(ROBOT.platform.centre_of_mass)
    cross = np.array([[0.0, -centre[2], centre[1]], [centre[2], 0.0, -centre[0]], [-centre[1], centre[0], 0.0]])
    about_origin = rotation @ np.array(ROBOT.platform.inertia) @ rotation.T - mass * cross @ cross
    mass_matrix = np.block([[mass * np.eye(3), -mass * cross], [mass * cross, about_origin]])
    arms = np.array([cable.attachment for cable in ROBOT.cables]) @ rotation.T
    load = wrench + np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])
    load += np.concatenate([mass * GRAVITY, np.cross(centre, mass * GRAVITY)])
    load[:3] -= mass * np.cross(turning, np.cross(turning, centre))
    load[3:] -= np.cross(turning, about_origin @ turning)
    accelerations: Array = np.linalg.solve(mass_matrix, load)
    return accelerations


@pytest.mark.parametrize("angle", [1e-4, 0.02, 0.05, 2.0])
def test_a_rigid_body_accelerates_by_newton_and_euler(angle: float) -> None:
    platform, forces = symbols(), np.random.default_rng(5).normal(size=(8, 3)) * 300.0
    pose, twist, wrench = state(angle)
    rates = platform.rates([tuple(map(SX, force)) for force in forces.tolist()], (), ())
    (values,) = evaluated(platform, [rates], pose, twist, wrench)
    assert values[:3] == pytest.approx(twist[:3])
    assert values[6:] == pytest.approx(origin_accelerations(pose, twist, wrench, forces), rel=1e-12, abs=1e-10)


@pytest.mark.parametrize("angle", [1e-4, 0.02, 0.05, 2.0])
def test_the_rate_of_the_rotation_vector_turns_the_body_by_its_angular_velocity(angle: float) -> None:
    platform = symbols()
    pose, twist, wrench = state(angle)
    (rates,) = evaluated(platform, [platform.rates([(SX(0.0),) * 3] * 8, (), ())], pose, twist, wrench)
    step = 1e-6
    before, after = (Rotation.from_rotvec(pose[3:] + sign * step * rates[3:6]) for sign in (-0.5, 0.5))
    assert (after * before.inv()).as_rotvec() / step == pytest.approx(twist[3:], abs=1e-8)


def test_attachments_move_with_the_body() -> None:
    platform = symbols()
    pose, twist, wrench = state(1.0)
    for index, cable in enumerate(ROBOT.cables):
        motion = [casadi.vertcat(*vector) for vector in platform.attachment_motion(index)]
        position, velocity = evaluated(platform, motion, pose, twist, wrench)
        arm = (Rotation.from_rotvec(pose[3:]) * START).apply(cable.attachment)
        assert position == pytest.approx(pose[:3] + arm, rel=1e-12)
        assert velocity == pytest.approx(twist[:3] + np.cross(twist[3:], arm), rel=1e-12)


@pytest.mark.parametrize(("degrees", "tensions"), [(3, slice(6, 14)), (6, slice(12, 20))])
def test_tensions_stand_behind_pose_and_twist(degrees: int, tensions: slice) -> None:
    indices = StateIndices(degrees, 8)
    assert indices.tensions == indices.lengths == tensions
    assert (indices.pose, indices.twist) == (slice(0, degrees), slice(degrees, 2 * degrees))
