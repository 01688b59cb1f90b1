"""Native controllers beside those of Python, held by the same hands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from numpy.typing import NDArray

from tautwire.control import (
    ControlAim,
    Design,
    Feedforward,
    build_controller_fmu,
    build_native_controller_fmu,
    design_controller,
    rigid_reference,
    sample_times,
    schedule_controller,
)
from tautwire.robot.pose_trajectory import PoseTrajectory, slerp
from tautwire.robot.trajectory import Line
from tests.support.fmus import in_hand
from tests.support.rigid_robots import crane_robot
from tests.support.robots import example

PATH = Line((28.86, 0.0, 5.0), (29.5, 0.7, 6.2), 2.0)
LIMITED = ControlAim(speed_limit=0.5, acceleration_limit=1.0, highest_tension=1750.0, lowest_tension=1450.0)


def walk(path: Path, steps: tuple[float, ...]) -> NDArray[np.float64]:
    """Everything shown while it follows noise around its path, in steps within, of and beyond its samples."""
    random, rows, time = np.random.default_rng(3), [], 0.0
    with in_hand(path) as hand:
        names = list(hand.references)
        sensors = [name for name in names if name.startswith(("position.", "orientation.", "tension_"))]
        start = np.array(hand.get(*sensors))
        hand.set(**{n.replace(".", "__"): v for n, v in zip(sensors, start * 1.02, strict=True)})
        hand.run()
        for step in steps:
            values = dict(zip(sensors, start * (1.0 + 1e-2 * random.standard_normal(len(start))), strict=True))
            hand.set(input_time=time + step, **{n.replace(".", "__"): v for n, v in values.items()})
            hand.step(time, step)
            rows.append(hand.get(*names))
            time += step
    return np.array(rows)


@pytest.mark.validate(but=["feedforward"])
@pytest.mark.parametrize("kind", ["feedforward", "lqg", "scheduled", "limited"])
def test_a_controller_asks_for_the_same_speeds_as_in_python(kind: str, tmp_path: Path) -> None:
    robot = example("three")
    design: Design = {
        "feedforward": lambda: Feedforward(3),
        "lqg": lambda: design_controller(robot),
        "scheduled": lambda: schedule_controller(robot, PATH, points=3),
        "limited": lambda: design_controller(robot, LIMITED),
    }[kind]()
    python = build_controller_fmu(robot, design, PATH, 2.5, tmp_path / "python")
    native = build_native_controller_fmu(robot, design, PATH, 2.5, tmp_path / "native")
    steps = (0.01, 0.0025, 0.0025, 0.005, 0.02, 0.025, 0.005, *[0.01] * 60)
    one, other = walk(python, steps), walk(native, steps)
    assert np.max(np.abs(one - other) / np.maximum(np.max(np.abs(one), axis=0), 1.0)) < 1e-10
    assert validate_fmu(str(native)) == []


@pytest.mark.validate
def test_a_controller_of_a_platform_that_turns_asks_for_the_same_speeds(tmp_path: Path) -> None:
    robot = crane_robot()
    x, y, z = robot.platform.start
    line, turn = Line((x, y, z), (x, y, z + 0.1), 1.0), slerp((1.0, 0.0, 0.0, 0.0), (0.6, 0.0, 0.0, 0.8), 1.0)
    design, path = design_controller(robot), PoseTrajectory(line, turn)
    reference = rigid_reference(robot, path, sample_times(0.01, 0.3))
    python = build_controller_fmu(robot, design, path, 0.3, tmp_path / "python", reference)
    native = build_native_controller_fmu(robot, design, path, 0.3, tmp_path / "native", reference)
    one, other = (walk(file, (0.01, 0.0025, 0.0075, *[0.01] * 20)) for file in (python, native))
    assert np.max(np.abs(one - other) / np.maximum(np.max(np.abs(one), axis=0), 1.0)) < 1e-10


def test_it_is_saved_between_its_samples(tmp_path: Path) -> None:
    robot = example("three")
    path = build_native_controller_fmu(robot, design_controller(robot), PATH, 2.5, tmp_path)
    with in_hand(path) as hand:
        hand.run()
        hand.step(0.0, 0.0125)
        saved = hand.fmu.getFMUstate()
        shown = []
        for _ in range(2):
            hand.set(tension_1=1234.0)
            hand.step(0.0125, 0.02)
            shown.append(hand.get("winch_speed_1", "winch_acceleration_1", "since_sample"))
            hand.fmu.setFMUstate(saved)
        hand.fmu.freeFMUstate(saved)
    assert shown[0] == shown[1]
