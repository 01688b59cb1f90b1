"""Scales of winches, lags of positions and scales of load cells are told as notes, and only where they are hidden."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.cli.input_checks import check_files
from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.recording_notes import kinematic_scale_notes, recording_notes
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.folders import SHARED_RECORDINGS
from tests.support.pose_recordings import noisy, wandering_recording
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES, example

CRANE = crane_robot()


def notes(name: str, effects: dict[str, Any] | None = None) -> tuple[str, ...]:
    """Notes on what the rig records of an example robot with effects, which is no mistake."""
    robot, recording = example(name).as_modelled(), recorded(name, 3, effects)
    assert recording_mistakes(robot, recording) == ()
    return recording_notes(robot, recording)


def without_tensions(recording: Recording) -> Recording:
    return replace(recording, tension=np.full_like(recording.tension, np.nan))


def numbers(note: str) -> list[float]:
    """Numbers of a note behind the file's name."""
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", note.split(".csv: ")[1])]


@pytest.mark.parametrize("name", ["three", "eight", "fast", "caroca8", "ipanema"])
@pytest.mark.parametrize("has_tension", [True, False])
def test_recordings_that_hide_nothing_of_the_kind_have_no_note(name: str, has_tension: bool) -> None:
    robot = example(name).as_modelled()
    recording = read_recording(EXAMPLES / name / "check.csv", robot.cable_count)
    assert recording_notes(robot, recording if has_tension else without_tensions(recording)) == ()


@pytest.mark.validate(but=["'damping'", "'sensor_gain'"])
@pytest.mark.parametrize(
    ("name", "effects"),
    [
        ("three", {"modulus": {"modulus": 3e10}}),
        ("three", {"damping": {"damping": 3e10}}),
        ("three", {"sensor_gain": {"gain": 1.3, "outputs": "tension", "cables": [2]}}),
        ("eight", {"anchor": {"x": 0.2, "z": -0.3, "cables": [1]}}),
    ],
    ids=str,
)
def test_other_effects_are_not_taken_for_scales_or_lags(name: str, effects: dict[str, Any]) -> None:
    assert notes(name, effects) == ()


@pytest.mark.parametrize(
    ("ratios", "is_clock"), [([0.8, 0.8, 0.8], True), ([0.8, 0.8, 0.84], False), ([0.8, 1, 1], False)]
)
def test_drums_that_are_off_alike_may_be_times(ratios: list[float], is_clock: bool) -> None:
    robot = example("three").as_modelled()
    recording = read_recording(EXAMPLES / "three" / "check.csv", robot.cable_count)
    (note,) = recording_notes(robot, recording.with_winch_speed(recording.winch_speed * ratios))
    assert ("or times in another interval" in note) is is_clock


@pytest.mark.validate
def test_a_drum_of_another_radius_on_all_winches_is_told_with_each_factor() -> None:
    (note,) = notes("caroca", {"drum": {"radius_ratio": 0.94}})
    assert numbers(note)[:4] == pytest.approx([0.94, 0.94, 0.94, 0.001], abs=2e-3)
    assert "of what winches 1, 2 and 3 wound: drums of another radius" in note and "trace tells it as drum" in note
    robot, recording = example("caroca").as_modelled(), recorded("caroca", 3, {"drum": {"radius_ratio": 0.94}})
    (kinematic,) = kinematic_scale_notes(robot, recording)
    assert kinematic.endswith(note.split(": ")[1]) and "by kinematics alone" in kinematic
    drum = EffectSetting("drum", {"radius_ratio": 0.94}, robot.cable_numbers)
    assert kinematic_scale_notes(replace(robot, effects=(drum,)), recording) == ()


@pytest.mark.validate(but=["False-three"])
@pytest.mark.parametrize("name", ["three", "caroca"])
@pytest.mark.parametrize("has_tension", [True, False])
def test_one_drum_that_is_far_off_is_told_alone(name: str, has_tension: bool) -> None:
    recording = recorded(name, 3, {"drum": {"radius_ratio": 0.7, "cables": [2]}})
    (note,) = recording_notes(example(name).as_modelled(), recording if has_tension else without_tensions(recording))
    assert numbers(note)[0] == pytest.approx(0.7, abs=0.01) and "of what winch 2 wound: a drum of another" in note


@pytest.mark.validate
def test_a_pulley_is_no_scale() -> None:
    robot = example("eight").as_modelled()
    pulleys = recorded("eight", 3, {"pulley": {"radius": 0.3}})
    assert not any("rope moves" in note for note in recording_notes(robot, pulleys))


@pytest.mark.validate
def test_a_survey_that_makes_a_scale_itself_hides_it() -> None:
    robot, recording = example("caroca").as_modelled(), recorded("caroca", 3, {"drum": {"radius_ratio": 1.03}})
    surveyed = replace(robot, cables=tuple(replace(cable, anchor_uncertainty=0.3) for cable in robot.cables))
    assert "rope moves 1.0" in recording_notes(robot, recording)[0]
    assert recording_notes(surveyed, recording) == ()


@pytest.mark.validate
def test_a_sensor_delay_of_the_positions_is_told_with_its_lag() -> None:
    (note,) = notes("caroca", {"sensor_delay": {"seconds": 0.12, "outputs": "position"}})
    assert numbers(note)[0] == pytest.approx(0.12, abs=1e-3)
    assert " s (+- " in note and "behind the winches" in note and "trace tells it as sensor_delay" in note


@pytest.mark.parametrize(("name", "rows"), [("three", 4), ("three", 20), ("eight", 4), ("eight", 40)])
@pytest.mark.parametrize("has_tension", [True, False])
def test_positions_that_are_late_by_rows_are_told(name: str, rows: int, has_tension: bool) -> None:
    robot = example(name).as_modelled()
    recording = read_recording(EXAMPLES / name / "fit.csv", robot.cable_count)
    late = replace(recording.part(rows, recording.sample_count), position=recording.position[:-rows])
    (note,) = recording_notes(robot, late if has_tension else without_tensions(late))
    assert numbers(note)[0] == pytest.approx(0.01 * rows, abs=2e-3) and "behind the winches" in note


def test_positions_that_are_late_by_less_than_two_samples_are_not_told() -> None:
    robot, recording = example("eight").as_modelled(), read_recording(EXAMPLES / "eight" / "fit.csv", 8)
    late = replace(recording.part(1, recording.sample_count), position=recording.position[:-1])
    assert recording_notes(robot, late) == ()


@pytest.mark.validate
def test_positions_that_are_early_are_another_clock() -> None:
    recording = recorded("caroca", 3)
    early = replace(recording.part(0, recording.sample_count - 20), position=recording.position[20:])
    (note,) = recording_notes(example("caroca").as_modelled(), without_tensions(early))
    assert "0.099 s" in note or "0.100 s" in note
    assert "ahead of the winches" in note and "trace corrects the clock" in note and "sensor_delay" not in note


def test_a_lag_beside_drums_of_another_radius_is_told_beside_their_scale() -> None:
    robot, recording = example("eight").as_modelled(), read_recording(EXAMPLES / "eight" / "fit.csv", 8)
    late = replace(recording.part(10, recording.sample_count), position=recording.position[:-10])
    lag, scale = recording_notes(robot, late.with_winch_speed(late.winch_speed / 1.06))
    assert numbers(lag)[0] == pytest.approx(0.1, abs=1e-3)
    assert numbers(scale)[:8] == pytest.approx([1.06] * 8, abs=6e-3)


@pytest.mark.validate(only=["0.5-eight"])
@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
@pytest.mark.parametrize(("factor", "payload"), [(0.5, -0.5), (1.1, 0.1)])
def test_a_gain_of_all_load_cells_is_told_as_gain_or_payload(name: str, factor: float, payload: float) -> None:
    robot, recording = example(name).as_modelled(), recorded(name, 3)
    (note,) = recording_notes(robot, replace(recording, tension=factor * recording.tension))
    told_gain, told_payload = (float(re.findall(text, note)[0]) for text in (r"cells of ([\d.]+) \(", r"(-?[\d.]+) kg"))
    assert numbers(note)[0] == pytest.approx(100.0 * factor, rel=0.01)
    assert told_gain == pytest.approx(factor, rel=0.01)
    assert told_payload == pytest.approx(payload * robot.platform.mass, rel=0.05)
    assert "which statics alone cannot tell apart" in note


@pytest.mark.validate
def test_load_cells_that_all_show_too_little_are_told_with_the_offset() -> None:
    robot, recording = example("three").as_modelled(), recorded("three", 3, {"sensor_offset": {"force": -120.0}})
    (note,) = recording_notes(robot, recording)
    assert float(re.findall(r"offset of all load cells of (-[\d.]+) N", note)[0]) == pytest.approx(-120.0, abs=1.0)
    declared = replace(robot.sensors, tension_offset_uncertainty=60.0)
    assert recording_notes(replace(robot, sensors=declared), recording) == ()


def test_a_mass_of_which_the_file_says_that_it_is_uncertain_is_not_told() -> None:
    robot, recording = example("three").as_modelled(), recorded("three", 3, {"payload": {"mass": 30.0}})
    assert "a payload of 29." in recording_notes(robot, recording)[0]
    uncertain = replace(robot.platform, mass_uncertainty=15.0)
    assert recording_notes(replace(robot, platform=uncertain), recording) == ()


def test_platforms_that_turn_are_judged_too() -> None:
    recording = noisy(wandering_recording(CRANE))
    assert recording_notes(CRANE, recording) == ()
    (scale,) = recording_notes(CRANE, recording.with_winch_speed(recording.winch_speed / 0.9))
    assert numbers(scale)[:8] == pytest.approx([0.9] * 8, abs=5e-3)
    count = recording.sample_count - 10
    late = replace(
        recording.part(10, recording.sample_count),
        position=recording.position[:count],
        orientation=recording.orientation[:count],
    )
    assert numbers(recording_notes(CRANE, without_tensions(late))[0])[0] == pytest.approx(0.2, abs=2e-3)
    (carried,) = recording_notes(CRANE, replace(recording, tension=0.8 * recording.tension))
    assert numbers(carried)[0] == pytest.approx(80.0, abs=0.5)


def with_effect(robot: Robot, name: str) -> Robot:
    return replace(robot, effects=(EffectSetting(name, {}),))


@pytest.mark.validate
def test_effects_that_the_robot_file_declares_are_not_told_again() -> None:
    robot = example("caroca").as_modelled()
    wound = recorded("caroca", 3, {"drum": {"radius_ratio": 0.94}})
    carried = recorded("caroca", 3, {"payload": {"mass": 30.0}})
    assert recording_notes(with_effect(robot, "drum"), wound) == ()
    assert recording_notes(with_effect(robot, "payload"), carried) == ()


@pytest.mark.validate
def test_poses_inside_a_pulley_have_no_note_and_winches_that_stand_one_of_their_own() -> None:
    robot, recording = example("eight").as_modelled(), read_recording(EXAMPLES / "eight" / "check.csv", 8)
    inside = replace(robot, effects=(EffectSetting("pulley", {"radius": 0.1}, robot.cable_numbers),))
    position = recording.position.copy()
    position[0] = np.array(robot.anchors[0]) + np.array([0.0, 0.03, 0.0])
    assert recording_notes(inside, without_tensions(replace(recording, position=position))) == ()
    standing = recording.with_winch_speed(np.zeros_like(recording.winch_speed))
    (note,) = recording_notes(robot, standing)
    assert "all winches stand" in note


@pytest.mark.validate
def test_travel_that_nothing_explains_is_noted_by_check(tmp_path: Path) -> None:
    robot, recording = example("three"), read_recording(EXAMPLES / "three" / "check.csv", 3)
    speeds = recording.winch_speed.copy()
    speeds[:, 1] += 3.0 * np.sin(recording.time)
    file = tmp_path / "log.csv"
    recording.with_winch_speed(speeds).frame().to_csv(file, index=False)
    assert recording_mistakes(robot, recording.with_winch_speed(speeds)) == ()
    assert any("that of cable 2 most" in note for note in check_files(EXAMPLES / "three" / "robot.toml", file).notes)


@pytest.mark.validate
def test_check_says_the_scale_of_a_winch(tmp_path: Path) -> None:
    recording = recorded("three", 3, {"drum": {"radius_ratio": 0.7, "cables": [2]}})
    file = tmp_path / "log.csv"
    recording.frame().to_csv(file, index=False)
    checked = check_files(EXAMPLES / "three" / "robot.toml", file)
    assert checked.problems == () and any("rope moves 0.699" in note for note in checked.notes)


@pytest.mark.validate
@pytest.mark.skipif(not SHARED_RECORDINGS.is_dir(), reason="recordings that do not ship with the project")
@pytest.mark.parametrize("which", ["fit", "check"])
def test_drums_of_a_measured_robot_are_told(which: str) -> None:
    folder = SHARED_RECORDINGS / "real-planar"
    (note,) = (
        each for each in check_files(folder / "robot.toml", folder / f"{which}.csv").notes if "rope moves" in each
    )
    assert numbers(note)[:4] == pytest.approx([0.9415, 0.9363, 0.9432, 0.9390], abs=5e-3)


@pytest.mark.validate
def test_what_no_drum_does_is_no_scale() -> None:
    """Of positions in reverse, and of a tracker that shows one position."""
    robot, recording = example("cogiro"), read_recording(EXAMPLES / "cogiro" / "fit.csv", 8)
    reverse = replace(recording, position=recording.position[::-1], orientation=recording.orientation[::-1])
    (note,) = (each for each in recording_notes(robot, reverse) if "tensions carry" not in each)
    assert "winch travel is off the recorded positions by 166 %" in note
    still = replace(recording, position=np.tile(recording.position[0], (recording.sample_count, 1)))
    assert all("tensions carry" in note for note in recording_notes(robot, still))


def test_load_cells_that_carry_hardly_anything_have_no_payload() -> None:
    robot, recording = example("eight"), read_recording(EXAMPLES / "eight" / "fit.csv", 8)
    signs = np.where(np.arange(8) % 2, 1.0, -0.8)
    (note,) = recording_notes(robot, replace(recording, tension=signs * recording.tension))
    assert "no unit, sign, order, zero or gain that was tried explains it" in note and "payload" not in note
