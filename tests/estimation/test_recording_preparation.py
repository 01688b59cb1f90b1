"""Recordings as they are: what is done to them before anything is judged, and that they then show what they should."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tautwire.cli import run
from tautwire.errors import RecordingError
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.identification import trace
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.preprocessing import PreparedRecordings, prepare_recordings
from tautwire.estimation.residual_analysis import residuals_are_white
from tautwire.recordings.recording import Recording
from tests.support.progress import without_progress_lines
from tests.support.recordings import recorded
from tests.support.robots import EXAMPLES, example

ROBOT = example("three")


def spoilt(recording: Recording, every: int = 5) -> Recording:
    """Positions at a slower rate, a dead load cell, five samples that are far off, a gap of a second."""
    position, tension = recording.position.copy(), recording.tension.copy()
    position[np.arange(len(position)) % every > 0] = np.nan
    tension[:, 1] = 777.0
    tension[[70, 150, 333, 402, 640], [0, 2, 0, 2, 0]] += 100.0
    kept = (recording.time < 9.0) | (recording.time > 10.0)
    return replace(
        recording,
        time=recording.time[kept],
        winch_speed=recording.winch_speed[kept],
        position=position[kept],
        tension=tension[kept],
    )


def noise_is_left(prepared: PreparedRecordings) -> bool:
    fitter = Fitter(prepared.noise)
    evidence = split_data(ROBOT, prepared.noise, prepared.fit, prepared.check)
    return all(
        residuals_are_white(fitter.innovations(ROBOT, s), s.rows) for s in (evidence.estimation, evidence.validation)
    )


@pytest.mark.validate
def test_recordings_as_they_should_be_are_not_touched() -> None:
    pair = recorded("three", 1), recorded("three", 2)
    prepared = prepare_recordings(ROBOT, *pair)
    assert (prepared.fit, prepared.check) == pair
    assert prepared.notes == ()


def test_all_that_is_done_is_said_and_leaves_noise() -> None:
    prepared = prepare_recordings(ROBOT, spoilt(recorded("three", 1)), spoilt(recorded("three", 2)))
    for path in ("three-1.csv", "three-2.csv"):
        assert f"{path}: tension_2 is constant throughout: not used" in prepared.notes
        assert any(path in note and "3 of tension_1, 2 of tension_3" in note for note in prepared.notes)
        assert any(
            path in note and "in its gaps (at 8.98 s) is unknown: only the part from 0" in note
            for note in prepared.notes
        )
    assert noise_is_left(prepared)


COLUMNS: list[tuple[str, list[int]]] = [("z alone", [2]), ("one coordinate empty", [0, 2]), ("no positions", [])]


@pytest.mark.parametrize(("name", "axes"), COLUMNS, ids=[name for name, _ in COLUMNS])
@pytest.mark.parametrize("tensions", [True, False], ids=["tensions", "no tensions"])
def test_outputs_may_be_missing(name: str, axes: list[int], tensions: bool) -> None:
    pair = []
    for seed in (1, 2):
        recording = recorded("three", seed)
        position, tension = np.full_like(recording.position, np.nan), recording.tension.copy()
        position[:, axes] = recording.position[:, axes]
        tension[:, [] if tensions else [0, 1, 2]] = np.nan
        pair.append(replace(recording, position=position, tension=tension))
    if not axes and not tensions:
        with pytest.raises(RecordingError, match=r"three-1\.csv: no number in any of the outputs"):
            prepare_recordings(ROBOT, *pair)
        return
    assert noise_is_left(prepare_recordings(ROBOT, *pair))


def test_a_recording_of_which_nothing_is_alive_is_refused() -> None:
    recording = recorded("three", 1)
    dead = replace(recording, position=np.ones_like(recording.position), tension=np.ones_like(recording.tension))
    with pytest.raises(RecordingError, match="no number in any of the outputs"):
        prepare_recordings(ROBOT, dead, None)


def test_a_noise_that_was_declared_too_small_leaves_noise() -> None:
    timid = replace(ROBOT, sensors=replace(ROBOT.sensors, tension_noise=0.5))
    prepared = prepare_recordings(timid, recorded("three", 1), recorded("three", 2))
    assert sum("the latter is used" in note for note in prepared.notes) == 3
    assert noise_is_left(prepared)


@pytest.mark.validate
def test_what_is_hidden_is_found_in_recordings_as_they_are() -> None:
    effects: dict[str, Any] = {"payload": {"mass": 6.0}}
    pair = (spoilt(recorded("three", seed, effects)) for seed in (3, 53))
    found = trace(ROBOT, *pair, lambda what, done: None)
    assert [effect.name for effect in found.effects] == ["payload"]
    low, high = found.effects[0].parameters["mass"].low, found.effects[0].parameters["mass"].high
    assert low - 0.02 < 6.0 < high + 0.02
    for part in ("constant throughout", "outliers beyond 25 sigma removed", "the winch motion in its gaps"):
        assert sum(part in note for note in found.notes) == 2


def test_what_is_refused_is_one_line_and_nothing_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frame = pd.read_csv(EXAMPLES / "three" / "fit.csv")
    frame.loc[50::20, "tension_2"] += 300.0
    frame.to_csv(tmp_path / "fit.csv", index=False)
    robot, out = str(EXAMPLES / "three" / "robot.toml"), tmp_path / "report"
    assert run(["trace", robot, str(tmp_path / "fit.csv"), "--out", str(out)]) == 2
    said = without_progress_lines(capsys.readouterr().err).splitlines()
    assert len(said) == 1
    assert "fit.csv: column tension_2: has outliers in" in said[0] and "repair the sensor" in said[0]
    assert not out.exists()
