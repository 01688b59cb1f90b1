"""Units, signs, order, axes and clocks that are not as declared are told by winch travel and positions."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.recordings.alternative_readings import LENGTH_UNITS
from tautwire.recordings.consistency import recording_mistakes, require_plausible
from tautwire.recordings.geometry_reading import recorded_poses
from tautwire.recordings.mistaken_motion import MAX_MISFIT, check_motion
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.kinematics import inverse_kinematics
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.pose_recordings import noisy, rotation_of, swinging_recording, wandering_recording
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot, octahedral_robot, underactuated_robot
from tests.support.robots import EXAMPLES, example
from tests.support.told_columns import assert_mended_by_told_lines, told_columns

Change = Callable[[Recording], Recording]
RADIUS = 0.05


def time_in(unit: float) -> Change:
    return lambda recording: replace(recording, time=recording.time / unit)


def speeds(factors: float | list[float]) -> Change:
    return lambda recording: replace(recording, winch_speed=recording.winch_speed * factors)


def speeds_swapped(recording: Recording) -> Recording:
    order = [1, 0, *range(2, recording.cable_count)]
    return replace(recording, winch_speed=recording.winch_speed[:, order])


def positions(factors: float | list[float], axes: tuple[int, ...] = (0, 1, 2)) -> Change:
    return lambda recording: replace(recording, position=recording.position[:, axes] * factors)


def another_origin(recording: Recording) -> Recording:
    return replace(recording, position=recording.position - recording.position[0])


def turned(recording: Recording) -> Recording:
    """Positions in a frame that is turned by 30 degrees about z."""
    cosine, sine = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return replace(recording, position=recording.position @ turn.T)


def tracker_late(recording: Recording) -> Recording:
    """The tracker's samples, each 0.8 s after the winches' of the same row."""
    rows = round(0.8 / float(np.median(np.diff(recording.time))))
    return replace(
        recording,
        time=recording.time[:-rows],
        winch_speed=recording.winch_speed[:-rows],
        position=recording.position[rows:],
        tension=recording.tension[rows:],
    )


def both(first: Change, second: Change) -> Change:
    return lambda recording: second(first(recording))


MISTAKES: dict[str, tuple[Change, str, str]] = {
    "time in ms": (time_in(1e-3), "if time is in ms", "multiply time by 0.001"),
    "time in us": (time_in(1e-6), "if time is in us", "multiply time by 1e-06"),
    "speeds in mm/s": (speeds(1e3), "are in mm/s", "multiply winch_speed_1 to winch_speed_"),
    "speeds in m/min": (speeds(60.0), "are in m/min", " by 0.01667"),
    "speeds of angles": (speeds(1.0 / RADIUS), "of drums with a radius of 0.0", "the drum's radius"),
    "all signs": (speeds(-1.0), "winch_speed_1 to winch_speed_{n} have the other sign", "multiply by -1"),
    "winches swapped": (speeds_swapped, "winches of cables 1 to {n} are winch_speed_2, winch_speed_1", "rename"),
    "positions in mm": (positions(1e3), "if x, y, z are in mm", "multiply x, y, z by 0.001"),
    "positions in cm": (positions(1e2), "if x, y, z are in cm", "multiply x, y, z by 0.01"),
    "axes in another order": (positions(1.0, (2, 0, 1)), "x, y, z are the recording's y, z, x", "write the columns"),
    "z downwards": (positions([1.0, -1.0, -1.0]), "x, y, z are the recording's x, -y, -z", "write the columns"),
    "another origin": (another_origin, "x, y, z have another origin, about [", "add that vector"),
    "clocks apart": (tracker_late, "the winches' clock is 0.7", "subtract that from the winches' times"),
    "time in days": (time_in(86_400.0), "if time is in d", "multiply time by 8.64e+04"),
    "counts a second": (speeds(1.3e4), "1 of theirs is 7.", "or better by the factor that follows"),
    "turns a second": (speeds(1.0 / (2.0 * np.pi * RADIUS)), "m if in turns/s", "what is recorded in one turn"),
    "another gear": (speeds(0.625), "or as of gears, drums or intervals of time 1.", "or better by the factor"),
    "positions in inches": (positions(1.0 / 0.0254), "if x, y, z are in in", "multiply x, y, z by 0.0254"),
    "positions in feet": (positions(1.0 / 0.3048), "if x, y, z are in ft", "multiply x, y, z by 0.3048"),
    "one axis in mm": (positions([1.0, 1.0, 1e3]), "if z is in mm", "multiply z by 0.001"),
    "a frame that is turned": (turned, "x, y, z are in a frame that is turned by about", "write R (x, y, z) + ["),
    "another frame": (both(another_origin, positions([1e3, -1e3, -1e3])), "are in mm and the robot file's", "add that"),
    "ms and mm": (both(time_in(1e-3), positions(1e3)), "x, y, z are in mm and time is in ms", "and multiply time"),
}


def shipped(name: str) -> tuple[Robot, Recording]:
    robot = example(name).as_modelled()
    return robot, read_recording(EXAMPLES / name / "check.csv", robot.cable_count)


def assert_told(error: RecordingError, mistake: tuple[Change, str, str], cable_count: int) -> None:
    _, cause, remedy = mistake
    assert cause.format(n=cable_count) in error.problem and remedy in error.hint
    assert re.match(r"winch travel does not match the (positions|poses): it is off by ", error.problem)


# Those that no line of a table mends.
WITHOUT_LINES = ("clocks apart", "a frame that is turned", "centre of mass")
WITH_LINES = [mistake for mistake in MISTAKES if mistake not in WITHOUT_LINES]


# Units alone are told alike of any number of cables; orders, signs, axes and frames are not.
ON_EIGHT = [mistake for mistake in MISTAKES if " in " not in mistake or mistake == "axes in another order"]


@pytest.mark.validate(but=["frame that is turned-three"])
@pytest.mark.parametrize(
    ("mistake", "name"), [*((each, "three") for each in WITHOUT_LINES[:2]), *((each, "eight") for each in ON_EIGHT)]
)
def test_a_mistake_is_told_with_its_cause_and_its_remedy(name: str, mistake: str) -> None:
    robot, recording = shipped(name)
    (error,) = recording_mistakes(robot, MISTAKES[mistake][0](recording))
    assert_told(error, MISTAKES[mistake], robot.cable_count)


@pytest.mark.validate(but=["all signs", "origin", "positions in mm", "days"])
@pytest.mark.parametrize("mistake", WITH_LINES)
def test_a_mistake_is_told_with_lines_that_mend_the_recording(tmp_path: Path, mistake: str) -> None:
    robot, recording = shipped("three")
    error = assert_mended_by_told_lines(robot, MISTAKES[mistake][0](recording), tmp_path)
    assert_told(error, MISTAKES[mistake], robot.cable_count)


@pytest.mark.validate(but=["2"])
@pytest.mark.parametrize("cable", [1, 2, 3])
def test_the_winch_with_the_other_sign_is_named(cable: int) -> None:
    robot, recording = shipped("three")
    factors = [-1.0 if number == cable else 1.0 for number in robot.cable_numbers]
    (error,) = recording_mistakes(robot, speeds(factors)(recording))
    assert f"if winch_speed_{cable} has the other sign" in error.problem


def test_the_radius_of_drums_whose_angle_was_recorded_is_measured() -> None:
    robot, recording = shipped("three")
    check = check_motion(robot, speeds(1.0 / RADIUS)(recording))
    assert check is not None
    assert check.readings[0].winding.radius == pytest.approx(RADIUS, rel=5e-3)


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_a_frame_is_told_with_the_rotation_that_turns_it_back(name: str) -> None:
    robot, recording = shipped(name)
    check = check_motion(robot, turned(recording))
    assert check is not None
    back = check.readings[0].geometry.positions(robot, recorded_poses(turned(recording)))
    size = np.ptp([*robot.anchors, robot.platform.start], axis=0).max()
    assert np.nanmax(np.abs(back - recording.position)) < 5e-3 * size


def test_a_rope_length_in_mm_is_told_by_its_column() -> None:
    robot, recording = shipped("three")
    recording = speeds(1e3)(recording)
    recording = replace(recording, rope_length=-recording.wound_lengths())
    (error,) = recording_mistakes(robot, recording)
    assert "rope_length_1 to rope_length_3 are in mm" in error.problem


def with_anchors(robot: Robot, change: Callable[[np.ndarray], np.ndarray]) -> Robot:
    anchors = [tuple(change(np.array(cable.anchor)).tolist()) for cable in robot.cables]
    cables = tuple(replace(cable, anchor=anchor) for cable, anchor in zip(robot.cables, anchors, strict=True))
    return replace(robot, cables=cables)


@pytest.mark.validate(but=["ft"])
@pytest.mark.parametrize("unit", ["ft", "in"])
def test_anchors_in_feet_are_told_beside_a_start_in_metres(unit: str) -> None:
    robot, recording = shipped("three")
    size = LENGTH_UNITS[unit]
    (error,) = recording_mistakes(with_anchors(robot, lambda anchor: anchor / size), recording)
    assert f"anchors in the robot file are in {unit}" in error.problem


def test_anchors_with_another_origin_than_the_start_are_told() -> None:
    robot, recording = shipped("three")
    (error,) = recording_mistakes(with_anchors(robot, lambda anchor: anchor - [28.0, 0.0, 5.0]), recording)
    assert "another origin, about [-28" in error.problem and "subtract it from the anchors" in error.hint


def test_anchors_and_positions_in_mm_are_told_beside_speeds_in_metres() -> None:
    robot, recording = shipped("three")
    cables = tuple(replace(c, anchor=tuple(1e3 * x for x in c.anchor)) for c in robot.cables)
    start = tuple(1e3 * x for x in robot.platform.start)
    in_mm = replace(robot, cables=cables, platform=replace(robot.platform, start=start))
    error, *_ = recording_mistakes(in_mm, positions(1e3)(recording))
    assert "if x, y, z are in mm and anchors in the robot file are in mm" in error.problem


@pytest.mark.parametrize("with_start", [False, True])
def test_anchors_in_mm_are_told(with_start: bool) -> None:
    robot, recording = shipped("caroca")
    cables = tuple(
        replace(cable, anchor=(1e3 * cable.anchor[0], 1e3 * cable.anchor[1], 1e3 * cable.anchor[2]))
        for cable in robot.cables
    )
    start = tuple((1e3 if with_start else 1.0) * coordinate for coordinate in robot.platform.start)
    in_mm = replace(robot, cables=cables, platform=replace(robot.platform, start=start))
    (error,) = recording_mistakes(in_mm, recording)
    assert "anchors in the robot file are in mm" in error.problem
    all_in_mm = replace(recording, position=1e3 * recording.position, winch_speed=1e3 * recording.winch_speed)
    (error,) = recording_mistakes(in_mm, all_in_mm)
    assert "all lengths alike seem to be in mm" in error.hint


def test_readings_that_fit_equally_are_all_told() -> None:
    robot, recording = shipped("three")
    (error,) = recording_mistakes(robot, speeds_swapped(recording))
    assert "winch_speed_2, winch_speed_1, winch_speed_3, or if the robot file's x, y, z are" in error.problem


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_a_correct_recording_is_not_refused(name: str) -> None:
    robot, recording = shipped(name)
    require_plausible(robot, recording)
    check = check_motion(robot, recording)
    assert check is not None and check.misfit < 0.01


@pytest.mark.validate
@pytest.mark.parametrize(
    "effects",
    [
        {"drum": {"radius_ratio": 1.08}},
        {"drum": {"radius_ratio": 0.9, "cables": [2]}},
        {"modulus": {"modulus": 4e9}},
        {"sensor_delay": {"seconds": 0.1, "outputs": "position"}},
    ],
    ids=str,
)
def test_effects_are_not_taken_for_mistakes(effects: dict[str, Any]) -> None:
    robot = example("three").as_modelled()
    assert recording_mistakes(robot, recorded("three", 3, effects)) == ()


def winding_of(
    robot: Robot, position: np.ndarray, time: np.ndarray, gain: float = 1.0, delay: float = 0.0
) -> Recording:
    """Positions, and winches whose travel is that of the ropes over the gain, seen by a tracker that is late."""
    lengths = np.linalg.norm(np.array(robot.anchors) - position[:, None], axis=2)
    late = np.column_stack([np.interp(time - delay, time, column) for column in position.T])
    speed = -np.gradient(lengths, time, axis=0) / gain
    return Recording("log.csv", time, speed, np.full(lengths.shape, np.nan), late)


def along_z(robot: Robot, amplitude: float, period: float, time: np.ndarray) -> np.ndarray:
    return np.array(robot.platform.start) + np.outer(amplitude * np.sin(2.0 * np.pi * time / period), [0.0, 0.3, 1.0])


@pytest.mark.validate(but=["0.3-three"])
@pytest.mark.parametrize("name", ["three", "eight"])
@pytest.mark.parametrize(("period", "delay"), [(2.1, 0.1), (3.07, 0.12), (4.9, 0.3)])
def test_a_small_delay_in_a_periodic_motion_is_no_clock(name: str, period: float, delay: float) -> None:
    robot, time = example(name).as_modelled(), np.arange(4001) / 100.0
    recording = winding_of(robot, along_z(robot, 0.1, period, time), time, delay=delay)
    check = check_motion(robot, recording)
    assert check is not None and check.misfit > MAX_MISFIT
    assert recording_mistakes(robot, recording) == ()


@pytest.mark.validate(but=["-1.0"])
@pytest.mark.parametrize("gain", [-1.0, 0.5, 1.5, 2.0])
def test_a_platform_that_swings_is_not_judged_by_its_winches(gain: float) -> None:
    """Near its lowest mode, 1.6 Hz with such ropes, the platform moves otherwise than the winches."""
    robot = example("caroca").as_modelled()
    soft = replace(robot, cables=tuple(replace(cable, modulus=5e8) for cable in robot.cables))
    time = np.arange(4001) / 100.0
    recording = winding_of(soft, along_z(soft, 0.02, 0.4, time), time, gain)
    assert recording_mistakes(soft, recording) == ()
    assert gain != -1.0 or recording_mistakes(robot, recording)


@pytest.mark.validate(but=["2.0"])
@pytest.mark.parametrize("gain", [1.35, 2.0])
def test_ropes_that_give_are_no_drums(gain: float) -> None:
    robot, time = example("three").as_modelled(), np.arange(4001) / 100.0
    assert recording_mistakes(robot, winding_of(robot, along_z(robot, 0.5, 9.0, time), time, gain)) == ()


@pytest.mark.validate
def test_a_ratio_that_differs_by_cable_or_in_time_is_no_gear() -> None:
    robot, recording = shipped("three")
    assert recording_mistakes(robot, speeds([0.6, 0.65, 0.7])(recording)) == ()
    varying = 0.65 + 0.2 * np.sin(recording.time / 2.0)[:, None]
    assert recording_mistakes(robot, replace(recording, winch_speed=varying * recording.winch_speed)) == ()
    assert recording_mistakes(robot, speeds([0.647, 0.65, 0.652])(recording)) != ()


def test_a_unit_is_told_before_the_factor_near_it_that_fits_a_little_better() -> None:
    robot, recording = shipped("three")
    check = check_motion(robot, speeds([1000.0, 1030.0, 1015.0])(recording))
    assert check is not None
    told, fitted = (reading.mistakes[0].cause for reading in check.readings)
    assert told.endswith("are in mm/s") and "are not speeds of ropes in m/s" in fitted


def test_an_effect_that_the_robot_file_declares_is_no_mistake() -> None:
    robot, recording = shipped("three")
    moved = another_origin(recording)
    x, y, z = (-coordinate for coordinate in recording.position[0])
    offset = {"position_offset_x": x, "position_offset_y": y, "position_offset_z": z}
    assert recording_mistakes(robot, moved)
    assert recording_mistakes(robot.with_effect(EffectSetting("sensor_offset", offset)), moved) == ()


@pytest.mark.validate(but=["payload"])
@pytest.mark.parametrize("name", ["drum", "payload"])
def test_winches_are_judged_beside_declared_drums_and_payloads(name: str) -> None:
    robot, recording = shipped("three")
    values = {"drum": {"radius_ratio": 1.02}, "payload": {"mass": 40.0}}[name]
    robot = robot.with_effect(EffectSetting(name, values, robot.cable_numbers if name == "drum" else ()))
    assert recording_mistakes(robot, recording) == ()
    (error,) = recording_mistakes(robot, speeds(-1.0)(recording))
    assert "winch_speed_1 to winch_speed_3 have the other sign" in error.problem


def test_tensions_are_not_judged_beside_a_declared_payload() -> None:
    robot, recording = shipped("three")
    recording = replace(recording, tension=1e-3 * recording.tension)
    assert recording_mistakes(robot, recording)
    assert recording_mistakes(robot.with_effect(EffectSetting("payload", {"mass": 40.0})), recording) == ()


@pytest.mark.validate
def test_a_sign_and_an_order_are_told_by_the_columns_of_the_file() -> None:
    robot, recording = shipped("caroca")
    changed = speeds_swapped(speeds([-1.0, 1.0, 1.0])(recording))
    (error,) = recording_mistakes(robot, changed)
    assert "if winch_speed_2 has the other sign and the winches of cables 1 to 3 are winch_speed_2" in error.problem


def test_what_no_reading_mends_is_left_to_the_trace() -> None:
    robot, recording = shipped("three")
    generator = np.random.default_rng(1)
    recording = replace(recording, winch_speed=generator.normal(size=recording.winch_speed.shape))
    check = check_motion(robot, recording)
    assert check is not None and check.misfit > MAX_MISFIT and check.readings == ()


def test_nothing_is_said_where_nothing_moves_or_no_position_was_measured() -> None:
    robot, recording = shipped("three")
    assert check_motion(robot, speeds(0.0)(recording)) is None
    assert check_motion(robot, positions(np.nan)(recording)) is None
    assert check_motion(robot, positions([np.nan, np.nan, 1.0])(recording)) is None
    generator = np.random.default_rng(1)
    still = recording.position[0] + 1e-3 * generator.normal(size=recording.position.shape)
    assert check_motion(robot, replace(recording, position=still)) is None


@pytest.mark.validate
def test_some_wild_positions_do_not_hide_a_mistake() -> None:
    robot, recording = shipped("three")
    position = recording.position.copy()
    position[::37] += 3.0
    (error,) = recording_mistakes(robot, speeds(-1.0)(replace(recording, position=position)))
    assert "have the other sign" in error.problem


@pytest.mark.validate
def test_the_stretch_of_a_long_recording_where_winches_move_is_taken() -> None:
    robot, recording = shipped("three")
    interval, count = float(np.median(np.diff(recording.time))), 20_000
    at_rest = replace(
        recording,
        time=np.arange(count + recording.sample_count) * interval,
        winch_speed=np.vstack((np.zeros((count, 3)), -recording.winch_speed)),
        tension=np.vstack((np.tile(recording.tension[0], (count, 1)), recording.tension)),
        position=np.vstack((np.tile(recording.position[0], (count, 1)), recording.position)),
    )
    with pytest.raises(RecordingError, match="have the other sign"):
        require_plausible(robot, at_rest)


def planar(robot: Robot) -> Robot:
    """The robot with all anchors and the start in the plane y = 0."""
    cables = tuple(replace(cable, anchor=(cable.anchor[0], 0.0, cable.anchor[2])) for cable in robot.cables)
    x, _, z = robot.platform.start
    return replace(robot, cables=cables, platform=replace(robot.platform, start=(x, 0.0, z)))


def planar_recording(robot: Robot) -> Recording:
    """Positions on a curve in the plane, and the winch speeds that inextensible ropes have there."""
    time = np.arange(2001) / 100.0
    offset = np.column_stack((0.3 * np.sin(time), 0.0 * time, 0.2 * np.sin(1.7 * time)))
    position = np.array(robot.platform.start) + offset
    lengths = np.linalg.norm(np.array(robot.anchors) - position[:, None], axis=2)
    return Recording("plane.csv", time, -np.gradient(lengths, time, axis=0), np.full(lengths.shape, np.nan), position)


def test_a_planar_robot_may_have_noise_across_its_plane() -> None:
    robot = planar(example("caroca").as_modelled())
    recording = planar_recording(robot)
    position = recording.position.copy()
    position[:, 1] += 5.0 + np.linspace(0.0, 1.0, len(position))
    require_plausible(robot, replace(recording, position=position))
    position[:, 1] = np.nan
    require_plausible(robot, replace(recording, position=position))


def test_a_planar_robot_whose_tracker_calls_its_plane_x_y_is_told() -> None:
    robot = planar(example("caroca").as_modelled())
    (error,) = recording_mistakes(robot, positions(1.0, (0, 2, 1))(planar_recording(robot)))
    assert "the robot file's x, y, z are the recording's x, z, y" in error.problem


def quaternions(columns: tuple[int, ...], signs: tuple[int, ...] = (1, 1, 1, 1)) -> Change:
    return lambda recording: replace(recording, orientation=(recording.orientation * signs)[:, columns])


def of_centre_of_mass(recording: Recording) -> Recording:
    arm = rotation_of(recording.orientation).apply(CRANE.platform.centre_of_mass)
    return replace(recording, position=recording.position + arm)


def y_upwards(recording: Recording) -> Recording:
    orientation = recording.orientation[:, [0, 1, 3, 2]] * [1, 1, 1, -1]
    return replace(recording, position=recording.position[:, [0, 2, 1]] * [1, 1, -1], orientation=orientation)


CRANE = crane_robot()
SCALAR_LAST, INVERSE = quaternions((1, 2, 3, 0)), quaternions((0, 1, 2, 3), (1, -1, -1, -1))
LAST = 'qw = { name = "qz" } and qx = { name = "qw" } and qy = { name = "qx" } and qz = { name = "qy" }'
NEGATIVE = "qx = { sign = -1 } and qy = { sign = -1 } and qz = { sign = -1 }"
POSE_MISTAKES: dict[str, tuple[Change, str, str]] = {
    "scalar last": (SCALAR_LAST, "if the quaternion is written as x, y, z, w", LAST),
    "world to platform": (INVERSE, "if the quaternion turns from the world's frame to the platform's", NEGATIVE),
    "both": (
        both(INVERSE, SCALAR_LAST),
        "is written as x, y, z, w and turns from the world's frame to the platform's",
        'qw = { name = "qz" } and qx = { name = "qw", sign = -1 } and qy = { name = "qx", sign = -1 } and qz = { name',
    ),
    "mm": (positions(1e3), "if x, y, z are in mm", "multiply x, y, z by 0.001"),
    "mm, world to platform": (both(positions(1e3), INVERSE), "platform's and x, y, z are in mm", NEGATIVE),
    "centre of mass": (of_centre_of_mass, "if x, y, z are those of the centre of mass", "record the frame's origin"),
    "y upwards": (y_upwards, "robot file's x, y, z are the recording's x, -z, y", "and qx, -qz, qy as qx, qy, qz"),
    "another origin": (another_origin, "x, y, z have another origin, about [", "add that vector"),
    "time in ms": (time_in(1e-3), "if time is in ms", "multiply time by 0.001"),
    "all signs": (speeds(-1.0), "winch_speed_1 to winch_speed_8 have the other sign", "multiply by -1"),
    "winches swapped": (speeds_swapped, "winches of cables 1 to 8 are winch_speed_2, winch_speed_1", "rename"),
}


@pytest.mark.validate
def test_poses_of_the_centre_of_mass_are_told_with_their_remedy() -> None:
    mistake = POSE_MISTAKES["centre of mass"]
    (error,) = recording_mistakes(CRANE, mistake[0](noisy(wandering_recording(CRANE))))
    assert_told(error, mistake, 8)


@pytest.mark.validate(but=["both"])
@pytest.mark.parametrize("mistake", [mistake for mistake in POSE_MISTAKES if mistake not in WITHOUT_LINES])
def test_a_mistake_in_poses_is_told_with_lines_that_mend_the_recording(tmp_path: Path, mistake: str) -> None:
    change = POSE_MISTAKES[mistake][0]
    error = assert_mended_by_told_lines(CRANE, change(noisy(wandering_recording(CRANE))), tmp_path)
    assert_told(error, POSE_MISTAKES[mistake], 8)


@pytest.mark.validate(but=["world to platform"])
@pytest.mark.parametrize("mistake", ["scalar last", "world to platform"])
def test_a_small_rotation_tells_mistaken_quaternions(mistake: str) -> None:
    change, cause, _ = POSE_MISTAKES[mistake]
    recording = noisy(wandering_recording(CRANE, travel=0.5, angle=0.012))
    if mistake == "world to platform":
        check = check_motion(CRANE, change(recording))
        assert check is not None and check.misfit < MAX_MISFIT
    (error,) = recording_mistakes(CRANE, change(recording))
    assert cause in error.problem


@pytest.mark.validate
@pytest.mark.parametrize("unit", ["mm", "cm"])
def test_attachments_in_another_unit_are_told(unit: str) -> None:
    factor = {"mm": 1e3, "cm": 1e2}[unit]
    cables = tuple(
        replace(cable, attachment=tuple(factor * coordinate for coordinate in cable.attachment))
        for cable in CRANE.cables
    )
    (error,) = recording_mistakes(replace(CRANE, cables=cables), noisy(wandering_recording(CRANE)))
    assert f"if attachments in the robot file are in {unit}" in error.problem
    assert f"multiply their coordinates by {1.0 / factor:g}" in error.hint


@pytest.mark.parametrize("robot", [crane_robot(), octahedral_robot()], ids=lambda robot: robot.name)
@pytest.mark.parametrize("start", ["at the declared start", "in motion"])
def test_a_correct_recording_of_poses_is_not_refused(robot: Robot, start: str) -> None:
    recording = noisy(wandering_recording(robot))
    recording = recording.part(137, 450) if start == "in motion" else recording
    require_plausible(robot, recording)
    check = check_motion(robot, recording)
    assert check is not None and check.misfit < 0.004


def test_a_platform_outside_of_its_robot_is_no_measure_of_motion() -> None:
    # Ropes to a platform in mm hardly change in length by what it moves across them.
    shown = both(speeds(1.08), positions(1e3))(noisy(wandering_recording(CRANE)))
    check = check_motion(CRANE, shown)
    assert check is not None and check.misfit == pytest.approx(1.0, abs=0.02)
    assert [mistake.cause for mistake in check.readings[0].mistakes] == ["x, y, z are in mm"]


@pytest.mark.validate
@pytest.mark.parametrize("gain", [0.92, 1.08])
def test_drums_of_rigid_platforms_are_not_taken_for_mistakes(gain: float) -> None:
    recording = noisy(wandering_recording(CRANE))
    assert recording_mistakes(CRANE, speeds(gain)(recording)) == ()
    assert recording_mistakes(CRANE, speeds([gain, *[1.0] * 7])(recording)) == ()


def test_poses_without_orientation_are_not_judged_by_the_winches() -> None:
    recording = wandering_recording(CRANE)
    unturned = replace(recording, orientation=np.full((recording.sample_count, 4), np.nan))
    assert check_motion(CRANE, speeds(-1.0)(unturned)) is None
    assert recording_mistakes(CRANE, unturned) == ()


def test_a_platform_that_swings_on_standing_winches_tells_mistaken_quaternions() -> None:
    robot = replace(underactuated_robot(), effects=())
    recording = swinging_recording(robot)
    assert recording_mistakes(robot, recording) == ()
    for mistake in ("scalar last", "world to platform"):
        change, cause, remedy = POSE_MISTAKES[mistake]
        (error,) = recording_mistakes(robot, change(recording))
        assert cause in error.problem and remedy in error.hint


@pytest.mark.validate
def test_lengths_and_speeds_in_mm_have_each_their_own_unit() -> None:
    robot, recording = shipped("three")
    wound = -1e3 * recording.wound_lengths()
    recording = replace(speeds(1e3)(recording), rope_length=np.where(np.arange(3) < 1, wound, np.nan))
    (error,) = recording_mistakes(robot, recording)
    told = told_columns(error.hint)
    assert told == {"rope_length_1": {"unit": "mm"}} | {f"winch_speed_{i}": {"unit": "mm/s"} for i in (2, 3)}


@pytest.mark.validate
def test_no_line_is_told_where_none_mends_the_recording() -> None:
    robot, recording = shipped("three")
    for mistake in WITHOUT_LINES[:2]:
        (error,) = recording_mistakes(robot, MISTAKES[mistake][0](recording))
        assert "[recording.columns]" not in error.hint


@pytest.mark.validate
def test_ropes_on_pulleys_are_checked_and_have_no_mistake() -> None:
    """Lengths by inverse kinematics, of pulleys of 0.2 m that swivel about axes of their own."""
    cables = tuple(replace(cable, swivel_axis=(0.6, 0.0, 0.8)) for cable in CRANE.cables)
    robot = replace(CRANE, cables=cables).with_effect(EffectSetting("pulley", {"radius": 0.2}, CRANE.cable_numbers))
    recording = wandering_recording(CRANE, duration=6.0)
    poses = zip(recording.position, recording.orientation, strict=True)
    lengths = np.array([inverse_kinematics(robot, position, quaternion) for position, quaternion in poses])
    wound = replace(recording, winch_speed=-np.gradient(lengths, recording.time, axis=0))
    without_tension = replace(wound, tension=np.full(lengths.shape, np.nan))
    check = check_motion(robot, without_tension)
    assert check is not None and check.misfit < 1e-3
    assert recording_mistakes(robot, without_tension) == ()
    (error,) = recording_mistakes(robot, speeds(-1.0)(without_tension))
    assert "have the other sign" in error.problem
