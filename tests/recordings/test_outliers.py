from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.errors import RecordingError
from tautwire.recordings.outliers import outlier_indices, without_outliers
from tautwire.recordings.recording import Recording
from tests.support.pose_recordings import noisy, quaternions_of, rotation_of, wandering_recording
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot
from tests.support.robots import NAMES

KINKED = {
    "friction": {"coefficient": 0.05},
    "hysteresis": {"force": 40.0, "yield_strain": 1e-5},
    "unlisted_shaker": {},
}


def spoilt(recording: Recording, places: list[int], sigmas: float) -> Recording:
    tension, position, speed = recording.tension.copy(), recording.position.copy(), recording.winch_speed.copy()
    for number, place in enumerate(places):
        tension[place, number % tension.shape[1]] += sigmas * 2.0 * (-1) ** number
        position[place + 20, number % 3] -= sigmas * 3e-4
    speed[places[0] + 40, 1] += sigmas * 2e-4
    return replace(recording, tension=tension, position=position, winch_speed=speed)


def test_samples_that_jump_and_come_back_become_empty_cells_and_are_counted() -> None:
    whole = recorded("three", 1)
    cleaned, notes = without_outliers(spoilt(whole, [100, 200, 203, 400, 601], 50.0))
    assert int(np.sum(np.isnan(cleaned.measured()))) == 10
    assert np.isnan(cleaned.tension[100, 0]) and np.isnan(cleaned.position[120, 0])
    assert cleaned.winch_speed[140, 1] == pytest.approx(whole.winch_speed[140, 1], abs=2e-3)
    assert "2 of tension_1" in notes[0] and "1 of winch_speed_2" in notes[0] and whole.path in notes[0]


@pytest.mark.parametrize("name", NAMES)
def test_a_recording_as_it_should_be_loses_nothing(name: str) -> None:
    recording = recorded(name, 1)
    cleaned, notes = without_outliers(recording)
    assert cleaned is recording and notes == ()


def test_the_first_and_last_samples_are_looked_at_too() -> None:
    signal = np.random.default_rng(1).normal(size=400)
    signal[[1, 398]] += 60.0
    assert outlier_indices(signal).tolist() == [1, 398]


def test_a_step_and_a_kink_are_no_outliers() -> None:
    time = np.arange(600) * 0.01
    noise = np.random.default_rng(2).normal(scale=0.01, size=600)
    assert not len(outlier_indices(np.where(time > 3.0, 5.0, 0.0) + noise))
    assert not len(outlier_indices(np.abs(time - 3.0) * 20.0 + noise))


def test_neighbours_of_an_outlier_stay() -> None:
    signal = np.sin(np.arange(500) * 0.2) + np.random.default_rng(3).normal(scale=0.01, size=500)
    signal[250] += 1.0
    assert outlier_indices(signal).tolist() == [250]


def test_a_channel_that_jumps_all_the_time_is_refused() -> None:
    recording = recorded("three", 1)
    tension = recording.tension.copy()
    tension[50::20, 1] += 300.0
    with pytest.raises(RecordingError, match=r"column tension_2: has outliers in \d+ of 801 samples, more"):
        without_outliers(replace(recording, tension=tension))


def test_sparse_samples_are_held_against_their_own_neighbours() -> None:
    recording = recorded("three", 1)
    position = recording.position.copy()
    position[100] += 0.05
    position[np.arange(len(position)) % 5 > 0] = np.nan
    cleaned, _ = without_outliers(replace(recording, position=position))
    assert np.flatnonzero(np.isnan(cleaned.position[::5, 0])).tolist() == [20]


def test_a_winch_that_stops_speeding_up_is_no_outlier() -> None:
    time = np.arange(600) * 0.01
    noise = np.random.default_rng(5).normal(scale=1e-4, size=600)
    for acceleration in (0.5, 2.0, 20.0):
        assert not len(outlier_indices(np.minimum(acceleration * time, 3.0 * acceleration) + noise))


def test_a_quaternion_that_jumps_once_is_removed_as_a_whole() -> None:
    recording = noisy(wandering_recording(crane_robot()))
    orientation = recording.orientation.copy()
    # A tracker that takes one marker for another turns the platform by half a radian.
    for row in (77, 300):
        orientation[row] = quaternions_of(Rotation.from_rotvec([0.0, 0.5, 0.0]) * rotation_of(orientation[row]))
    cleaned, notes = without_outliers(replace(recording, orientation=orientation))
    assert np.flatnonzero(np.isnan(cleaned.orientation).any(axis=1)).tolist() == [77, 300]
    assert np.isnan(cleaned.orientation[[77, 300]]).all()
    assert "outliers beyond 25 sigma removed: 2 of qw, qx, qy, qz" in notes[0]
    assert np.array_equal(cleaned.position, recording.position)
    assert without_outliers(recording) == (recording, ())


def test_a_tracker_that_loses_the_orientation_often_is_refused() -> None:
    recording = noisy(wandering_recording(crane_robot()))
    orientation = recording.orientation.copy()
    orientation[10::20] = [0.0, 1.0, 0.0, 0.0]
    with pytest.raises(RecordingError, match=r"column qw, qx, qy, qz: has outliers in .* more than 1 %"):
        without_outliers(replace(recording, orientation=orientation))
