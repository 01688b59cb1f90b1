"""The hanging load, against the rig's pendulum and against a payload."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tautwire.robot.reference_simulation import integrate
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.schema import EffectSetting, Robot
from tautwire_fmu.laws.effects import ALL, BY_NAME, UNLISTED
from tests.rig import load_robot, make_recording
from tests.rig.program import SampledProgram
from tests.support.robots import EXAMPLES, example

HANGING_LOAD = BY_NAME["hanging_load"]
MASS, GRAVITY = 20.0, 9.81


def with_load(name: str, **values: float) -> Robot:
    return example("three").with_effect(EffectSetting(name, values, ()))


def test_it_is_no_effect_of_the_list() -> None:
    assert HANGING_LOAD in UNLISTED
    assert HANGING_LOAD not in ALL


def test_a_robot_file_may_have_it(tmp_path: Path) -> None:
    robot = with_load("hanging_load", weight=MASS * GRAVITY)
    (tmp_path / "robot.toml").write_text(robot_text(robot), encoding="utf-8")
    assert read_robot(tmp_path / "robot.toml").effects == robot.effects


def test_ropes_hold_it_at_rest_as_they_hold_a_payload() -> None:
    times, still = np.arange(0.0, 1.01, 0.1), np.zeros((11, 3))
    hanging, carried = (
        integrate(robot, times, still)
        for robot in (with_load("hanging_load", weight=MASS * GRAVITY), with_load("payload", mass=MASS))
    )
    plain = integrate(example("three"), times, still)
    assert np.allclose(hanging.tension, carried.tension, rtol=1e-9)
    assert np.max(np.abs(hanging.tension - plain.tension)) > 50.0


@pytest.mark.validate
@pytest.mark.parametrize("name", ["hanging_load", "payload"])
def test_a_slow_pendulum_of_the_rig_is_it_where_the_platform_moves_fast(name: str) -> None:
    declared = load_robot(EXAMPLES / "three" / "robot.toml")
    times = np.arange(0.0, 4.01, 0.02)
    directions = declared.anchors - declared.start
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    sideways = directions @ (0.4, 0.2, 0.0)
    speeds = np.outer(np.sin(4.0 * times) * np.minimum(times, 1.0), sideways)
    pendulum = {"unlisted_swing": {"mass": MASS, "length": 40.0, "viscosity": 0.0}}
    program = SampledProgram(times, speeds)
    swinging = make_recording(declared, pendulum, program, duration=4.0, rate=50.0, seed=0, noise=False)
    values = {"weight": MASS * GRAVITY} if name == "hanging_load" else {"mass": MASS}
    run, plain = integrate(with_load(name, **values), times, speeds), integrate(example("three"), times, speeds)
    truth = swinging[[f"tension_{k}" for k in (1, 2, 3)]].to_numpy(dtype=float)
    error_ratio = np.max(np.abs(run.tension - truth)) / np.max(np.abs(plain.tension - truth))
    assert (error_ratio < 0.1) == (name == "hanging_load")
