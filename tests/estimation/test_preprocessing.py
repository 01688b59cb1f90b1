"""Recordings as a trace takes them: as they are first, where a clock would explain only a part."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tautwire.estimation import preprocessing, speed_versions, trace
from tautwire.estimation.preprocessing import PreparedData, prepare_data
from tautwire.estimation.worker_pool import WorkerPool
from tautwire.recordings.central_differences import may_be_central_differences
from tautwire.recordings.recording import Recording
from tests.rig import load_robot, wander
from tests.support.recordings import REACH, recorded
from tests.support.robots import EXAMPLES, example

THREE = example("three")
LATE: dict[str, Any] = {"sensor_delay": {"seconds": 0.015, "outputs": "position"}}
PAYLOAD: dict[str, Any] = {"payload": {"mass": 1.5}}


def read(fit: dict[str, Any], check: dict[str, Any]) -> tuple[PreparedData, ...]:
    return prepare_data(THREE, recorded("three", 1, fit), recorded("three", 2, check), WorkerPool(1))


def told(found: PreparedData) -> bool:
    return any("a clock offset" in note for note in found.notes)


def test_what_is_noise_is_taken_as_it_is() -> None:
    (found,) = read({}, {})
    assert not told(found)


def test_a_clock_that_explains_all_is_set_at_once() -> None:
    (found,) = read(LATE, {})
    assert told(found)


@pytest.mark.validate
def test_a_clock_that_leaves_more_than_noise_waits_behind_the_recordings_as_they_are() -> None:
    first, second = read({**PAYLOAD, **LATE}, PAYLOAD)
    assert not told(first) and told(second)
    assert first.split.estimation.recording is recorded("three", 1, {**PAYLOAD, **LATE})
    assert second.split.estimation.recording is not first.split.estimation.recording


@pytest.mark.validate
def test_a_clock_beside_an_effect_is_set_once_no_effect_explains_all() -> None:
    found = trace(THREE, recorded("three", 1, {"payload": {"mass": 6.0}, **LATE}), pair({"payload": {"mass": 6.0}})[1])
    assert [effect.name for effect in found.effects] == ["payload"]
    assert any("a clock offset" in note for note in found.notes)


def pair(effects: dict[str, Any]) -> tuple[Recording, Recording]:
    return recorded("three", 1, effects), recorded("three", 2, effects)


def counted(seed: int, count: float, effects: dict[str, Any] | None = None) -> Recording:
    """A recording whose encoders count the rope in so many metres."""
    recording, rig_robot = recorded("three", seed, effects), load_robot(EXAMPLES / "three" / "robot.toml")
    program = wander(rig_robot, seed, REACH["three"], slow=(5.0, 12.0), shake=0.6)
    speeds = np.array([program.speed(float(time)) for time in recording.time])
    moved = 0.5 * (speeds[1:] + speeds[:-1]) * np.diff(recording.time)[:, None]
    travel = count * np.round(np.vstack([np.zeros(3), np.cumsum(moved, axis=0)]) / count)
    speeds = np.gradient(travel, recording.time, axis=0)
    return replace(recording, winch_speed=speeds, rope_length=-travel)


def mean_squares(found: PreparedData) -> list[float]:
    return [float(np.mean(each.values[each.observed] ** 2)) for each in found.innovations]


@pytest.mark.validate
@pytest.mark.parametrize("count", [1e-6, 1e-4])
def test_smoothed_lengths_leave_noise(monkeypatch: pytest.MonkeyPatch, count: float) -> None:
    recordings = counted(1, count), counted(2, count)
    (found,) = prepare_data(THREE, *recordings, WorkerPool(1))
    monkeypatch.setattr(speed_versions, "may_be_central_differences", lambda recording: False)
    monkeypatch.setattr(preprocessing, "split_with_other_interpolation", lambda split: None)
    (as_recorded,) = prepare_data(THREE, *recordings, WorkerPool(1))
    assert max(mean_squares(found)) < 1.03 < 1.08 < min(mean_squares(as_recorded))
    (note,) = (note for note in found.notes if "splines" in note)
    rms = max(error.rms for error in found.fitter.noise.rope_lengths)
    assert note.startswith("three-1.csv and three-2.csv: winch speeds are rates of rope lengths; those of smoothing")
    assert f"with errors of {rms:.2g} m (rms)" in note and rms < max(0.3 * count, 1e-5)


@pytest.mark.validate
def test_errors_of_coarse_counts_have_a_memory_that_is_estimated() -> None:
    (found,) = prepare_data(THREE, counted(1, 1e-3), counted(2, 1e-3), WorkerPool(1))
    assert found.fitter.has_disturbance and all(error.rms > 5e-5 for error in found.fitter.noise.rope_lengths)
    assert max(mean_squares(found)) < 1.1


def test_speeds_between_counts_are_used_where_no_lengths_were_recorded() -> None:
    recordings = [replace(counted(seed, 1e-4), rope_length=None) for seed in (1, 2)]
    found, *_ = prepare_data(THREE, recordings[0], recordings[1], WorkerPool(1))
    assert [note for note in found.notes if "central differences" in note]
    assert max(mean_squares(found)) < 1.05


@pytest.mark.validate(but=["lengths1"])
@pytest.mark.parametrize("lengths", [None, np.array([np.nan, 1.0, np.nan])])
def test_lengths_that_only_one_recording_has_are_not_smoothed(lengths: np.ndarray | None) -> None:
    fit, check = counted(1, 1e-4), counted(2, 1e-4)
    assert check.rope_length is not None
    found, *_ = prepare_data(
        THREE, fit, replace(check, rope_length=None if lengths is None else lengths * check.rope_length), WorkerPool(1)
    )
    # Speeds of a noise that does not drift would leave 1.27 and 1.20 times the variance in CHECK.
    assert max(mean_squares(found)) < 1.05


@pytest.mark.validate
def test_a_recording_that_also_validates_has_the_same_speeds_in_both() -> None:
    (found,) = prepare_data(THREE, counted(1, 1e-6), None, WorkerPool(1))
    assert found.split.estimation.recording is found.split.validation.recording
    assert any(note.startswith("three-1.csv: winch speeds are rates of rope lengths; ") for note in found.notes)


@pytest.mark.validate
def test_a_model_far_off_decides_on_no_speeds() -> None:
    recordings = counted(1, 1e-6, PAYLOAD), counted(2, 1e-6, PAYLOAD)
    as_recorded, corrected = prepare_data(THREE, *recordings, WorkerPool(1))
    assert as_recorded.split.estimation.recording is recordings[0]
    assert any("splines" in note for note in corrected.notes)
    # What speeds with few values are is nobody's knowledge, unlike what the reader makes of lengths.
    unknown = [replace(recording, rope_length=None, winch_speed=few_valued(recording)) for recording in recordings]
    assert may_be_central_differences(unknown[0])
    (alone,) = prepare_data(THREE, unknown[0], unknown[1], WorkerPool(1))
    assert alone.split.estimation.recording is unknown[0]


def few_valued(recording: Recording) -> np.ndarray:
    step = 5e-4
    return step * np.round(recording.winch_speed / step)


@pytest.mark.validate
def test_an_effect_is_named_beside_rope_lengths_and_its_kinematic_scales_are_told() -> None:
    drums = {"drum": {"radius_ratio": 1.15}}
    found = trace(THREE, counted(1, 1e-6, drums), counted(2, 1e-6, drums))
    (drum,) = found.effects
    assert found.verdict == "effects" and drum.name == "drum"
    assert drum.parameters["radius_ratio"].value == pytest.approx(1.15, abs=1e-5)
    assert found.noise_after and any("splines" in note for note in found.notes)
    scales = [note for note in found.notes if "by kinematics alone" in note]
    factors = [float(note.split("rope moves ")[1].split(",")[0]) for note in scales]
    assert factors == pytest.approx([1.15, 1.15], abs=2e-3)
