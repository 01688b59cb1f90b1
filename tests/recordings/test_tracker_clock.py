import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.errors import RecordingError
from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.tracker_clock import estimate_tracker_clock
from tests.support.robots import EXAMPLES, example
from tests.support.trackers import log_along, split, tracker_along

Array = NDArray[np.float64]

ROBOT = example("three")
START = np.array(ROBOT.platform.start)
TIMES = np.arange(0.0, 20.0, 1.0 / 120.0)


def wandering(time: Array) -> Array:
    """A path that does not repeat itself."""
    waves = [np.sin(0.9 * time) + 0.4 * np.sin(2.3 * time), np.sin(1.3 * time), 0.7 * np.sin(0.55 * time)]
    return START + np.column_stack(waves)


def repeated(time: Array) -> Array:
    """A path of period 5 s."""
    phase = 0.4 * np.pi * time
    return START + np.column_stack([np.sin(phase), np.cos(phase), 0.5 * np.sin(2.0 * phase)])


def steady(time: Array) -> Array:
    """A path along which all winches run at nearly constant speeds."""
    return START + 0.02 * time[:, None] * np.ones(3)


def refusal(log: Recording, tracker: Recording) -> RecordingError:
    with pytest.raises(RecordingError) as caught:
        estimate_tracker_clock(ROBOT, log, tracker)
    assert "clock_offset" in caught.value.hint
    return caught.value


def largest_clock_error(name: str, which: str, clock: tuple[float, float, float], has_tension: bool) -> float:
    """Largest error over a shipped recording, in s, with a tracker of so many samples per second, offset and rate."""
    robot, (samples_per_second, offset, rate) = example(name), clock
    recording = read_recording(EXAMPLES / name / f"{which}.csv", robot.cable_count)
    log, tracker = split(recording, samples_per_second, offset, rate)
    if not has_tension:
        log = replace(log, tension=np.full_like(log.tension, np.nan))
    found = estimate_tracker_clock(robot, log, tracker)
    assert 0.0 < found.deviation < 1e-3
    at_start = found.offset - offset
    return max(abs(at_start), abs(at_start + (found.rate - rate) * recording.duration))


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
@pytest.mark.parametrize(("which", "clock"), [("fit", (120.0, 3.412, 1.00002)), ("check", (30.0, -77.7, 1.0002))])
def test_offset_and_rate_are_recovered(name: str, which: str, clock: tuple[float, float, float]) -> None:
    assert largest_clock_error(name, which, clock, has_tension=True) < 1e-4


@pytest.mark.parametrize("name", ["three", "eight"])
def test_without_tensions_the_clock_is_less_certain(name: str) -> None:
    assert largest_clock_error(name, "check", (30.0, -77.7, 1.0002), has_tension=False) < 2.1e-3


def test_a_rate_that_is_not_significant_is_one() -> None:
    clock = estimate_tracker_clock(ROBOT, log_along(ROBOT, wandering, 20.0), tracker_along(wandering, TIMES, 8.0))
    assert clock.rate == 1.0
    assert clock.offset == pytest.approx(8.0, abs=1e-4)


def test_a_tracker_that_records_for_longer_or_shorter_is_aligned() -> None:
    log = log_along(ROBOT, wandering, 20.0)
    for times in (np.arange(-30.0, 45.0, 0.01), np.arange(8.0, 15.0, 0.01), np.arange(9.0, 60.0, 0.01)):
        assert estimate_tracker_clock(ROBOT, log, tracker_along(wandering, times, 8.0)).offset == pytest.approx(
            8.0, abs=2e-4
        )


def test_gaps_and_outliers_do_not_shift_the_clock() -> None:
    tracker = tracker_along(wandering, TIMES, 8.0)
    tracker.position[300:600] = np.nan
    tracker.position[1000:1010] += 0.3
    assert estimate_tracker_clock(ROBOT, log_along(ROBOT, wandering, 20.0), tracker).offset == pytest.approx(
        8.0, abs=2e-4
    )


def test_a_repeated_motion_of_which_the_tracker_saw_a_part_is_ambiguous() -> None:
    times = TIMES[(TIMES > 5.0) & (TIMES < 12.0)]
    error = refusal(log_along(ROBOT, repeated, 20.0), tracker_along(repeated, times, 8.0))
    assert "about equally well" in error.problem
    offsets = [float(number) for number in re.findall(r"-?\d+\.\d+", error.problem)]
    assert len(set(offsets)) == 2
    periods = (np.array(offsets) - 8.0) / 5.0
    assert periods == pytest.approx(np.round(periods), abs=0.002)


def test_a_steady_motion_without_start_or_stop_is_too_uncertain() -> None:
    times = TIMES[(TIMES > 5.0) & (TIMES < 12.0)]
    assert "its clock" in refusal(log_along(ROBOT, steady, 20.0), tracker_along(steady, times)).problem


def test_a_tracker_of_another_motion_fits_at_no_offset() -> None:
    error = refusal(log_along(ROBOT, wandering, 20.0), tracker_along(repeated, TIMES))
    assert "at no offset" in error.problem
    assert "units, axes and origin" in error.hint


def test_a_time_that_counts_frames_is_told() -> None:
    tracker = tracker_along(wandering, TIMES)
    error = refusal(log_along(ROBOT, wandering, 20.0), replace(tracker, time=np.arange(len(TIMES)) + 41.0))
    assert "as the number of a frame does" in error.problem and "the s between frames as its factor" in error.hint


def test_too_little_overlap_is_refused() -> None:
    error = refusal(log_along(ROBOT, wandering, 20.0), tracker_along(wandering, TIMES + 19.0))
    assert "at no offset" in error.problem


def test_coordinates_that_were_never_measured_together_are_refused() -> None:
    tracker = tracker_along(wandering, TIMES)
    tracker.position[::2, 0] = tracker.position[1::2, 1] = np.nan
    assert "has 0 samples with every coordinate" in refusal(log_along(ROBOT, wandering, 20.0), tracker).problem


@pytest.mark.parametrize("is_log_still", [True, False])
def test_a_file_without_motion_is_refused(is_log_still: bool) -> None:
    def still(time: Array) -> Array:
        return START + 0.0 * time[:, None]

    log = log_along(ROBOT, still if is_log_still else wandering, 20.0)
    log.winch_speed[np.abs(log.winch_speed) < 1e-9] = 0.0
    error = refusal(log, tracker_along(wandering if is_log_still else still, TIMES))
    assert error.where == ("log.csv" if is_log_still else "tracker.csv")
    assert "no motion" in error.problem
