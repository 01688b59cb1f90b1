"""The closed loop: the design by itself, and the FMUs under it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from numpy.typing import NDArray

import tautwire
from tautwire.control import (
    ClosedLoopOptions,
    ControlAim,
    PathController,
    cosimulate_closed_loop,
    design_controller,
    path_tensions,
)
from tautwire.cosimulation import Experiment, FixedStep
from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate, run_cosimulation
from tautwire.errors import InputError, UnreachableError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Robot
from tautwire.robot.trajectory import CAROCA_HELIX, PAPER_HELIX, Helix, Line, Trajectory
from tautwire.robot.winch_speeds import ideal_winch_speeds
from tests.support.robots import paper_robot
from tests.support.winch_ramp import WinchRamp

Array = NDArray[np.float64]

EXAMPLES = Path(tautwire.__file__).parent / "examples"
NAMES = ("three", "caroca", "eight")
PATHS: dict[str, Trajectory] = {
    "three": Line((28.86, 0.0, 5.0), (29.5, 0.7, 6.2), 4.0),
    "caroca": replace(CAROCA_HELIX, angle=0.3 * np.pi, rise=0.2, duration=2.5),
    "eight": Line((5.0, 4.0, 2.5), (5.7, 4.4, 2.9), 2.0),
}


def robot_named(name: str) -> Robot:
    return read_robot(EXAMPLES / name / "robot.toml")


class BuiltOnDemand(dict[str, RobotFmus]):
    """FMUs of robots by name, each built when it is first asked for."""

    def __init__(self, factory: pytest.TempPathFactory) -> None:
        super().__init__()
        self._factory = factory

    def __missing__(self, name: str) -> RobotFmus:
        self[name] = build_fmus(robot_named(name), self._factory.mktemp(name), native=True)
        return self[name]


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, RobotFmus]:
    return BuiltOnDemand(tmp_path_factory)


def off_nominal(robot: Robot, modulus: float, mass: float) -> Robot:
    """The robot with its modulus and mass multiplied."""
    cables = tuple(replace(cable, modulus=modulus * cable.modulus) for cable in robot.cables)
    return replace(robot, cables=cables, platform=replace(robot.platform, mass=mass * robot.platform.mass))


def errors(motion: CosimulationResult, path: Trajectory) -> Array:
    """Distance from the path over time, in m."""
    return np.asarray(np.linalg.norm(motion.position - path.position(motion.time), axis=1))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("name", NAMES)
def test_loop_around_the_model_is_stable_with_the_designed_poles(name: str) -> None:
    design = design_controller(robot_named(name))
    poles = control.feedback(design.plant, design.regulator, 1).poles()
    assert np.abs(poles).max() < 0.99
    # Separation: the poles are those of the feedback and those of the observer.
    size, count = len(design.observer), design.cable_count
    plant = design.plant
    wide = np.block([[plant.A, np.zeros((size + count, 3))], [plant.C[:3], np.eye(3)]])
    driven = np.vstack([plant.B, np.zeros((3, count))])
    apart = [
        np.linalg.eigvals(wide - driven @ design.feedback),
        np.linalg.eigvals(plant.A[:size, :size] - design.observer @ plant.C[:-count, :size]),
    ]
    assert np.sort(np.abs(poles)) == pytest.approx(np.sort(np.abs(np.concatenate(apart))), abs=1e-4)


def test_signals_of_plant_and_regulator_are_named_alike() -> None:
    design = design_controller(robot_named("three"))
    assert design.plant.input_labels == [f"winch_acceleration_{i}" for i in (1, 2, 3)]
    assert design.plant.output_labels == [
        *(f"position_{axis}" for axis in "xyz"),
        *(f"{name}_{i}" for name in ("tension", "winch_speed") for i in (1, 2, 3)),
    ]
    assert design.regulator.input_labels == design.plant.output_labels
    assert design.regulator.output_labels == design.plant.input_labels
    assert design.regulator.dt == design.plant.dt == 0.01


@pytest.mark.parametrize("name", NAMES)
def test_controller_at_work_is_the_regulator_with_one_sample_of_delay(name: str) -> None:
    robot = robot_named(name)
    design = design_controller(robot, ControlAim(tare=False))
    count, size = robot.cable_count, 50
    start = robot.platform.start
    times = np.linspace(0.0, 0.01 * size, size + 1)
    source = PathController(robot, design, Line(start, start, 1.0), times)
    noise = np.random.default_rng(3).standard_normal((size, 3 + count)) * 1e-4
    accelerations = []
    for k in range(size):
        shown = np.concatenate([start + noise[k, :3], np.zeros(3), design.linear.tensions + noise[k, 3:]])
        accelerations.append(source.interval(k, times[k], 0.01, shown)[0][1::2])
    seen = np.hstack([noise, source.speeds[:size]])
    expected = control.forced_response(design.regulator, times[:size], seen.T).outputs.T
    assert np.array(accelerations) == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert np.all(accelerations[0] == 0.0) and np.any(accelerations[1] != 0.0)


@pytest.mark.validate(but=["caroca"])
@pytest.mark.parametrize("name", NAMES)
def test_closed_loop_follows_a_path_that_the_open_loop_misses(name: str, fmus: dict[str, RobotFmus]) -> None:
    robot, path = robot_named(name), PATHS[name]
    closed = cosimulate_closed_loop(fmus[name], robot, design_controller(robot), path, path.duration + 1.0)
    opened = cosimulate(fmus[name], closed.time, ideal_winch_speeds(robot, path, closed.time))
    assert rms(errors(closed, path)) < 0.15 * rms(errors(opened, path))
    assert errors(closed, path)[-1] < 0.05 * errors(opened, path)[-1]
    assert closed.tension.min() > 0.9 * path_tensions(robot, path, closed.time).min()


@pytest.mark.validate
def test_noise_of_the_sensors_stays_noise(fmus: dict[str, RobotFmus]) -> None:
    name = "eight"
    robot, path = robot_named(name), PATHS[name]
    design = design_controller(robot)
    noisy = cosimulate_closed_loop(fmus[name], robot, design, path, path.duration + 1.0, ClosedLoopOptions(seed=5))
    again = cosimulate_closed_loop(fmus[name], robot, design, path, path.duration + 1.0, ClosedLoopOptions(seed=5))
    quiet = cosimulate_closed_loop(fmus[name], robot, design, path, path.duration + 1.0)
    assert np.array_equal(noisy.position, again.position)
    assert robot.sensors.position_noise is not None
    assert 0.0 < rms(noisy.position - quiet.position) < robot.sensors.position_noise
    assert noisy.tension.min() > 0.8 * quiet.tension.min()


def test_limit_of_speed_is_kept_and_nothing_winds_up(fmus: dict[str, RobotFmus]) -> None:
    robot, path = robot_named("three"), PATHS["three"]
    design = design_controller(robot, ControlAim(speed_limit=0.3))
    times = np.linspace(0.0, 8.0, 801)
    source = PathController(robot, design, path, times)
    motion = run_cosimulation(fmus["three"], Experiment(source, times, FixedStep(0.01)))
    assert np.abs(ideal_winch_speeds(robot, path, times)).max() > 0.35
    assert np.abs(source.speeds).max() == pytest.approx(0.3, abs=1e-12)
    assert errors(motion, path).max() > 0.05
    assert motion.tension.min() > 0.3 * design.linear.tensions.min()
    # Two seconds after the path has ended the lag is caught up, without a swing beyond the end.
    assert errors(motion, path)[times > 6.0].max() < 1e-3
    span = np.array([0.64, 0.7, 1.2])
    along = (motion.position - robot.platform.start) @ span / (span @ span)
    assert along.max() < 1.01


def test_speed_is_continuous_across_the_macro_steps_of_a_sample() -> None:
    robot = robot_named("three")
    design = design_controller(robot, ControlAim(period=0.02))
    times = np.linspace(0.0, 0.1, 6)
    source = PathController(robot, design, PATHS["three"], times, seed=1)
    shown = np.concatenate([robot.platform.start, np.zeros(3), design.linear.tensions])
    assert np.array_equal(source.interval(0, 0.0, 0.0, np.zeros(9))[0][0::2], np.zeros(3))
    last = np.zeros(3)
    for index in range(5):
        for part in (0.0, 0.01):
            begin, end = source.interval(index, times[index] + part, 0.01, shown)
            assert begin[0::2] == pytest.approx(last, abs=1e-12)
            assert end[0::2] == pytest.approx(begin[0::2] + 0.01 * begin[1::2], abs=1e-12)
            last = end[0::2]
    assert source.speeds.shape == (6, 3)


def test_expected_tensions_carry_weight_and_acceleration() -> None:
    robot, path = robot_named("eight"), PATHS["eight"]
    times = np.linspace(0.0, 2.0, 21)
    tensions, positions = path_tensions(robot, path, times), path.position(times)
    spans = np.array(robot.anchors)[None] - positions[:, None]
    units = spans / np.linalg.norm(spans, axis=2, keepdims=True)
    force = np.einsum("ki,kia->ka", tensions, units)
    assert force == pytest.approx(60.0 * (path.acceleration(times) + np.array([0.0, 0.0, 9.81])), abs=1e-8)
    assert tensions[0] == pytest.approx(design_controller(robot).linear.tensions)


def test_path_that_asks_a_cable_to_push_is_refused(fmus: dict[str, RobotFmus]) -> None:
    robot = robot_named("three")
    away = Line((28.86, 0.0, 5.0), (-20.0, 0.0, 5.0), 30.0)
    with pytest.raises(UnreachableError, match="cable 3 would need -"):
        cosimulate_closed_loop(fmus["three"], robot, design_controller(robot), away, 30.0)


def test_controller_of_another_robot_is_refused(eight_fmus: RobotFmus) -> None:
    three = robot_named("three")
    with pytest.raises(InputError, match="three: has 3 cables, the controller 3, the FMUs 8; give those of one robot"):
        cosimulate_closed_loop(eight_fmus, three, design_controller(three), PATHS["three"], 1.0)


@pytest.mark.validate
def test_payload_that_nobody_declared_is_found_at_the_start(tmp_path: Path) -> None:
    robot, path = robot_named("three"), PATHS["three"]
    built = build_fmus(off_nominal(robot, 1.0, 0.8), tmp_path, native=True)
    peaks = []
    for tare in (True, False):
        design = design_controller(robot, ControlAim(tare=tare))
        peaks.append(errors(cosimulate_closed_loop(built, robot, design, path, 5.0), path).max())
    assert peaks[0] < 5e-4
    assert peaks[1] > 1e-2


@pytest.mark.validate
def test_start_into_an_acceleration_is_not_taken_for_a_payload(three_fmus: RobotFmus) -> None:
    robot = paper_robot()
    ramp: Trajectory = WinchRamp(robot, 8.0)
    motion = cosimulate_closed_loop(three_fmus, robot, design_controller(robot), ramp, 3.0)
    assert errors(motion, ramp).max() < 1e-3


@pytest.mark.validate
def test_tension_stays_near_its_limits_where_the_path_asks_for_more(fmus: dict[str, RobotFmus]) -> None:
    robot = robot_named("three")
    quick = Line((28.86, 0.0, 5.0), (28.86, 0.0, 6.0), 1.2)
    mean = float(design_controller(robot).linear.tensions.mean())
    free = cosimulate_closed_loop(fmus["three"], robot, design_controller(robot), quick, 8.0)
    assert free.tension.max() > 1.4 * mean and free.tension.min() < 0.6 * mean
    aim = ControlAim(lowest_tension=0.75 * mean, highest_tension=1.25 * mean)
    held = cosimulate_closed_loop(fmus["three"], robot, design_controller(robot, aim), quick, 8.0)
    assert held.tension.max() < 1.27 * mean and held.tension.min() > 0.69 * mean
    assert errors(held, quick)[-1] < 1e-4


@pytest.mark.validate
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("modulus", "mass"), [(1.32, 1.0), (1.32, 0.8), (1.0, 1.2)])
def test_design_holds_another_modulus_and_payload(name: str, modulus: float, mass: float, tmp_path: Path) -> None:
    robot, path = robot_named(name), PATHS[name]
    built = build_fmus(off_nominal(robot, modulus, mass), tmp_path, native=True)
    motion = cosimulate_closed_loop(
        built, robot, design_controller(robot), path, path.duration + 3.0, ClosedLoopOptions(seed=2)
    )
    assert motion.tension.min() > 0.0
    assert errors(motion, path)[-50:].max() < 2e-3


@pytest.mark.validate
@pytest.mark.parametrize(("name", "path"), [("three", PAPER_HELIX), ("caroca", CAROCA_HELIX)])
def test_helices_of_the_paper(name: str, path: Helix, fmus: dict[str, RobotFmus]) -> None:
    robot = robot_named(name)
    design = design_controller(robot)
    closed = cosimulate_closed_loop(fmus[name], robot, design, path, path.duration + 2.0, ClosedLoopOptions(seed=1))
    opened = cosimulate(fmus[name], closed.time, ideal_winch_speeds(robot, path, closed.time))
    assert rms(errors(closed, path)) < 0.05 * rms(errors(opened, path))
    assert rms(errors(closed, path)) < 1e-3
    assert closed.tension.min() > 0.9 * path_tensions(robot, path, closed.time).min()
