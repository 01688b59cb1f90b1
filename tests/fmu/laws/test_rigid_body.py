"""The rigid body's law against its textbook form in arrays."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from tautwire_fmu.laws import rigid_body as law
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.rotation import quaternion_of, rotation_matrix

INERTIA = np.array([[36.6, 1.0, -2.0], [1.0, 33.2, 0.5], [-2.0, 0.5, 20.1]])
ROTATION = np.array(rotation_matrix(quaternion_of(REAL, (0.4, -0.9, 0.3))))
ARMS = np.array([[0.5, -0.4, 0.2], [-0.6, 0.1, 0.7]])
FORCES = np.array([[300.0, -150.0, 500.0], [-80.0, 240.0, 700.0]])
VELOCITY = np.array([0.4, -0.7, 1.1])


def rows(matrix: np.ndarray) -> law.Matrix:
    x, y, z = matrix.tolist()
    return x, y, z


def test_the_moment_is_the_sum_of_arm_cross_force() -> None:
    matrix = law.moment_matrix(ARMS.T.tolist(), FORCES.T.tolist())
    expected = np.cross(ARMS @ ROTATION.T, FORCES).sum(axis=0)
    assert law.moment(rows(ROTATION), matrix) == pytest.approx(expected, rel=1e-13)


def test_the_inertia_turns_angular_momentum_into_angular_velocity() -> None:
    inertia = law.inertia_of(rows(INERTIA))
    assert np.array(inertia.inverse) @ INERTIA == pytest.approx(np.eye(3), abs=1e-15)
    momentum = ROTATION @ INERTIA @ VELOCITY
    assert law.angular_velocity(inertia, rows(ROTATION), momentum) == pytest.approx(VELOCITY, rel=1e-13)


def test_the_angular_acceleration_is_eulers() -> None:
    moment = np.array([30.0, -50.0, 20.0])
    found = law.angular_acceleration(law.inertia_of(rows(INERTIA)), rows(ROTATION), VELOCITY, moment)
    expected = np.linalg.solve(INERTIA, ROTATION.T @ moment - np.cross(VELOCITY, INERTIA @ VELOCITY))
    assert found == pytest.approx(expected, rel=1e-13)


def test_a_points_velocity_and_acceleration_are_those_of_a_turning_body() -> None:
    acceleration, arm = np.array([-0.5, 0.2, 0.9]), ARMS[0]
    matrices = law.rotation_matrices(law.Attitude(rows(ROTATION), VELOCITY, acceleration))
    position, velocity, second = (np.array(law.transform(matrix, arm)) for matrix in matrices)
    assert position == pytest.approx(ROTATION @ arm, rel=1e-14)
    assert velocity == pytest.approx(ROTATION @ np.cross(VELOCITY, arm), rel=1e-13)
    centripetal = np.cross(VELOCITY, np.cross(VELOCITY, arm))
    assert second == pytest.approx(ROTATION @ (np.cross(acceleration, arm) + centripetal), rel=1e-13)


def test_principal_axes_are_those_of_the_matrix_nearest_to_the_platforms_axes() -> None:
    random = np.random.default_rng(5)
    for _ in range(50):
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        matrix = turn @ np.diag(random.uniform(1.0, 30.0, 3)) @ turn.T
        axes = np.array(law.principal_axes(matrix.tolist()))
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-14)
        assert np.linalg.norm(axes @ matrix @ axes.T - np.diag(np.diag(axes @ matrix @ axes.T))) < 1e-12
        nearness = [np.trace(np.abs(axes[list(order)])) for order in permutations(range(3))]
        assert nearness[0] == max(nearness) and np.all(np.diag(axes) >= 0.0)


@pytest.mark.parametrize("moments", [(1.0, 2.0, 3.0), (3.0, 1.0, 2.0), (5.0, 5.0, 5.0), (4.0, 4.0, 6.0)])
def test_principal_axes_of_a_diagonal_inertia_are_the_coordinate_axes(moments: tuple[float, ...]) -> None:
    assert np.array_equal(law.principal_axes(np.diag(moments).tolist()), np.eye(3))
