"""Faults of one winch or one exit point are told with their cause; effects on ropes are not taken for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.alternative_readings import winding_as_declared
from tautwire.recordings.consistency import _is_better, recording_mistakes
from tautwire.recordings.geometry_reading import IDENTITY, GeometryReading
from tautwire.recordings.mistaken_motion import MotionCheck, MotionReading
from tautwire.recordings.odd_winches import OddWinch, odd_winches
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.schema import Robot
from tests.support.robots import EXAMPLES, example

CABLE = 2
Change = Callable[[np.ndarray, np.ndarray], None]


def recorded(name: str = "three") -> Recording:
    return read_recording(EXAMPLES / name / "fit.csv", example(name).cable_count)


def with_speeds(change: Change) -> Recording:
    """The recording of the example after a change of winch speeds (N, 3) at its times (N,)."""
    recording = recorded()
    speeds = recording.winch_speed.copy()
    change(recording.time, speeds)
    return recording.with_winch_speed(speeds)


def stuck(time: np.ndarray, speeds: np.ndarray) -> None:
    speeds[time >= 12.0, CABLE - 1] = 0.0


def copied(time: np.ndarray, speeds: np.ndarray) -> None:
    speeds[:, CABLE - 1] = speeds[:, 2]


def clipped(time: np.ndarray, speeds: np.ndarray) -> None:
    largest = 0.3 * np.abs(speeds).max()
    # Noise lets it leave the limit in between, so that it is never held for long.
    is_seen = np.arange(len(speeds)) % 8 > 0
    speeds[is_seen] = np.clip(speeds[is_seen], -largest, largest)
    speeds[~is_seen] = np.clip(speeds[~is_seen], -0.99 * largest, 0.99 * largest)


def unsigned(time: np.ndarray, speeds: np.ndarray) -> None:
    speeds[:, CABLE - 1] = np.abs(speeds[:, CABLE - 1])


def lost(time: np.ndarray, speeds: np.ndarray) -> None:
    speeds[(time > 15.0) & (time <= 15.5), CABLE - 1] += 8.0


def wrapped(time: np.ndarray, speeds: np.ndarray) -> None:
    speeds[[900, 1700, 2500], CABLE - 1] += [400.0, -900.0, 700.0]


def one_in_mm(time: np.ndarray, speeds: np.ndarray) -> None:
    speeds[:, CABLE - 1] *= 1e3


FAULTS: dict[str, tuple[Change, str]] = {
    "another unit": (one_in_mm, "winch_speed_2 is in mm/s"),
    "stuck": (stuck, "winch_speed_2 stays at 0 from 12 to 40 s"),
    "copied": (copied, "winch_speed_2 repeats winch_speed_3"),
    "clipped": (clipped, "is clipped at"),
    "unsigned": (unsigned, "winch_speed_2 is never negative"),
    "counts lost": (lost, "its rope is"),
    "counts wrapped": (wrapped, "as where counts wrap"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_a_winch_is_told_with_its_cause(fault: str) -> None:
    change, cause = FAULTS[fault]
    recording = with_speeds(change)
    told = {odd.cable: odd for odd in odd_winches(example("three"), recording)}
    assert cause in told[CABLE].cause
    assert fault == "clipped" or set(told) == {CABLE}
    errors = recording_mistakes(example("three"), recording)
    assert any(f"winch travel of cable {CABLE} does not match" in error.problem for error in errors)


@pytest.mark.parametrize(
    ("change", "cause"),
    [(one_in_mm, "rope_length_2 is in mm"), (stuck, "the rate of rope_length_2 stays at 0 from 12")],
)
def test_a_fault_of_a_recorded_length_is_told_by_its_column(change: Change, cause: str) -> None:
    recording = with_speeds(change)
    lengths = replace(recording, rope_length=-recording.wound_lengths())
    (odd,) = odd_winches(example("three"), lengths)
    assert odd.cable == CABLE and cause in odd.cause and "rope_length_2" in odd.remedy


def test_a_winch_that_stands_with_a_slack_rope_is_no_fault() -> None:
    """From where the line is longest on it is shorter than the rope."""
    robot, recording = example("three"), recorded()
    begin = int(np.argmax(np.linalg.norm(recording.position - np.array(robot.anchors[2]), axis=1)))
    speeds = recording.winch_speed.copy()
    speeds[:, 2] = 0.0
    standing = recording.with_winch_speed(speeds).part(begin, recording.sample_count)
    assert odd_winches(robot, replace(standing, tension=np.full_like(standing.tension, np.nan))) == ()


@pytest.mark.parametrize("factor", [95.5, -95.5, 0.2, 3e4, -2.0])
def test_a_factor_that_is_no_drums_is_told_with_its_sign(factor: float) -> None:
    def scaled(time: np.ndarray, speeds: np.ndarray) -> None:
        speeds[:, CABLE - 1] *= factor

    (odd,) = odd_winches(example("three"), with_speeds(scaled))
    told = float(odd.cause.split("1 of it is ")[1].split(" m/s")[0])
    assert told == pytest.approx(1.0 / abs(factor), rel=0.01)
    assert ("has the other sign" in odd.cause) == (factor < 0.0)


def moved_anchor(robot: Robot, by: tuple[float, float, float]) -> Robot:
    cables = list(robot.cables)
    anchor = tuple(np.add(cables[CABLE - 1].anchor, by).tolist())
    cables[CABLE - 1] = replace(cables[CABLE - 1], anchor=anchor)
    return replace(robot, cables=tuple(cables))


def test_a_wrong_exit_point_is_told_with_where_it_fits() -> None:
    (odd,) = odd_winches(moved_anchor(example("three"), (18.0, -9.0, 0.0)), recorded())
    assert odd.cable == CABLE
    assert odd.remedy == "correct cable[2].anchor in the robot file"
    point = np.array([float(text) for text in odd.cause.split("[")[1].split("]")[0].split(",")])
    assert point == pytest.approx(example("three").anchors[CABLE - 1], abs=1.5)


@pytest.mark.parametrize(("share", "is_told"), [(0.12, False), (0.3, True)])
def test_an_exit_point_that_is_a_little_off_is_left_to_the_trace(share: float, is_told: bool) -> None:
    robot, recording = example("three"), recorded()
    points, start = np.array(robot.anchors), np.array(robot.platform.start)
    away = np.cross(points[2] - start, [0.0, 1.0, 0.0])
    points[2] += share * np.linalg.norm(points[2] - start) * away / np.linalg.norm(away)
    lengths = np.linalg.norm(points - recording.position[:, None], axis=2)
    odd = odd_winches(robot, recording.with_winch_speed(-np.gradient(lengths, recording.time, axis=0)))
    assert ["its exit point fits" in each.cause for each in odd] == [True] * is_told


def test_what_has_no_cause_is_left_to_the_trace() -> None:
    def other_motion(time: np.ndarray, speeds: np.ndarray) -> None:
        speeds[:, CABLE - 1] = np.std(speeds[:, CABLE - 1]) * np.sin(2.9 * time) * np.cos(0.41 * time)

    assert odd_winches(example("three"), with_speeds(other_motion)) == ()
    assert odd_winches(example("caroca"), recorded()) == ()


def test_a_winch_that_stands_while_its_rope_is_slack_is_no_fault() -> None:
    """From where its rope is longest on, the platform only comes nearer."""
    recording = recorded()
    wound = recording.wound_lengths()
    longest = np.argmin(wound, axis=0)
    cable = max(range(3), key=lambda c: np.ptp(wound[longest[c] :, c]))
    is_after = np.arange(recording.sample_count) >= longest[cable]
    speeds, tension = recording.winch_speed.copy(), recording.tension.copy()
    speeds[is_after, cable] = 0.0
    stands = recording.with_winch_speed(speeds)
    (odd,) = odd_winches(example("three"), stands)
    assert (odd.cable, "stays at 0" in odd.cause) == (cable + 1, True)
    tension[is_after, cable] = 0.0
    assert odd_winches(example("three"), replace(stands, tension=tension)) == ()


@pytest.mark.validate(but=["0.03"])
@pytest.mark.parametrize("size", [0.03, 0.3])
def test_a_platform_that_swings_on_soft_ropes_is_no_fault_of_winches_that_only_reel_in(size: float) -> None:
    """Trapezoids of speed have a largest value that many samples share, and no other sign."""
    robot, time = example("three"), np.arange(4001) / 100.0
    position = np.array(robot.platform.start) + np.outer(np.interp(time, [10.0, 30.0], [0.0, 1.0]), [2.0, 0.0, 6.0])
    lengths = np.linalg.norm(np.array(robot.anchors) - position[:, None], axis=2)
    speed = -np.gradient(lengths, time, axis=0)
    speed[:, CABLE - 1] = (
        np.interp(time, [9.9, 10.1, 29.9, 30.1], [0.0, 1.0, 1.0, 0.0]) * speed.mean(axis=0)[CABLE - 1] * 2
    )
    swinging = position + size * np.outer(np.sin(6.0 * time), [2.0, 1.0, 3.0])
    recording = Recording("log.csv", time, speed, np.full(lengths.shape, np.nan), swinging)
    assert np.mean(speed[:, CABLE - 1] == speed[:, CABLE - 1].max()) > 0.3 and speed[:, CABLE - 1].min() >= 0.0
    assert odd_winches(robot, recording) == ()


def test_ropes_that_move_alike_may_have_one_speed() -> None:
    """Of a motion in a plane of symmetry, seen by a tracker whose unit is wrong by a third."""
    robot, time = example("three"), np.arange(4001) / 100.0
    position = np.array(robot.platform.start) + np.outer(np.sin(0.7 * time), [1.0, 0.0, 1.0])
    mirrored = replace(
        robot, cables=(robot.cables[0], replace(robot.cables[0], anchor=_mirrored(robot)), robot.cables[2])
    )
    lengths = np.linalg.norm(np.array(mirrored.anchors) - position[:, None], axis=2)
    speed = -np.gradient(lengths, time, axis=0)
    speed[:, 1] = speed[:, 0]
    jumping = position + 4.0 * (np.sin(2.3 * time) ** 9)[:, None] * [0.0, 0.0, 1.0]
    recording = Recording("log.csv", time, speed, np.full(lengths.shape, np.nan), jumping)
    assert all("repeats" not in odd.cause for odd in odd_winches(mirrored, recording))


def _mirrored(robot: Robot) -> tuple[float, float, float]:
    x, y, z = robot.anchors[0]
    return (x, -y, z)


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_drums_drift_and_a_late_clock_are_no_faults(name: str) -> None:
    recording = recorded(name)
    late = np.column_stack(
        [np.interp(recording.time - 0.1, recording.time, column) for column in recording.winch_speed.T]
    )
    assert odd_winches(example(name), recording) == ()
    for speeds in (0.9 * recording.winch_speed, recording.winch_speed + 2e-3, late):
        assert odd_winches(example(name), recording.with_winch_speed(speeds)) == ()


def test_what_happened_in_a_gap_is_not_judged() -> None:
    recording = recorded()
    is_kept = (recording.time < 10.0) | (recording.time > 15.0)
    parts = {name: getattr(recording, name)[is_kept] for name in ("time", "winch_speed", "tension", "position")}
    assert odd_winches(example("three"), replace(recording, **parts, orientation=recording.orientation[is_kept])) == ()


@pytest.mark.parametrize(("count", "is_turned", "is_told"), [(1, True, True), (2, True, False), (1, False, False)])
def test_one_odd_winch_is_told_before_a_turned_frame_that_would_explain_it(
    count: int, is_turned: bool, is_told: bool
) -> None:
    turned = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    geometry = GeometryReading(rotation=turned if is_turned else IDENTITY)
    motion = MotionCheck(0.2, (MotionReading(geometry, winding_as_declared(3), 0.01, ()),))
    odd = [OddWinch(cable, 0.3, "its exit point is elsewhere", "correct it") for cable in range(1, count + 1)]
    assert _is_better(None, odd, motion) == is_told
