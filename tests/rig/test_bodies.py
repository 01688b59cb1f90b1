"""Effects of the test rig that add bodies or stand outside the ropes: sensors, a swinging load, a frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.rig import RampProgram, Rig, Robot, StillProgram, make_recording, paper_robot, simulate, wander
from tests.rig.solve import Method

RAMP = RampProgram(np.array([0.3, 0.25, -0.25]), 1.0)
STILL = StillProgram(3)


def damped() -> Robot:
    return replace(paper_robot(), damping=np.full(3, 4e8))


def recorded(effects: dict[str, dict[str, float | str]]) -> np.ndarray:
    return make_recording(damped(), effects, RAMP, duration=5.0, rate=20.0, seed=0, noise=False).to_numpy()


def test_delayed_sensors_show_the_past() -> None:
    plain = recorded({})
    late = recorded({"sensor_delay": {"seconds": 0.1, "outputs": "all"}})
    assert np.allclose(late[2:, 4:], plain[:-2, 4:], rtol=1e-6, atol=1e-7)
    assert np.allclose(late[:2, 4:], plain[0, 4:])
    assert np.array_equal(late[:, :4], plain[:, :4])


def test_swinging_load_keeps_energy_and_string_length() -> None:
    effects = {"unlisted_swing": {"mass": 60.0, "length": 2.0}}
    run = simulate(paper_robot(), effects, STILL, np.arange(0, 20, 0.1), velocity=[0.6, 0.3, 0.2])
    string, swinging = run.state[:, 9:12], run.state[:, 12:15]
    assert np.linalg.norm(string, axis=1) == pytest.approx(2.0, abs=1e-7)
    axial, start = run.rig.axial, run.rig.start_length
    stretch = run.length * np.log(run.length / start) - run.length + start
    ropes = (axial * stretch + run.rig.start_tension * (run.length - start)).sum(axis=1)
    load_speed = ((run.velocity + swinging) ** 2).sum(axis=1)
    kinetic = 0.5 * 300 * (run.velocity**2).sum(axis=1) + 0.5 * 60 * load_speed
    height = 360 * 9.8 * run.position[:, 2] + 60 * 9.8 * string[:, 2]
    total = ropes + kinetic + height
    # The load starts with the platform's velocity, which belongs to its kinetic energy.
    assert np.abs(total - total[0]).max() < 1e-3
    assert np.ptp(string[:, 0]) > 0.1


def test_filling_tank_weighs_down_and_is_carried_along() -> None:
    rig = Rig(damped(), {"unlisted_filling": {"rate": 5.0}}, STILL)
    assert rig.evaluate(0.0, rig.begin()).acceleration == pytest.approx([0.0, 0.0, 0.0], abs=1e-10)
    late = rig.evaluate(4.0, rig.begin()).acceleration
    assert late == pytest.approx([0.0, 0.0, -20.0 * 9.8 / 320.0])


@pytest.mark.validate
def test_stiff_frame_gives_way_by_tension_over_stiffness() -> None:
    effects = {"unlisted_frame": {"stiffness_constant": 1e5, "viscosity": 2e3}}
    program = wander(paper_robot(), 4, 5.0, shake=0.0, slow=(15.0, 30.0))
    run = simulate(replace(paper_robot(), damping=np.full(3, 4e9)), effects, program, [0.0, 20.0])
    moved = run.state[-1, 9:18].reshape(3, 3)
    pull = run.pull[-1][:, None] * run.direction[-1]
    before = run.rig.start_tension[:, None] * run.rig.start_direction
    assert moved == pytest.approx(-(pull - before) / 1e5, abs=2e-5)


@pytest.mark.parametrize("method", ["Radau", "LSODA"])
def test_stiff_branch_runs_with_stiff_methods(method: Method) -> None:
    effects = {"relaxation": {"modulus": 1e12, "time": 1e-3}}
    one = simulate(damped(), effects, RAMP, [0.0, 1.0])
    other = simulate(damped(), effects, RAMP, [0.0, 1.0], method=method, rtol=1e-8, atol=1e-10)
    assert one.position[-1] == pytest.approx(other.position[-1], abs=1e-6)
