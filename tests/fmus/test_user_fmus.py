"""Runs with FMUs that are not the project's: they go on with what these can do, and say with which error."""

from __future__ import annotations

import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pandas as pd
import pytest

from tautwire.cli import run
from tautwire.cosimulation.robot_cosimulation import RunError, cosimulate
from tautwire.cosimulation.robot_wiring import wire_robot
from tautwire.fmus.fmu_slots import SlotError, missing_user_fmu_ports
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import UserFmu
from tests.rig import RampProgram, simulate
from tests.support.own_fmus import LAG, compiler, falling_mass, lag_winch, packed, spring_cable
from tests.support.rig_robots import CORNERS, RAMP, rig_of
from tests.support.robots import paper_robot

SPEEDS = np.clip(RAMP * CORNERS[:, None], -1.0, 1.0)
needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")


class LaggedRamps:
    """What winches with a lag make of ramps up to 1 m/s, from the response to an endless ramp."""

    kinks = tuple(CORNERS[1:-1])

    def speed(self, time: float) -> np.ndarray:
        return RAMP * np.array([_ramp(time)[0] - _ramp(time - 1.0 / abs(rate))[0] for rate in RAMP])

    def travel(self, time: float) -> np.ndarray:
        return RAMP * np.array([_ramp(time)[1] - _ramp(time - 1.0 / abs(rate))[1] for rate in RAMP])


def _ramp(time: float) -> tuple[float, float]:
    """Response to a ramp of 1 m/s^2 from zero, and its integral."""
    if time <= 0.0:
        return 0.0, 0.0
    gone = LAG * (1.0 - np.exp(-time / LAG))
    return time - gone, 0.5 * time**2 - LAG * (time - gone)


@pytest.fixture(scope="module")
def platform(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return falling_mass(tmp_path_factory.mktemp("platform"))


@pytest.fixture(scope="module")
def winch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return lag_winch(tmp_path_factory.mktemp("winch"))


def all_winches(path: Path) -> tuple[UserFmu, ...]:
    return tuple(UserFmu(f"winch_{index}", path) for index in (1, 2, 3))


def end_errors(own: tuple[UserFmu, ...], exact: np.ndarray, folder: Path) -> list[float]:
    """Distance in m from where the rig ends, at steps of 10 ms and 1 ms."""
    fmus = build_fmus(replace(paper_robot(), fmus=own), folder)
    return [
        float(np.linalg.norm(cosimulate(fmus, CORNERS, SPEEDS, step).position[-1] - exact)) for step in (0.01, 0.001)
    ]


@pytest.mark.validate
def test_a_plain_platform_without_rates_and_states_is_of_second_order(platform: Path, tmp_path: Path) -> None:
    exact = simulate(rig_of(paper_robot()), None, RampProgram(RAMP, 1.0), CORNERS, rtol=1e-12, atol=1e-13)
    coarse, fine = end_errors((UserFmu("platform", platform),), exact.position[-1], tmp_path)
    assert coarse < 4e-4
    assert fine < 4e-6
    assert coarse / fine == pytest.approx(100.0, rel=0.1)


@pytest.mark.validate
@needs_compiler
def test_winches_from_a_c_compiler_are_of_second_order(winch: Path, tmp_path: Path) -> None:
    exact = simulate(rig_of(paper_robot()), None, LaggedRamps(), CORNERS, rtol=1e-12, atol=1e-13)
    coarse, fine = end_errors(all_winches(winch), exact.position[-1], tmp_path)
    assert coarse < 4e-4
    assert fine < 4e-6
    assert coarse / fine == pytest.approx(100.0, rel=0.1)


def test_missing_optional_features_are_noted(platform: Path, tmp_path: Path) -> None:
    fmus = build_fmus(replace(paper_robot(), fmus=(UserFmu("platform", platform),)), tmp_path)
    motion = cosimulate(fmus, CORNERS[:2], SPEEDS[:2])
    held, fixed, rate = motion.statistics.fallback_notes()
    assert held == "no input_time, so inputs are constant over each step, at their mean: FMU platform"
    assert fixed == "no saved states, so steps are not iterated, nor split at events: FMU platform"
    assert rate.startswith("no derivative of velocity, so it is estimated from past steps, with an error of about ")
    assert rate.endswith(" m/s2: FMU platform")
    assert motion.statistics.iterations == 0


@pytest.mark.validate
def test_a_minimal_cable_gets_the_start_position_and_its_missing_columns_are_omitted(tmp_path: Path) -> None:
    robot, own = paper_robot(), (UserFmu("cable_2", spring_cable(tmp_path)),)
    linear = [replace(cable, law="linear") if place == 1 else cable for place, cable in enumerate(robot.cables)]
    rig = rig_of(replace(robot, cables=tuple(linear)))
    exact = simulate(rig, None, RampProgram(RAMP, 1.0), CORNERS, rtol=1e-12, atol=1e-13)
    coarse, fine = end_errors(own, exact.position[-1], tmp_path / "fmus")
    assert coarse < 1e-5
    assert fine < 1e-8
    motion = cosimulate(build_fmus(replace(robot, fmus=own), tmp_path / "fmus"), CORNERS[:2], SPEEDS[:2])
    assert motion.missing_columns == ("tension_2", "length_2", "elongation_2", "strain_2")
    assert not set(motion.missing_columns) & set(motion.frame().columns)
    assert {"tension_1", "tension_3", "z"} < set(motion.frame().columns)
    assert np.isfinite(motion.frame().to_numpy()).all()


@pytest.mark.validate
@needs_compiler
def test_a_rate_worked_out_is_as_good_as_it_says(winch: Path, tmp_path: Path) -> None:
    fmus = build_fmus(replace(paper_robot(), fmus=all_winches(winch)), tmp_path)
    statistics = cosimulate(fmus, np.array([0.0, 1.0]), 0.5 * np.ones((2, 3)), 0.01).statistics
    doubt = float(statistics.fallback_notes()[1].partition("with an error of about ")[2].split()[0])
    # The winch jumps to 0.5 m/s with its lag: the rate is exp(-t / lag) 0.5 / lag.
    times = np.arange(0.01, 1.0, 0.01)
    shown = 0.5 * (1.0 - np.exp(-times / LAG))
    quartic = np.convolve(shown, np.array([25.0, -48.0, 36.0, -16.0, 3.0]) / 0.12, "valid")
    error = np.sqrt(np.mean((quartic - 0.5 / LAG * np.exp(-times[4:] / LAG)) ** 2))
    assert error < doubt < 1.0


@pytest.mark.validate
def test_the_command_line_says_it_with_the_error(
    platform: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(platform, tmp_path / "mine.fmu")
    write_robot(paper_robot(), tmp_path / "robot.toml")
    (tmp_path / "robot.toml").open("a").write('\n[fmu]\nplatform = "mine.fmu"\n')
    times = np.arange(0.0, 1.5, 0.02)
    recording = pd.DataFrame({"time": times} | {f"winch_speed_{i + 1}": RAMP[i] * times for i in range(3)})
    recording.to_csv(tmp_path / "speeds.csv", index=False)
    arguments = ["simulate", str(tmp_path / "robot.toml"), "--speeds", str(tmp_path / "speeds.csv")]
    assert run([*arguments, "--step", "0.02", "--out", str(tmp_path / "result.csv")]) == 0
    said = capsys.readouterr().err.splitlines()
    assert any("mine.fmu: 15 ports have no unit" in line for line in said)
    assert any("no saved states" in line for line in said)
    (estimate,) = [line for line in said if line.startswith("estimated error of the position")]
    estimated = float(estimate.partition(": ")[2].split()[0])
    exact = simulate(rig_of(paper_robot()), None, RampProgram(RAMP, 1.0), times)
    error = np.max(np.abs(pd.read_csv(tmp_path / "result.csv")[["x", "y", "z"]].to_numpy() - exact.position))
    assert error < estimated < 2.0 * error


@pytest.mark.validate
def test_a_platform_that_starts_elsewhere_is_refused(platform: Path, tmp_path: Path) -> None:
    robot = replace(paper_robot(), fmus=(UserFmu("platform", platform),))
    robot = replace(robot, platform=replace(robot.platform, start=(28.86, 0.0, 5.01)))
    with pytest.raises(SlotError, match=r"starts at 28\.86, 0, 5 m, the run at 28\.86, 0, 5\.01 m"):
        cosimulate(build_fmus(robot, tmp_path), CORNERS[:2], SPEEDS[:2])


@pytest.mark.validate
def test_a_platform_with_a_parameter_for_it_is_started_where_the_run_starts(tmp_path: Path) -> None:
    ours = build_fmus(paper_robot(), tmp_path / "ours").platform
    robot = replace(paper_robot(), fmus=(UserFmu("platform", ours),))
    robot = replace(robot, platform=replace(robot.platform, start=(28.86, 0.0, 6.0)))
    motion = cosimulate(build_fmus(robot, tmp_path / "moved"), np.array([0.0, 0.5]), np.zeros((2, 3)))
    assert motion.position[:, 2] == pytest.approx([6.0, 6.0], abs=1e-9)


@needs_compiler
def test_an_fmu_for_steps_of_one_length_gets_no_others(winch: Path, tmp_path: Path) -> None:
    single = {'canHandleVariableCommunicationStepSize="true"': ""}
    with zipfile.ZipFile(winch) as archive:
        library = archive.read(f"binaries/{fmpy.platform}/lag_winch.so")
    own = all_winches(packed(tmp_path / "single.fmu", library, single))
    fmus = build_fmus(replace(paper_robot(), fmus=own), tmp_path)
    cosimulate(fmus, np.array([0.0, 0.1, 0.2]), np.zeros((3, 3)))
    for arguments in ({"time": np.array([0.0, 0.1, 0.3])}, {"time": np.array([0.0, 0.1, 0.2]), "tolerance": 1e-6}):
        with pytest.raises(SlotError, match="steps of one length only"):
            cosimulate(fmus, winch_speed=np.zeros((3, 3)), **arguments)


def test_a_library_that_does_not_load_is_named(tmp_path: Path) -> None:
    own = (UserFmu("winch_1", packed(tmp_path / "text.fmu", b"no library")),)
    here = Path.cwd()
    with pytest.raises(RunError, match="FMU winch_1: loading its library gave"):
        cosimulate(build_fmus(replace(paper_robot(), fmus=own), tmp_path), CORNERS[:2], SPEEDS[:2])
    assert Path.cwd() == here


def test_a_tolerance_needs_saved_states(platform: Path, tmp_path: Path) -> None:
    fmus = build_fmus(replace(paper_robot(), fmus=(UserFmu("platform", platform),)), tmp_path)
    with pytest.raises(SlotError, match="cannot save its state"):
        cosimulate(fmus, CORNERS[:2], SPEEDS[:2], tolerance=1e-6)


def test_rates_of_inputs_count_only_together_with_a_stamp(three_fmus: RobotFmus, tmp_path: Path) -> None:
    assert missing_user_fmu_ports({"platform": three_fmus.platform, "cable_1": three_fmus.cables[0]}, 3) == frozenset()
    unstamped = tmp_path / "unstamped.fmu"
    with zipfile.ZipFile(three_fmus.cables[0]) as whole, zipfile.ZipFile(unstamped, "w") as changed:
        for entry in whole.namelist():
            changed.writestr(entry, whole.read(entry).replace(b'name="input_time"', b'name="another_time"'))
    lacking = {str(port) for port in missing_user_fmu_ports({"cable_1": unstamped}, 3)}
    assert {"cable_1.acceleration.x", "cable_1.winch_acceleration", "cable_1.middle_velocity.z"} < lacking
    assert not lacking & {"cable_1.force_rate.x", "cable_1.velocity.x", "cable_1.winch_speed", "cable_1.pull"}


def test_rates_that_a_platform_does_not_show_are_worked_out_and_its_middle_is_left_out(platform: Path) -> None:
    lacking = missing_user_fmu_ports({"platform": platform}, 3)
    assert {port.variable.partition(".")[0] for port in lacking if port.variable.endswith(".x")} >= {"acceleration"}
    wiring = wire_robot(3, (), lacking)
    assert wiring.missing_columns == ()
    assert not [wire for wire in wiring.connections if wire.target.variable.startswith("middle_")]
    assert {str(pair) for pair in wiring.derivative_connections if pair.target.component == "cable_2"} == {
        f"platform.velocity.{axis} -> cable_2.acceleration.{axis}" for axis in "xyz"
    }
