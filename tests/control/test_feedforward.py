"""Feedforward: the laws simulated backwards, against a closed form and against the FMUs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.control import (
    ClosedLoopOptions,
    Feedforward,
    cosimulate_closed_loop,
    elastic_reference,
    path_tensions,
    rigid_reference,
    sample_times,
)
from tautwire.cosimulation.robot_cosimulation import CosimulationResult
from tautwire.errors import UnreachableError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.trajectory import Line, Trajectory
from tests.support.robots import example, paper_robot
from tests.support.winch_ramp import WinchRamp

Array = NDArray[np.float64]

PATHS: dict[str, Trajectory] = {
    "three": Line((28.86, 0.0, 5.0), (29.5, 0.7, 6.2), 4.0),
    "caroca": Line((1.0, 0.0, 1.0), (0.6, -0.2, 1.3), 2.0),
    "eight": Line((5.0, 4.0, 2.5), (5.7, 4.4, 2.9), 2.0),
}


def rms_error(motion: CosimulationResult, path: Trajectory) -> float:
    return float(np.sqrt(np.mean(np.sum((motion.position - path.position(motion.time)) ** 2, axis=1))))


def both(fmus: RobotFmus, robot: Robot, path: Trajectory) -> tuple[CosimulationResult, CosimulationResult]:
    """Runs without and with the stretch cancelled."""
    count = robot.cable_count
    times = sample_times(0.01, path.duration + 1.0)
    rigid = rigid_reference(robot, path, times)
    return (
        cosimulate_closed_loop(fmus, robot, Feedforward(count), path, times[-1], ClosedLoopOptions(reference=rigid)),
        cosimulate_closed_loop(fmus, robot, Feedforward(count), path, times[-1]),
    )


def test_speeds_without_damping_are_those_of_the_closed_form() -> None:
    # T - T_0 = E S ln(l / l_u) gives V = (l / E S) dT/dt - dl/dt.
    robot, path = paper_robot(), PATHS["three"]
    times = sample_times(0.01, 5.0)
    cable, lengths = robot.cables[0], np.linalg.norm(np.array(robot.anchors) - path.position(times)[:, None], axis=2)
    fine = 1e-4
    rate = (path_tensions(robot, path, times + fine) - path_tensions(robot, path, times - fine)) / (2.0 * fine)
    rigid, elastic = (f(robot, path, times).speeds for f in (rigid_reference, elastic_reference))
    expected = rigid + lengths * rate / (cable.modulus * cable.area)
    inside = (times > 0.05) & (times < 3.95)
    assert np.max(np.abs(expected - rigid)) > 5e-3
    assert elastic[inside] == pytest.approx(expected[inside], abs=1e-5)


def test_rope_is_let_out_for_the_stretch_also_where_the_acceleration_jumps() -> None:
    robot = paper_robot()
    ramp: Trajectory = WinchRamp(robot, 8.0)
    times = sample_times(0.01, 3.8)
    speeds = elastic_reference(robot, ramp, times).speeds
    cable = robot.cables[0]
    lengths = np.linalg.norm(np.array(robot.anchors) - ramp.position(times)[:, None], axis=2)
    at_rest = path_tensions(robot, ramp, np.array([-1.0]))
    strain = (path_tensions(robot, ramp, times) - at_rest) / (cable.modulus * cable.area)
    assert np.max(np.abs(strain[0])) > 2e-5
    # V = l d(strain)/dt - dl/dt, integrated by parts.
    turned = np.trapezoid(strain * np.gradient(lengths, 0.01, axis=0), dx=0.01, axis=0)
    expected = lengths[-1] * strain[-1] - turned - (lengths[-1] - lengths[0])
    assert np.trapezoid(speeds, dx=0.01, axis=0) == pytest.approx(expected, abs=2e-5)


@pytest.mark.validate
@pytest.mark.parametrize("name", sorted(PATHS))
def test_stretch_is_cancelled_in_the_co_simulation(name: str, tmp_path: Path) -> None:
    robot, path = example(name), PATHS[name]
    rigid, elastic = both(build_fmus(robot, tmp_path, native=True), robot, path)
    assert rms_error(elastic, path) < rms_error(rigid, path) / 150.0
    assert rms_error(elastic, path) < 2e-5
    assert elastic.tension == pytest.approx(path_tensions(robot, path, elastic.time), abs=0.02 * rigid.tension.max())


@pytest.mark.validate
def test_effects_of_the_robot_file_are_cancelled_too(tmp_path: Path) -> None:
    effects = (
        EffectSetting("payload", {"mass": 40.0}),
        EffectSetting("modulus", {"modulus": 9e10}, (2,)),
        EffectSetting("damping", {"damping": 1e9}, (1, 3)),
    )
    robot, path = replace(example("three"), effects=effects), PATHS["three"]
    rigid, elastic = both(build_fmus(robot, tmp_path, native=True), robot, path)
    assert rms_error(elastic, path) < rms_error(rigid, path) / 200.0


def test_sensors_are_expected_to_show_what_they_do() -> None:
    robot, path = example("eight"), PATHS["eight"]
    times = sample_times(0.01, 2.5)
    elastic, rigid = (f(robot, path, times) for f in (elastic_reference, rigid_reference))
    assert elastic.expected == pytest.approx(rigid.expected, abs=1e-5)
    assert np.array_equal(elastic.speeds[0], rigid.speeds[0])
    assert elastic.speeds[-1] == pytest.approx(np.zeros(8), abs=1e-9)


def test_path_that_asks_a_cable_to_push_is_refused() -> None:
    away = Line((28.86, 0.0, 5.0), (-20.0, 0.0, 5.0), 30.0)
    with pytest.raises(UnreachableError, match="cable 3 would need -"):
        elastic_reference(paper_robot(), away, sample_times(0.01, 30.0))
