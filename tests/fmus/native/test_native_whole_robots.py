"""Whole robots as one native FMU, beside the rig, beside their equations, and beside their components coupled."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.errors import ArgumentError
from tautwire.fmus.fmu_slots import SlotError
from tautwire.fmus.packaging import RobotFmus, build_fmus, build_whole_fmu
from tautwire.robot.schema import Formula, Robot, UserFmu
from tautwire.robot.static_equilibrium import start_orientation, static_tensions
from tests.rig import SampledProgram, simulate
from tests.support.effect_cases import DELAYED, SEVERAL
from tests.support.effects import with_effects
from tests.support.fmus import Hand, in_hand
from tests.support.rig_robots import CORNERS, RAMP, rig_of
from tests.support.rigid_motion import integrated, rotation_matrices
from tests.support.rigid_robots import crane_robot
from tests.support.robots import LIMITED, example, paper_robot, with_winch
from tests.support.whole_robots import run_whole

Array = NDArray[np.float64]

FMI_DISCARD, FMI_ERROR = 2, 3
# A cable of it goes slack and tight again.
JERKED = paper_robot(damping=2e8)
RAMP_SPEEDS = np.clip(RAMP * CORNERS[:, None], -1.0, 1.0)
JERKS, JERK_SPEEDS = np.array([0.0, 0.05, 0.5, 0.55, 1.0, 1.5]), np.zeros((6, 3))
JERK_SPEEDS[1:3, 2] = -1.5
COMPLETE = with_winch(with_effects(example("three"), *SEVERAL, DELAYED), LIMITED)
TURNED = np.array([0.0, 1.0, 2.0, 3.0, 5.0, 7.0])
ACCELERATIONS, VELOCITIES = ("acceleration", "angular_acceleration"), ("velocity", "angular_velocity")
BOTH_FMI = pytest.mark.parametrize("fmi", [2, 3])


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's robot; its cables are those of the robot with damping too."""
    return build_whole_fmu(paper_robot(), tmp_path_factory.mktemp("plain"))


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot on winches with several effects and sensors that lag."""
    return build_whole_fmu(COMPLETE, tmp_path_factory.mktemp("complete"))


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rigid platform on eight cables."""
    return build_whole_fmu(crane_robot(), tmp_path_factory.mktemp("turning"))


@pytest.fixture(scope="module")
def ramp() -> tuple[Array, Array]:
    """Positions and tensions at the corners of the paper's ramp, by the rig."""
    exact = simulate(rig_of(paper_robot()), None, SampledProgram(CORNERS, RAMP_SPEEDS), CORNERS, rtol=1e-12, atol=1e-13)
    return exact.position, exact.tension


@pytest.fixture(scope="module")
def jerked() -> Array:
    """Positions of the robot with a cable that goes slack, by the rig."""
    exact = simulate(rig_of(JERKED), None, SampledProgram(JERKS, JERK_SPEEDS), JERKS, rtol=1e-12, atol=1e-13)
    return exact.position


def turning_speeds(robot: Robot) -> Array:
    """Winch speeds that move and turn a platform out and back, if ropes were inelastic."""

    def lengths(times: Array) -> Array:
        reach = 0.5 - 0.5 * np.cos(2.0 * np.pi * times / 7.0)
        turned = Rotation.from_rotvec(np.outer(reach, [0.03, -0.05, 0.08])).as_matrix()
        position = np.array(robot.platform.start) + np.outer(reach, [0.2, 0.1, 0.15])
        points = position[:, None] + np.array(robot.attachments) @ np.swapaxes(turned, 1, 2)
        return np.asarray(np.linalg.norm(np.array(robot.anchors) - points, axis=2))

    return (lengths(TURNED - 1e-5) - lengths(TURNED + 1e-5)) / 2e-5


@pytest.mark.parametrize("step", [0.01, 0.14])
def test_the_papers_ramp_of_seven_seconds_ends_where_the_rig_ends(
    plain: Path, ramp: tuple[Array, Array], step: float
) -> None:
    found = run_whole(plain, paper_robot(), CORNERS, RAMP_SPEEDS, step)
    assert np.max(np.abs(found[:, :3] - ramp[0])) < 1e-11
    assert np.max(np.abs(found[:, 6:9] - ramp[1])) < 1e-6


@pytest.mark.validate(but=["0.14"])
@pytest.mark.parametrize("step", [0.01, 0.14])
def test_a_platform_that_turns_is_that_of_the_components(
    turning: Path, native_crane_fmus: RobotFmus, step: float
) -> None:
    time, robot = TURNED[:3], crane_robot()
    speeds = turning_speeds(robot)[:3]
    found = run_whole(turning, robot, time, speeds, step)
    rows = cosimulate(native_crane_fmus, time, speeds, 0.01).frame().to_numpy()[:, 1:]
    assert np.max(np.abs(found[:, :13] - rows[:, :13])) < 1e-9
    assert np.max(np.abs(found[:, 13:] - rows[:, 13:])) < 1e-4


@pytest.mark.validate
@pytest.mark.parametrize("name", ["caroca8", "cogiro"])
def test_examples_on_eight_cables_follow_their_equations_for_seven_seconds(name: str, tmp_path: Path) -> None:
    robot = example(name)
    fmu, speeds = build_whole_fmu(robot, tmp_path), turning_speeds(robot)
    exact = integrated(robot, (np.array(start_orientation(robot)), static_tensions(robot)), TURNED, speeds)
    for step in (0.01, 0.14):
        found = run_whole(fmu, robot, TURNED, speeds, step)
        assert np.max(np.abs(found[:, :3] - exact.position)) < 1e-9
        assert np.max(np.abs(rotation_matrices(found[:, 6:10]) - exact.rotation)) < 1e-9
        assert np.max(np.abs(found[:, 10:13] - exact.angular_velocity)) < 1e-7
        assert np.max(np.abs(found[:, 13:21] - exact.tension)) < 1e-4
    assert np.ptp(exact.position[:, 0]) > 0.1


@pytest.mark.parametrize("step", [0.01, 0.14])
def test_a_cable_may_go_slack_and_tight_again_within_a_step(plain: Path, jerked: Array, step: float) -> None:
    def with_damping(hand: Hand) -> None:
        hand.set(**{f"cable_{i}__damping": 2e8 for i in (1, 2, 3)})

    found = run_whole(plain, JERKED, JERKS, JERK_SPEEDS, step, with_damping)
    assert np.min(found[:, 6:9]) == 0.0
    assert np.max(np.abs(found[:, :3] - jerked)) < 1e-9


@pytest.mark.validate
def test_nothing_is_wrong_with_its_description(complete: Path, turning: Path) -> None:
    assert [validate_fmu(str(path)) for path in (complete, turning)] == [[], []]


@pytest.mark.validate
def test_names_units_and_starts_are_those_of_the_components(complete: Path, turning: Path, tmp_path: Path) -> None:
    parts = build_fmus(COMPLETE, tmp_path, native=True, co_simulation_only=True).by_component
    whole = {v.name: v for v in fmpy.read_model_description(str(complete)).modelVariables}
    for component, path in parts.items():
        for part in fmpy.read_model_description(str(path)).modelVariables:
            if part.causality in ("parameter", "local"):
                twin = whole[f"{component}.{part.name}"]
                assert (twin.unit, twin.start, twin.min, twin.max, twin.nominal, twin.variability) == (
                    part.unit,
                    part.start,
                    part.min,
                    part.max,
                    part.nominal,
                    part.variability,
                )
    assert whole["tension_2"].unit == "N" and whole["length_3"].nominal == str(float(whole["length_3"].nominal))
    inputs = {name for name, variable in whole.items() if variable.causality == "input"}
    commands = {f"speed_command{rate}_{i}" for rate in ("", "_rate") for i in (1, 2, 3)}
    external = {f"external_force{rate}.{axis}" for rate in ("", "_rate") for axis in "xyz"}
    assert inputs == {"input_time", *commands, *external}
    with in_hand(turning) as hand:
        pose = hand.get(*(f"position.{axis}" for axis in "xyz"), *(f"orientation.{part}" for part in "wxyz"))
        assert pose == pytest.approx([*crane_robot().platform.start, *start_orientation(crane_robot())])
        tensions = hand.get(*(f"tension_{i}" for i in range(1, 9)))
        assert tensions == pytest.approx(static_tensions(crane_robot()))


def test_any_importer_runs_it_as_it_stands(plain: Path) -> None:
    rows = fmpy.simulate_fmu(str(plain), stop_time=1.0, start_values={"winch_speed_1": 0.1}, output=["length_1"])
    assert rows["time"][-1] == 1.0
    fallen = rows["length_1"][0] - rows["length_1"][-1]
    assert fallen == pytest.approx(0.1, abs=0.05)


@BOTH_FMI
@pytest.mark.validate(but=["2"])
def test_either_version_has_source_page_and_icon_and_gives_the_same_bits(fmi: int, plain: Path, tmp_path: Path) -> None:
    path = build_whole_fmu(paper_robot(), tmp_path, fmi=fmi)
    assert validate_fmu(str(path)) == []
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        page = archive.read("documentation/index.html").decode()
    assert path.name == "robot.fmu"
    assert {"sources/all.c", "sources/robot.c", "documentation/licenses/license.txt"} <= set(names)
    assert not [name for name in names if name.endswith(".py")]
    assert [name for name in names if name.endswith(".png")]
    for words in ("Its platform, its cables and its winches", "(m + sum of added masses) a", "T = E S ln(l / l_u)"):
        assert words in page
    assert "rigid body" not in page and "winch drive" not in page and "paper: platform and cables in one" in page
    one, other = (
        fmpy.simulate_fmu(str(each), stop_time=0.1, start_values={"winch_speed_1": 0.1}, output=["tension_1"])
        for each in (plain, path)
    )
    assert np.array_equal(one, other)
    assert np.ptp(one["tension_1"]) > 1.0


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
@pytest.mark.parametrize("name", ["complete", "turning"])
def test_its_source_is_plain_c99(name: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    with zipfile.ZipFile(request.getfixturevalue(name)) as archive:
        archive.extractall(tmp_path)
    headers = Path(fmpy.__file__).parent / "c-code"
    call = ["gcc", "-std=c99", "-pedantic-errors", "-fsyntax-only", f"-I{headers}", str(tmp_path / "sources" / "all.c")]
    subprocess.run(call, check=True)


def begin(robot: Hand) -> None:
    robot.set(speed_command_1=0.3, speed_command_rate_2=-0.4, external_force__x=50.0)
    robot.run()
    robot.step(0.0, 0.01)
    robot.step(0.01, 0.03)


def go_on(robot: Hand) -> list[float]:
    shown: list[float] = []
    for k in range(3):
        robot.set(input_time=0.06 + 0.02 * k, speed_command_1=0.3 + 0.1 * k, speed_command_3=0.02)
        robot.step(0.04 + 0.02 * k, 0.02)
        shown += robot.get(*robot.names("output"), *robot.names("local"))
    return shown


def test_saved_and_serialised_states_go_on_with_the_same_bits(complete: Path) -> None:
    with in_hand(complete) as robot, in_hand(complete) as other:
        begin(robot)
        saved = robot.fmu.getFMUstate()
        content = robot.fmu.serializeFMUstate(saved)
        first = go_on(robot)
        robot.fmu.setFMUstate(saved)
        assert go_on(robot) == first
        other.run()
        other.step(0.0, 0.5)
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(content))
        assert go_on(other) == first
        robot.fmu.freeFMUstate(saved)
        robot.fmu.reset()
        robot.fmu.setupExperiment(startTime=0.0)
        robot.fmu.enterInitializationMode()
        begin(robot)
        assert go_on(robot) == first
    assert len(set(first)) > len(first) / 2


def test_instances_side_by_side_do_not_touch_each_other(complete: Path) -> None:
    with in_hand(complete) as alone:
        begin(alone)
        expected = go_on(alone)
    with in_hand(complete) as robot, in_hand(complete) as other:
        begin(robot)
        other.set(cable_1__modulus=5e10, speed_command_2=-0.5)
        other.run()
        other.step(0.0, 0.2)
        assert go_on(robot) == expected


def test_inputs_set_at_the_end_of_a_step_are_interpolated(plain: Path) -> None:
    ends = []
    for step in (0.01, 0.2):
        with in_hand(plain) as robot:
            robot.set(winch_speed_1=0.0, winch_acceleration_1=0.2)
            robot.run()
            for k in range(round(1.0 / step)):
                end = (k + 1) * step
                speed, rate = 0.1 * np.sin(2.0 * end), 0.2 * np.cos(2.0 * end)
                robot.set(input_time=end, winch_speed_1=speed, winch_acceleration_1=rate)
                robot.step(k * step, step)
            ends.append(robot.get("position.x", "position.y", "position.z"))
    assert np.max(np.abs(np.subtract(*ends))) < 2e-6
    assert np.max(np.abs(np.subtract(*ends))) > 1e-9


def test_external_load_and_its_rate_act_as_on_the_platform_alone(turning: Path, native_crane_fmus: RobotFmus) -> None:
    sizes = {"external_force": 10.0, "external_force_rate": 1e5, "external_moment": 20.0, "external_moment_rate": 2e5}
    load = {f"{name}__{axis}": size * (1 + k) for name, size in sizes.items() for k, axis in enumerate("xyz")}
    shown = []
    for path in (turning, native_crane_fmus.platform):
        with in_hand(path) as hand:
            hand.set(**load)
            shown.append(hand.get(*(f"{each}.{axis}" for each in ACCELERATIONS for axis in "xyz")))
            hand.run()
            hand.step(0.0, 1e-4)
            shown.append(hand.get(*(f"{each}.{axis}" for each in VELOCITIES for axis in "xyz")))
    assert shown[0] == pytest.approx(shown[2], rel=1e-9)
    # The cables hardly pull back in so short a step.
    assert shown[1] == pytest.approx(shown[3], rel=1e-3)
    assert min(map(abs, shown[0])) > 1e-3


def test_the_error_follows_the_experiments_tolerance(plain: Path, ramp: tuple[Array, Array]) -> None:
    errors = []
    for tolerance in (1e-5, 1e-7, 1e-9):

        def with_tolerance(hand: Hand, tolerance: float = tolerance) -> None:
            hand.fmu.reset()
            hand.fmu.setupExperiment(startTime=0.0, tolerance=tolerance)
            hand.fmu.enterInitializationMode()

        found = run_whole(plain, paper_robot(), CORNERS, RAMP_SPEEDS, 0.5, with_tolerance)
        errors.append(np.max(np.abs(found[:, :3] - ramp[0])))
    assert errors[0] < 1e-6
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]


def test_derivatives_of_inputs_are_their_rates(plain: Path) -> None:
    with in_hand(plain) as robot:
        references = [robot.references[name] for name in ("winch_speed_2", "external_force.z")]
        robot.fmu.setRealInputDerivatives(references, [1, 1], [0.3, -5.0])
        assert robot.get("winch_acceleration_2", "external_force_rate.z") == [0.3, -5.0]


@pytest.mark.parametrize("speed", [1e7, 1e300])
def test_a_rope_reeled_in_past_its_end_discards_the_step_and_keeps_the_state(plain: Path, speed: float) -> None:
    with in_hand(plain) as robot:
        robot.run()
        robot.step(0.0, 0.01)
        names = [*robot.names("output"), *robot.names("local")]
        before = robot.get(*names)
        robot.set(winch_speed_1=speed)
        with pytest.raises(FMICallException) as caught:
            robot.step(0.01, 0.01)
        assert caught.value.status == FMI_DISCARD
        robot.set(winch_speed_1=0.0)
        assert robot.get(*names) == before
        robot.step(0.01, 0.01)


def test_a_step_whose_first_trial_leaves_the_domain_of_the_law_is_made_in_shorter_ones(plain: Path) -> None:
    with in_hand(plain) as robot:
        robot.set(winch_speed_1=1e5)
        robot.run()
        robot.step(0.0, 0.01)
        left, length = robot.get("cable_1.unstrained_length", "length_1")
        assert 0.0 < left < length


@pytest.mark.validate
def test_a_law_that_ends_within_a_step_discards_it(tmp_path: Path) -> None:
    formula = Formula("tension", "100 * sqrt(0.02 - travel)", (1,))
    with in_hand(build_whole_fmu(replace(paper_robot(), formulas=(formula,)), tmp_path)) as robot:
        robot.set(winch_speed_1=0.1)
        robot.run()
        robot.step(0.0, 0.15)
        with pytest.raises(FMICallException) as caught:
            robot.step(0.15, 0.15)
        assert caught.value.status == FMI_DISCARD


def test_impossible_values_are_refused(turning: Path) -> None:
    for values in ({"cable_3__modulus": -1.0}, {"winch_speed_2": float("nan")}, {"platform__inertia__xy": 1e6}):
        with in_hand(turning) as robot, pytest.raises(FMICallException) as caught:
            robot.set(**values)
            robot.run()
        assert caught.value.status == FMI_ERROR


@pytest.mark.parametrize("name", ["plain", "complete", "turning"])
def test_partial_derivatives_are_those_of_the_outputs(name: str, request: pytest.FixtureRequest) -> None:
    with in_hand(request.getfixturevalue(name)) as robot:
        robot.set(cable_1__damping=2e9)
        robot.run()
        robot.set(**{f"{each}": 0.01 for each in robot.names("input") if each.endswith(("speed_1", "command_2"))})
        robot.step(0.0, 0.05)
        names = robot.names("input")[1:]
        at = robot.get(*names)
        robot.set(**{each.replace(".", "__"): value for each, value in zip(names, at, strict=True)})
        exact, columns = robot.jacobian()[:, 1:], []
        for each, value in zip(names, at, strict=True):
            size, rows = (1.0 if each.startswith("external") else 1e-4), []
            for sign in (1.0, -1.0):
                robot.set(**{each.replace(".", "__"): value + sign * size})
                rows.append(robot.get(*robot.names("output")))
            robot.set(**{each.replace(".", "__"): value})
            columns.append(np.subtract(*rows) / (2.0 * size))
        found = np.array(columns).T
    # Differences of a tension's rate lose digits: it is large.
    assert np.all(np.abs(found - exact) <= 1e-5 * np.max(np.abs(exact), axis=1, keepdims=True) + 1e-7)
    assert np.max(np.abs(exact)) > 1e-3


def test_a_robot_with_a_users_fmu_is_refused(tmp_path: Path) -> None:
    mine = UserFmu("platform", tmp_path / "mine.fmu")
    with pytest.raises(SlotError, match=r"mine\.fmu: cannot be the FMU platform: the whole robot as one FMU"):
        build_whole_fmu(replace(paper_robot(), fmus=(mine,)), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("arguments", "words"), [({"fmi": 4}, "fmi: is 4"), ({"platforms": ["amiga"]}, "amiga")])
def test_arguments_are_checked(arguments: dict[str, object], words: str, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match=words):
        build_whole_fmu(paper_robot(), tmp_path, **arguments)  # type: ignore[arg-type]
