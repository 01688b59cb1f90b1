"""Rotations by unit quaternions, against SciPy's and against complex steps."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.robot.symbolic_equations import CASADI_MATHEMATICS
from tautwire_fmu.laws.mathematics import COMPLEX_STEP, REAL, rate_of, with_rate
from tautwire_fmu.laws.rotation import (
    IDENTITY,
    multiply,
    quaternion_of,
    quaternion_rate,
    rotate,
    rotate_back,
    rotation_matrix,
    rotation_vector_of,
)

VECTOR = (0.3, -1.2, 2.5)
TURNS = ((0.4, -1.1, 0.7), (3.0, 0.5, -0.2))
# On both sides of the angle at which the series takes over.
ANGLES = (1e-9, 1e-3, 0.0316, 0.0317, 1.0, 3.1)


@pytest.mark.parametrize("turn", TURNS)
def test_a_quaternion_rotates_as_its_matrix_and_as_scipy(turn: tuple[float, float, float]) -> None:
    quaternion = quaternion_of(REAL, turn)
    expected = Rotation.from_rotvec(turn).apply(VECTOR)
    assert np.allclose(rotate(quaternion, VECTOR), expected, rtol=0.0, atol=1e-15)
    assert np.allclose(np.array(rotation_matrix(quaternion)) @ VECTOR, expected, rtol=0.0, atol=1e-15)
    assert np.allclose(rotate_back(quaternion, expected.tolist()), VECTOR, rtol=0.0, atol=2e-15)


def test_a_product_rotates_by_its_second_factor_first() -> None:
    p, q = (quaternion_of(REAL, turn) for turn in TURNS)
    assert np.allclose(rotate(multiply(p, q), VECTOR), rotate(p, rotate(q, VECTOR)), rtol=0.0, atol=2e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_rotation_vector_of_any_length_gives_its_quaternion_to_rounding(angle: float) -> None:
    axis = np.array(VECTOR) / np.linalg.norm(VECTOR)
    x, y, z, w = Rotation.from_rotvec(angle * axis).as_quat()
    assert np.allclose(quaternion_of(REAL, (angle * axis).tolist()), (w, x, y, z), rtol=1e-15, atol=1e-16)


def test_no_rotation_is_the_identity_and_turns_at_half_the_rate_of_its_vector() -> None:
    assert quaternion_of(REAL, (0.0, 0.0, 0.0)) == IDENTITY
    with_rates = quaternion_of(COMPLEX_STEP, tuple(with_rate(0.0, rate) for rate in VECTOR))
    assert [rate_of(part) for part in with_rates] == pytest.approx([0.0, *(0.5 * rate for rate in VECTOR)])


def test_a_quaternion_changes_at_the_rate_of_turning_on_by_the_angular_velocity() -> None:
    quaternion = quaternion_of(REAL, TURNS[0])
    turned_on = multiply(quaternion, quaternion_of(COMPLEX_STEP, tuple(with_rate(0.0, rate) for rate in VECTOR)))
    assert quaternion_rate(quaternion, VECTOR) == pytest.approx([rate_of(part) for part in turned_on], rel=1e-14)


@pytest.mark.parametrize("angle", (0.0, *ANGLES))
def test_symbols_have_finite_derivatives_at_every_angle(angle: float) -> None:
    vector = casadi.SX.sym("r", 3)
    quaternion = casadi.vertcat(*quaternion_of(CASADI_MATHEMATICS, casadi.vertsplit(vector)))
    jacobian = casadi.Function("q", [vector], [casadi.jacobian(quaternion, vector)])
    at = angle * np.array(VECTOR) / np.linalg.norm(VECTOR)
    exact = [
        [rate_of(part) for part in quaternion_of(COMPLEX_STEP, tuple(map(with_rate, at.tolist(), direction)))]
        for direction in np.eye(3).tolist()
    ]
    assert np.allclose(np.array(jacobian(at)).T, exact, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("angle", (*ANGLES, 0.0632, 0.0633))
@pytest.mark.parametrize("sign", (1.0, -1.0))
def test_a_quaternion_of_either_sign_has_the_rotation_vector_it_was_made_of(angle: float, sign: float) -> None:
    vector = (angle * np.array(VECTOR) / np.linalg.norm(VECTOR)).tolist()
    quaternion = [sign * part for part in quaternion_of(REAL, vector)]
    assert np.allclose(rotation_vector_of(REAL, quaternion), vector, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize("angle", (1e-9, 0.0632, 1.0))
def test_a_rotation_vector_differentiates_through_its_quaternion(angle: float) -> None:
    turn = casadi.SX.sym("turn", 3)
    parts = quaternion_of(CASADI_MATHEMATICS, (turn[0], turn[1], turn[2]))
    back = casadi.vertcat(*rotation_vector_of(CASADI_MATHEMATICS, parts))
    jacobian = casadi.Function("jacobian", [turn], [casadi.jacobian(back, turn)])
    vector = angle * np.array(VECTOR) / np.linalg.norm(VECTOR)
    assert np.allclose(np.array(jacobian(vector)), np.eye(3), rtol=0.0, atol=1e-9)
