"""Rotation over a step: its order, and what it conserves."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.rigid_body import inertia_of, moment_matrix
from tautwire_fmu.laws.rotation import multiply, quaternion_of, rotation_matrix, rotation_vector_rate
from tautwire_fmu.laws.vectors import Vector, dot, scale
from tautwire_fmu.rotation_quadrature import Body, Load, RotationState, integrate_rotation

Array = NDArray[np.float64]

INERTIA = np.array([[36.6, 1.0, -2.0], [1.0, 33.2, 0.5], [-2.0, 0.5, 20.1]])
ARMS = np.array([[0.5, -0.4, 0.2], [-0.6, 0.1, 0.7], [0.1, 0.5, -0.3]])
FORCES = np.array([[300.0, -150.0, 500.0], [-80.0, 240.0, 700.0], [60.0, -90.0, 300.0]])
MOMENT = np.array([15.0, -20.0, 10.0])
START = RotationState((0.9, 0.1, -0.3, 0.3), (20.0, -15.0, 12.0))


def load_at(time: float) -> Load:
    """Forces that swell and a moment that grows."""
    size, rate = 1.0 + 0.3 * np.sin(3.0 * time), 0.9 * np.cos(3.0 * time)
    return Load(
        moment_matrix(ARMS.T.tolist(), (size * FORCES).T.tolist()),
        moment_matrix(ARMS.T.tolist(), (rate * FORCES).T.tolist()),
        (time * MOMENT).tolist(),
        MOMENT.tolist(),
    )


def resisting_moment(m: Mathematics, velocity: Vector) -> Vector:
    """A moment against the turning that grows faster than the angular velocity."""
    return scale(-0.5 * m.sqrt(1.0 + dot(velocity, velocity)), velocity)


def end_state(step: float, duration: float, middle: bool, resists: bool = False) -> Array:
    """Rotation matrix and angular momentum, shape (12,)."""
    body, state = Body(inertia_of(INERTIA.tolist()), resisting_moment if resists else None), START
    for index in range(round(duration / step)):
        time = index * step
        loads = [load_at(time + fraction * step) for fraction in ((0.0, 0.5, 1.0) if middle else (0.0, 1.0))]
        state = integrate_rotation(body, state, loads, step).end
    return np.array([*np.ravel(rotation_matrix(state.quaternion)), *state.momentum])


def exact_end_state(duration: float, resists: bool = False) -> Array:
    """As :func:`end_state`, by the rotation matrix and its rate."""

    def rates(time: float, state: Array) -> Array:
        rotation, momentum = state[:9].reshape(3, 3), state[9:]
        velocity = rotation @ np.linalg.solve(INERTIA, rotation.T @ momentum)
        forces = (1.0 + 0.3 * np.sin(3.0 * time)) * FORCES
        moment = np.cross(ARMS @ rotation.T, forces).sum(axis=0) + time * MOMENT
        moment -= resists * 0.5 * np.sqrt(1.0 + velocity @ velocity) * velocity
        return np.array([*np.cross(velocity, rotation.T).T.ravel(), *moment])

    start = np.array([*np.ravel(rotation_matrix(START.quaternion)), *START.momentum])
    return np.asarray(solve_ivp(rates, (0.0, duration), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1])


@pytest.mark.parametrize(("middle", "order", "bound"), [(False, 4, 4e-3), (True, 6, 6e-7)])
def test_the_order_is_four_and_with_forces_in_the_middle_six(middle: bool, order: int, bound: float) -> None:
    exact = exact_end_state(1.0)
    coarse, fine = (np.max(np.abs(end_state(step, 1.0, middle) - exact)) for step in (0.1, 0.05))
    assert fine < bound
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize(("middle", "order"), [(False, 4), (True, 6)])
def test_a_moment_by_the_angular_velocity_keeps_the_order(middle: bool, order: int) -> None:
    exact = exact_end_state(1.0, resists=True)
    assert np.max(np.abs(exact - exact_end_state(1.0))) > 0.01
    coarse, fine = (np.max(np.abs(end_state(step, 1.0, middle, True) - exact)) for step in (0.025, 0.0125))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.3)


@pytest.mark.validate(but=["0.01"])
@pytest.mark.parametrize("step", [0.3, 0.01])
def test_a_free_top_keeps_momentum_energy_and_the_quaternions_length(step: float) -> None:
    body, state = Body(inertia_of(INERTIA.tolist())), START
    free = Load(((0.0,) * 3,) * 3, ((0.0,) * 3,) * 3)
    energies, lengths = [], []
    for _ in range(1000):
        rotation = integrate_rotation(body, state, [free] * 3, step)
        state = rotation.end
        velocity = np.array(rotation.end_attitude.velocity)
        energies.append(0.5 * velocity @ INERTIA @ velocity)
        lengths.append(np.linalg.norm(state.quaternion))
        assert state.momentum == pytest.approx(START.momentum, abs=0.0)
    assert np.max(np.abs(np.array(lengths) - 1.0)) < 1e-15
    assert np.ptp(energies) < 5e-11 * energies[0]
    late, early = np.mean(energies[-100:]), np.mean(energies[:100])
    assert late == pytest.approx(early, rel=1e-12)


@pytest.mark.parametrize("size", [0.05, 0.2, 2.0])
def test_the_rotation_vectors_rate_is_that_of_the_rotation(size: float) -> None:
    angles, velocity, step = size * np.array([0.6, -0.3, 0.5]), (0.4, 1.1, -0.7), 1e-5
    rate = np.array(rotation_vector_rate(REAL, angles.tolist(), velocity))
    before, after = (quaternion_of(REAL, (angles + sign * step * rate).tolist()) for sign in (-1.0, 1.0))
    conjugate = (before[0], *(-part for part in before[1:]))
    assert 2.0 * np.array(multiply(conjugate, after)[1:]) / (2.0 * step) == pytest.approx(velocity, rel=1e-8)


def test_a_step_that_is_too_long_is_refused() -> None:
    body = Body(inertia_of(INERTIA.tolist()))
    with pytest.raises((ArithmeticError, ValueError)):
        integrate_rotation(body, START, [load_at(0.0), load_at(3.0), load_at(6.0)], 6.0)
