"""Co-simulated FMUs against the rig's own equations and against the laws as one model."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.component import Component
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.reference_simulation import integrate
from tautwire.robot.schema import EffectSetting, Platform, Robot
from tests.rig import RampProgram, SampledProgram, simulate
from tests.support.model_descriptions import with_descriptions
from tests.support.rig_robots import CORNERS, RAMP, rig_of
from tests.support.robots import NAMES, example, gentle_speeds, paper_robot, with_damping


def ramp_error(fmus: RobotFmus, robot: Robot, step: float) -> float:
    """Distance in m between FMUs and rig at the end of the paper's ramp."""
    speeds = np.clip(RAMP * CORNERS[:, None], -1.0, 1.0)
    motion = cosimulate(fmus, CORNERS, speeds, step)
    exact = simulate(rig_of(robot), None, RampProgram(RAMP, 1.0), CORNERS, rtol=1e-12, atol=1e-13)
    return float(np.linalg.norm(motion.position[-1] - exact.position[-1]))


@pytest.mark.validate(but=["08"])
@pytest.mark.parametrize(("step", "bound"), [(0.1, 5e-7), (0.05, 2e-8), (0.01, 1e-9)])
def test_the_papers_ramp_ends_where_the_rig_ends(three_fmus: RobotFmus, step: float, bound: float) -> None:
    assert ramp_error(three_fmus, paper_robot(), step) < bound


@pytest.mark.validate
@pytest.mark.parametrize(("name", "step"), [("caroca", 0.001), ("eight", 0.001), ("caroca", 0.01), ("eight", 0.01)])
def test_with_more_cables_the_step_errs_as_little(name: str, step: float, tmp_path: Path) -> None:
    robot = example(name)
    time, speed = gentle_speeds(robot, 1.0, 0.01)
    motion = cosimulate(build_fmus(robot, tmp_path), time, speed, step)
    exact = simulate(rig_of(robot), None, SampledProgram(time, speed), time, rtol=1e-12, atol=1e-13)
    reach = float(np.max(np.abs(exact.position - exact.position[0])))
    assert np.max(np.abs(motion.position - exact.position)) < 1e-9 * max(reach, 1.0)


@pytest.mark.validate
def test_steps_of_a_millisecond_add_up_to_nothing(three_fmus: RobotFmus) -> None:
    assert ramp_error(three_fmus, paper_robot(), 0.001) < 1e-9


@pytest.mark.validate
@pytest.mark.parametrize("law", ["logarithmic", "linear"])
def test_it_does_so_with_damping_and_either_law(tmp_path: Path, law: str) -> None:
    robot = paper_robot(damping=2.08e9, law=law)
    assert ramp_error(build_fmus(robot, tmp_path), robot, 0.01) < 1e-7


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("name", NAMES)
def test_every_example_follows_the_rig(name: str, tmp_path: Path) -> None:
    robot = example(name)
    time, speed = gentle_speeds(robot, 2.0, 0.01)
    motion = cosimulate(build_fmus(robot, tmp_path), time, speed, 0.005)
    exact = simulate(rig_of(robot), None, SampledProgram(time, speed), time)
    assert np.max(np.abs(motion.position - exact.position)) < 1e-8
    assert np.max(np.abs(motion.tension - exact.tension)) < 1e-3


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("name", NAMES)
def test_co_simulation_equals_the_model_in_memory(name: str, tmp_path: Path) -> None:
    robot = with_damping(example(name), 6e8).with_effect(EffectSetting("payload", {"mass": 3.0}))
    robot = robot.with_effect(EffectSetting("modulus", {"modulus": 8e10}, (2,)))
    time, speed = gentle_speeds(robot, 1.0, 0.02)
    motion = cosimulate(build_fmus(robot, tmp_path), time, speed, 0.005)
    whole = integrate(robot, time, speed)
    assert np.max(np.abs(motion.position - whole.position)) < 1e-8
    assert np.max(np.abs(motion.velocity - whole.velocity)) < 1e-6
    assert np.max(np.abs(motion.tension - whole.tension)) < 1e-3
    assert np.max(np.abs(motion.length - whole.length)) < 1e-8


@pytest.mark.validate
@pytest.mark.parametrize("effect", ["damping", "modulus", "payload"])
def test_an_effect_in_the_fmus_is_the_effect_in_the_rig(effect: str, tmp_path: Path) -> None:
    robot = example("three")
    values = {"damping": {"damping": 1.7e9}, "modulus": {"modulus": 0.9e11}, "payload": {"mass": 20.0}}[effect]
    cables = () if effect == "payload" else robot.cable_numbers
    time, speed = gentle_speeds(robot, 2.0, 0.02)
    motion = cosimulate(build_fmus(robot.with_effect(EffectSetting(effect, values, cables)), tmp_path), time, speed)
    exact = simulate(rig_of(robot), {effect: values}, SampledProgram(time, speed), time)
    assert np.max(np.abs(motion.position - exact.position)) < 1e-8
    assert np.max(np.abs(motion.tension - exact.tension)) < 1e-3


def test_at_rest_nothing_moves(eight_fmus: RobotFmus) -> None:
    time = np.array([0.0, 1.0, 2.0])
    motion = cosimulate(eight_fmus, time, np.zeros((3, 8)))
    assert np.max(np.abs(motion.position - motion.position[0])) < 1e-10
    assert np.max(np.abs(motion.tension - motion.tension[0])) < 1e-6


def test_elongation_is_the_papers(three_fmus: RobotFmus) -> None:
    speeds = np.clip(RAMP * CORNERS[:, None], -1.0, 1.0)
    motion = cosimulate(three_fmus, CORNERS, speeds)
    wound = np.concatenate(
        [np.zeros((1, 3)), np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(CORNERS)[:, None], axis=0)]
    )
    assert np.allclose(motion.elongation, motion.length - (motion.length[0] - wound), atol=1e-10)


def test_the_frame_has_the_columns_of_a_result_file(three_fmus: RobotFmus) -> None:
    frame = cosimulate(three_fmus, np.array([0.0, 0.01]), np.zeros((2, 3))).frame()
    numbered = [f"{name}_{i}" for name in ("tension", "length", "elongation", "strain") for i in (1, 2, 3)]
    assert list(frame.columns) == ["time", "x", "y", "z", "vx", "vy", "vz", *numbered]


def test_progress_ends_at_one(three_fmus: RobotFmus) -> None:
    fractions: list[float] = []
    cosimulate(three_fmus, np.linspace(0.0, 0.1, 11), np.zeros((11, 3)), progress=fractions.append)
    assert fractions == pytest.approx(np.arange(1, 11) / 10)


@pytest.mark.validate
def test_a_cable_may_go_slack_and_tight_again(tmp_path: Path) -> None:
    robot = replace(paper_robot(damping=2e8), platform=Platform(300.0, (28.86, 0.0, 5.0)))
    time = np.array([0.0, 0.05, 0.5, 0.55, 1.5])
    speed = np.zeros((5, 3))
    speed[1:3, 2] = -1.5
    motion = cosimulate(
        build_fmus(robot, tmp_path),
        np.linspace(0.0, 1.5, 151),
        np.array([np.interp(np.linspace(0.0, 1.5, 151), time, column) for column in speed.T]).T,
        0.002,
    )
    exact = simulate(
        rig_of(robot),
        None,
        SampledProgram(motion.time, np.array([np.interp(motion.time, time, column) for column in speed.T]).T),
        motion.time,
    )
    assert np.min(motion.tension) == 0.0
    assert np.max(np.abs(motion.position - exact.position)) < 1e-4


@pytest.mark.validate(but=["1e-06"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-7])
def test_steps_chosen_by_a_tolerance_keep_it(three_fmus: RobotFmus, tolerance: float) -> None:
    speeds = np.clip(RAMP * CORNERS[:, None], -1.0, 1.0)
    motion = cosimulate(three_fmus, CORNERS, speeds, tolerance=tolerance)
    exact = simulate(rig_of(paper_robot()), None, RampProgram(RAMP, 1.0), CORNERS, rtol=1e-12, atol=1e-13)
    assert np.max(np.abs(motion.position[-1] - exact.position[-1])) < tolerance
    assert motion.statistics.estimated_error is not None and motion.statistics.estimated_error <= tolerance
    assert motion.statistics.steps < 600


@pytest.mark.validate
@pytest.mark.parametrize(
    "changes",
    [
        {
            ' unit="m"': ' declaredType="Length"',
            "<LogCategories>": '<TypeDefinitions><SimpleType name="Length"><Real unit="m"/></SimpleType>'
            "</TypeDefinitions><LogCategories>",
        },
        {' unit="m"': ' unit="metre"', '<Unit name="m">': '<Unit name="metre">'},
        {' unit="m"': ""},
    ],
    ids=["declared type", "another name", "none"],
)
def test_lengths_count_for_the_tolerance_however_their_unit_is_stated(
    three_fmus: RobotFmus, tmp_path: Path, changes: dict[str, str]
) -> None:
    speeds = np.clip(RAMP * CORNERS[:, None], -1.0, 1.0)
    restated = cosimulate(with_descriptions(three_fmus, tmp_path, changes), CORNERS, speeds, tolerance=1e-4)
    usual = cosimulate(three_fmus, CORNERS, speeds, tolerance=1e-4)
    assert restated.statistics.estimated_error == usual.statistics.estimated_error
    assert restated.statistics.steps == usual.statistics.steps


def swing_energy(robot: Robot, motion: CosimulationResult) -> np.ndarray:
    """Kinetic, potential and elastic energy in J while the winches stand, logarithmic law."""
    axial = robot.cables[0].modulus * robot.cables[0].area
    kinetic = 0.5 * robot.platform.mass * np.sum(motion.velocity**2, axis=1)
    weight = robot.platform.mass * robot.gravity * motion.position[:, 2]
    tension = motion.tension[0]
    elastic = axial * (motion.length * motion.strain - motion.length) + tension * motion.length
    return np.asarray(kinetic + weight + np.sum(elastic, axis=1))


@pytest.mark.validate
def test_the_coupling_neither_makes_nor_eats_energy(three_fmus: RobotFmus) -> None:
    time = np.concatenate([[0.0, 0.5, 1.0], np.arange(1.05, 26.0, 0.05)])
    speed = np.zeros((len(time), 3))
    speed[1] = [0.3, -0.2, 0.25]
    motion = cosimulate(three_fmus, time, speed)
    free = time >= 1.0
    energy = swing_energy(paper_robot(), motion)[free]
    vibration = np.max(0.5 * 300.0 * np.sum(motion.velocity[free] ** 2, axis=1))
    assert np.max(np.abs(energy - energy[0])) < 1e-6 * vibration
    assert motion.statistics.energy_residual_share < 1e-9
    assert motion.statistics.warnings() == ()


@pytest.mark.validate(but=["None"])
@pytest.mark.parametrize("patience", [None, 60.0])
def test_a_run_that_begins_later_is_initialised_then(
    three_fmus: RobotFmus, patience: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    time, speed = gentle_speeds(example("three"), 0.1, 0.02)
    starts = set()
    initialize = Component.initialize

    def note(component: Component, start: float, *arguments: Any) -> None:
        starts.add(start)
        initialize(component, start, *arguments)

    early = cosimulate(three_fmus, time, speed, patience=patience)
    monkeypatch.setattr(Component, "initialize", note)
    late = cosimulate(three_fmus, time + 5.0, speed, patience=patience)
    assert late.position == pytest.approx(early.position, abs=1e-11)
    assert starts == ({5.0} if patience is None else set())
