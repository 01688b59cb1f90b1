"""The rigid platform's FMU: Newton and Euler for any importer, and refusal of bodies that cannot be."""

from __future__ import annotations

import fmpy
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tautwire.fmus.component import Component, ComponentError
from tautwire.fmus.packaging import RobotFmus
from tests.support.fmus import Hand, in_hand
from tests.support.rigid_motion import rotation_matrices
from tests.support.rigid_robots import crane_robot

Array = NDArray[np.float64]

MOMENT = np.array([40.0, -25.0, 15.0])
FREE = {f"force_{i}.{axis}": 0.0 for i in range(1, 9) for axis in "xyz"}
QUATERNION = [f"orientation.{part}" for part in "wxyz"]


def vector(name: str) -> list[str]:
    return [f"{name}.{axis}" for axis in "xyz"]


def turned_by_moment(duration: float) -> tuple[Array, Array]:
    """Rotation matrix and angular velocity of the crane's platform from rest under :data:`MOMENT`."""
    inertia = np.array(crane_robot().platform.inertia)

    def rates(time: float, state: Array) -> Array:
        rotation = state.reshape(3, 3)
        velocity = rotation @ np.linalg.solve(inertia, rotation.T @ (time * MOMENT))
        return np.cross(velocity, rotation.T).T.ravel()

    end = solve_ivp(rates, (0.0, duration), np.eye(3).ravel(), method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    rotation = end.reshape(3, 3)
    return rotation, rotation @ np.linalg.solve(inertia, rotation.T @ (duration * MOMENT))


def test_another_importer_sees_a_free_body_fall_and_turn(crane_fmus: RobotFmus) -> None:
    platform = crane_robot().platform
    moment = dict(zip(vector("external_moment"), MOMENT, strict=True))
    outputs = [*QUATERNION, *vector("angular_velocity"), *vector("angular_momentum"), *vector("position")]
    run = fmpy.simulate_fmu(
        str(crane_fmus.platform),
        stop_time=2.0,
        step_size=0.01,
        output_interval=0.01,
        start_values=FREE | moment,
        output=outputs,
    )
    end = np.array([run[name][-1] for name in outputs])
    rotation, velocity = turned_by_moment(2.0)
    found = rotation_matrices(end[None, :4])[0]
    assert np.max(np.abs(found - rotation)) < 1e-7
    assert end[4:7] == pytest.approx(velocity, abs=1e-7)
    assert end[7:10] == pytest.approx(2.0 * MOMENT, rel=1e-13)
    fallen = np.array(platform.start) + platform.centre_of_mass - [0.0, 0.0, 0.5 * 9.81 * 4.0]
    assert end[10:] + found @ platform.centre_of_mass == pytest.approx(fallen, abs=1e-11)
    assert abs(np.linalg.norm(end[:4]) - 1.0) <= 1e-15


def moving(hand: Hand) -> None:
    """A platform that turns and translates, pushed where no force points to its centre."""
    hand.set(**{name.replace(".", "__"): 0.0 for name in FREE})
    hand.set(force_1__x=200.0, force_4__z=900.0, force_7__y=-300.0, external_force__y=120.0, external_moment__z=30.0)
    hand.run()
    hand.step(0.0, 0.2)


@pytest.mark.parametrize(
    ("value", "rate"),
    [
        ("position", "velocity"),
        ("velocity", "acceleration"),
        ("position_3", "velocity_3"),
        ("velocity_3", "acceleration_3"),
        ("angular_velocity", "angular_acceleration"),
    ],
)
def test_rates_are_the_derivatives_of_the_outputs(crane_fmus: RobotFmus, value: str, rate: str) -> None:
    with in_hand(crane_fmus.platform) as hand:
        moving(hand)
        seen = []
        for index in range(3):
            seen.append(hand.get(*vector(value), *vector(rate)))
            hand.step(0.2 + index * 1e-4, 1e-4)
    first, second, third = np.array(seen)
    assert (third[:3] - first[:3]) / 2e-4 == pytest.approx(second[3:], rel=1e-6, abs=1e-6)


def test_an_attachment_is_a_point_of_the_body(crane_fmus: RobotFmus) -> None:
    with in_hand(crane_fmus.platform) as hand:
        moving(hand)
        rotation = rotation_matrices(np.array([hand.get(*QUATERNION)]))[0]
        arm = rotation @ crane_robot().attachments[4]
        origin, attachment = np.array(hand.get(*vector("position"))), np.array(hand.get(*vector("position_5")))
        turning = np.cross(hand.get(*vector("angular_velocity")), arm)
        moved = np.array(hand.get(*vector("velocity_5"))) - hand.get(*vector("velocity"))
    assert np.max(np.abs(rotation - np.eye(3))) > 0.01
    assert attachment == pytest.approx(origin + arm, abs=1e-14)
    assert moved == pytest.approx(turning, abs=1e-13)


def test_an_external_force_acts_at_the_origin(crane_fmus: RobotFmus) -> None:
    platform = crane_robot().platform
    with in_hand(crane_fmus.platform) as hand:
        hand.set(**{name.replace(".", "__"): 0.0 for name in FREE}, external_force__x=100.0)
        turning_rate = hand.get(*vector("angular_acceleration"))
    moment = np.cross(-np.array(platform.centre_of_mass), [100.0, 0.0, 0.0])
    assert turning_rate == pytest.approx(np.linalg.solve(np.array(platform.inertia), moment), rel=1e-12)


def test_a_step_repeated_gives_the_same_bits(crane_fmus: RobotFmus) -> None:
    with in_hand(crane_fmus.platform) as hand:
        moving(hand)
        saved = hand.fmu.getFMUState()
        ends = []
        for _ in range(2):
            hand.step(0.2, 0.05)
            ends.append(hand.get(*QUATERNION, *vector("angular_momentum"), *vector("acceleration_2")))
            hand.fmu.setFMUState(saved)
        hand.fmu.freeFMUState(saved)
    assert ends[0] == ends[1]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"inertia.xy": 90.0}, "positive definite"),
        ({"start_orientation.x": 0.3}, "length 1"),
        ({"inertia.zz": -1.0}, "inertia.zz is -1.0 kg m2, it has to be at least 0.0"),
    ],
)
def test_a_body_that_cannot_be_is_refused(crane_fmus: RobotFmus, settings: dict[str, float], words: str) -> None:
    with Component("platform", crane_fmus.platform) as component, pytest.raises(ComponentError, match=words):
        component.initialize(0.0, settings)
        component.run()


def test_a_start_that_is_set_moves_body_and_attachments(crane_fmus: RobotFmus) -> None:
    half = np.sqrt(0.5)
    with in_hand(crane_fmus.platform) as hand:
        hand.set(start__x=5.0, start_orientation__w=half, start_orientation__z=half)
        assert hand.get(*vector("position")) == pytest.approx([5.0, -0.2, 1.5], abs=1e-14)
        x, y, z = crane_robot().attachments[0]
        assert hand.get(*vector("position_1")) == pytest.approx([5.0 - y, -0.2 + x, 1.5 + z], abs=1e-14)
