"""Clocks apart by 15 ms, as the rig makes them: late in one recording only, or ahead in both."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.estimation.clock_offsets import CHANNEL_GROUPS, shifted, with_clocks_set
from tautwire.estimation.estimation_data import DataSplit, split_data
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.residual_analysis import residuals_are_white
from tautwire.recordings.recording import Recording
from tests.support.recordings import recorded
from tests.support.robots import example

POSITIONS, TENSIONS = CHANNEL_GROUPS
LATE: dict[str, dict[str, Any]] = {
    "positions": {"sensor_delay": {"seconds": 0.015, "outputs": "position"}},
    "tensions": {"sensor_delay": {"seconds": 0.015}},
}


def clocks_set(name: str, fit: Recording, check: Recording) -> tuple[DataSplit, tuple[str, ...], bool]:
    """The evidence after, the notes, and whether noise alone is left."""
    robot = example(name)
    noise = estimate_noise(robot, fit)
    fitter = Fitter(noise)
    evidence, notes = with_clocks_set(fitter, robot, split_data(robot, noise, fit, check))
    samples = (evidence.estimation, evidence.validation)
    return evidence, notes, all(residuals_are_white(fitter.innovations(robot, s), s.rows) for s in samples)


def milliseconds(note: str) -> float:
    return float(note.split(" are ")[1].split(" ms")[0])


@pytest.mark.validate
@pytest.mark.parametrize("name", ["three", "caroca"])
@pytest.mark.parametrize("kind", LATE)
def test_outputs_that_are_late_in_one_recording_only_are_shifted_back(name: str, kind: str) -> None:
    _, notes, noise_is_left = clocks_set(name, recorded(name, 1, LATE[kind]), recorded(name, 2))
    assert noise_is_left
    assert f"{name}-1.csv: {kind} are" in notes[0] and "behind the winch speeds" in notes[0]
    assert milliseconds(notes[0]) == pytest.approx(15.0, abs=0.15)
    assert milliseconds(notes[1]) < 0.1


@pytest.mark.validate
@pytest.mark.parametrize("kind", LATE)
def test_a_sensor_that_is_late_in_both_is_left_to_the_effect(kind: str) -> None:
    evidence, notes, _ = clocks_set("three", recorded("three", 1, LATE[kind]), recorded("three", 2, LATE[kind]))
    assert notes == ()
    assert evidence.estimation.recording is recorded("three", 1, LATE[kind])


@pytest.mark.validate
def test_a_delay_of_half_a_swing_in_both_is_no_clock() -> None:
    late = {"sensor_delay": {"seconds": 0.1}}
    _, notes, _ = clocks_set("caroca", recorded("caroca", 1, late), recorded("caroca", 2, late))
    assert notes == ()


def test_positions_before_their_motion_are_a_clock_even_in_both() -> None:
    pair = [shifted(recorded("three", seed), 0.015, POSITIONS) for seed in (1, 2)]
    _, notes, noise_is_left = clocks_set("three", *pair)
    assert noise_is_left
    assert [milliseconds(note) for note in notes] == pytest.approx([15.0, 15.0], abs=0.15)
    assert all("ahead of the winch speeds, so they precede the motion" in note for note in notes)


@pytest.mark.validate
@pytest.mark.parametrize(
    "effects",
    [
        {"damping": {"damping": 9e8}},
        {"modulus": {"modulus": 1.1e11}},
        {"friction": {"coefficient": 0.05}},
        {"hysteresis": {"force": 40.0, "yield_strain": 1e-5}},
        {"unlisted_swing": {"mass": 20.0, "length": 2.0}},
    ],
    ids=lambda effects: next(iter(effects)),
)
def test_an_effect_is_no_clock(effects: dict[str, Any]) -> None:
    for name in ("three", "caroca"):
        _, notes, _ = clocks_set(name, recorded(name, 1, effects), recorded(name, 2, effects))
        assert notes == ()


@pytest.mark.validate
def test_a_clock_is_seen_beside_an_effect() -> None:
    effects = {"payload": {"mass": 1.5}}
    _, notes, _ = clocks_set(
        "three", recorded("three", 1, {**effects, **LATE["positions"]}), recorded("three", 2, effects)
    )
    assert milliseconds(notes[0]) == pytest.approx(15.0, abs=0.2)


def test_a_shift_is_exact_on_what_is_smooth_and_leaves_noise_as_white() -> None:
    time = np.arange(2000) * 0.01
    white = np.random.default_rng(1).normal(size=(2000, 3))
    nothing = np.full((2000, 3), np.nan)
    smooth = Recording("smooth.csv", time, np.zeros((2000, 3)), nothing, np.sin(3.0 * time)[:, None] * np.ones(3))
    moved = shifted(smooth, 0.0137, POSITIONS).position
    assert np.nanmax(np.abs(moved[:, 0] - np.sin(3.0 * (time + 0.0137)))) < 1e-5
    noise = shifted(replace(smooth, position=white), 0.0137, POSITIONS).position
    seen = noise[np.isfinite(noise[:, 0])]
    assert np.std(seen) == pytest.approx(1.0, abs=0.05)
    assert np.all(np.abs(np.mean(seen[1:] * seen[:-1], axis=0)) < 0.1)


def test_samples_that_cannot_be_shifted_are_refused() -> None:
    recording = recorded("three", 1)
    uneven = replace(recording, time=recording.time + 0.004 * np.sin(np.arange(len(recording.time))))
    with pytest.raises(
        RecordingError, match=r"positions are 15 ms behind the winch speeds, and the sampling is not uniform"
    ):
        shifted(uneven, 0.015, POSITIONS)
    sparse = recording.tension.copy()
    sparse[np.arange(len(sparse)) % 5 > 0] = np.nan
    with pytest.raises(RecordingError, match="tensions are 15 ms behind the winch speeds, and are too sparse"):
        shifted(replace(recording, tension=sparse), 0.015, TENSIONS)
