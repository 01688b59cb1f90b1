"""Recordings that begin in the middle of a motion, or of a swing under resting winches."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.estimation.cosimulation_validation import cosimulate_data_set, noise_floor, output_errors
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.initial_state_prior import initial_motion, with_motion_at_start
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.preprocessing import prepare_recordings
from tautwire.estimation.residual_analysis import residuals_are_white
from tautwire.estimation.smoothed_states import initial_state_note, with_initial_state
from tautwire.recordings.recording import Recording
from tests.rig import SampledProgram, load_robot, make_recording, wander
from tests.support.recordings import recorded
from tests.support.robots import EXAMPLES, NAMES, example

BEGIN = {"three": 4.0, "caroca": 1.0, "eight": 1.5}


def cut(recording: Recording, begin: float) -> Recording:
    """From a time on."""
    later = recording.time >= begin
    return replace(
        recording,
        time=recording.time[later],
        winch_speed=recording.winch_speed[later],
        tension=recording.tension[later],
        position=recording.position[later],
    )


def swinging() -> Recording:
    """Winches stop within 4 s and go on after 8 s; from 6 s on, when the platform still swings."""
    declared = load_robot(EXAMPLES / "three" / "robot.toml")
    smooth = wander(declared, 5, 5.0, slow=(5.0, 12.0), shake=0.6)
    times = np.arange(901) * 0.02
    speeds = np.array([smooth.speed(float(time)) for time in times])
    speeds *= np.interp(times, [3.0, 4.0, 8.0, 9.0], [1.0, 0.0, 0.0, 1.0])[:, None]
    frame = make_recording(declared, {}, SampledProgram(times, speeds), duration=18.0, rate=50.0, seed=5)
    columns = {name: frame[[f"{name}_{i}" for i in (1, 2, 3)]].to_numpy() for name in ("winch_speed", "tension")}
    whole = Recording("swinging.csv", times, columns["winch_speed"], columns["tension"], frame[list("xyz")].to_numpy())
    return cut(whole, 6.0)


def runs(name: str, *recordings: Recording) -> list[tuple[bool, float, float]]:
    """Of each recording: whether innovations are noise, and the co-simulation's errors over what noise leaves."""
    robot = example(name)
    prepared = prepare_recordings(robot, *recordings)
    evidence = split_data(robot, prepared.noise, prepared.fit, prepared.check)
    fitter = Fitter(prepared.noise)
    found = []
    for sample in (evidence.estimation, evidence.validation):
        begun = with_initial_state(fitter, robot, sample)
        assert "the estimated initial state has tensions of" in initial_state_note(begun, sample.recording.path)[0]
        error, floor = (
            output_errors(sample.recording, cosimulate_data_set(begun, sample)),
            noise_floor(fitter, robot, sample),
        )
        quiet = residuals_are_white(fitter.innovations(robot, sample), sample.rows)
        found.append((quiet, error.position_rms / floor.position_rms, error.tension_rms / floor.tension_rms))
    return found


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("name", NAMES)
def test_a_recording_that_starts_at_rest_does_not_start_in_motion(name: str) -> None:
    robot = example(name)
    pair = recorded(name, 1), recorded(name, 2)
    noise = estimate_noise(robot, pair[0])
    assert with_motion_at_start(robot, noise, pair) == (noise, ())


@pytest.mark.validate
@pytest.mark.parametrize("name", NAMES)
def test_a_start_in_motion_leaves_noise_in_filter_and_co_simulation(name: str) -> None:
    pair = [cut(recorded(name, seed), BEGIN[name]) for seed in (1, 2)]
    notes = prepare_recordings(example(name), *pair).notes
    assert sum("starts in motion" in note for note in notes) == 2
    for quiet, position, tension in runs(name, *pair):
        assert quiet
        assert position < 1.2 and tension < 1.2


@pytest.mark.validate
def test_a_swing_under_resting_winches_is_a_start_in_motion() -> None:
    recording = swinging()
    assert np.max(np.abs(recording.winch_speed[:90])) < 2e-3
    found = initial_motion(example("three"), estimate_noise(example("three"), recording), recording)
    assert found is not None and found.amplitude > 0.002
    for quiet, position, tension in runs("three", recording, recorded("three", 2)):
        assert quiet
        assert position < 1.2 and tension < 1.2


def test_winch_speeds_alone_tell_where_no_position_is_measured() -> None:
    recording = cut(recorded("three", 1), 4.0)
    blind = replace(recording, position=np.full_like(recording.position, np.nan))
    found = initial_motion(example("three"), estimate_noise(example("three"), recording), blind)
    assert found is not None and found.speed == pytest.approx(2.0, rel=0.2)


def test_a_start_too_far_from_rest_is_refused() -> None:
    recording = recorded("three", 1)
    wild = replace(recording, position=recording.position + 3.0 * np.sin(20.0 * recording.time)[:, None])
    robot = example("three")
    with pytest.raises(
        RecordingError, match=r"three-1\.csv: starts in motion, .* m/s, and vibrates by .*; begin the rec"
    ):
        with_motion_at_start(robot, estimate_noise(robot, recording), (wild,))
