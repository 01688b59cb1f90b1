"""Short gaps of winch speeds and rope lengths are interpolated with a note; longer ones and ends are refused."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tautwire.errors import RecordingError
from tautwire.recordings.recording import read_recording, recording_errors, recording_from_frame
from tautwire.recordings.winch_gaps import MAX_GAP_SAMPLES, bridge_winch_gaps

COUNT = 20


def table(missing: dict[str, list[int]]) -> pd.DataFrame:
    """A recording of two cables, without some of its numbers; unevenly sampled."""
    time = np.cumsum(0.01 + 0.001 * np.arange(COUNT))
    frame = pd.DataFrame({"time": time, "winch_speed_1": 2.0 * time, "winch_speed_2": time**2, "x": 1.0})
    if "rope_length_2" in missing:
        frame["rope_length_2"] = 3.0 - time
    for name, rows in missing.items():
        frame.loc[rows, name] = np.nan
    return frame


def written(folder: Path, frame: pd.DataFrame) -> Path:
    path = folder / "fit.csv"
    frame.to_csv(path, index=False)
    return path


def test_a_gap_of_few_samples_that_lasts_long_stays() -> None:
    time = np.array([0.0, 0.01, 0.02, 0.03, 100.0, 200.0, 200.01, 200.02])
    speed = np.array([0.0, 0.0, 0.0, 0.0, np.nan, 9.0, 9.0, 9.0])
    bridged, notes = bridge_winch_gaps({"time": time, "winch_speed_1": speed})
    assert np.isnan(bridged["winch_speed_1"][4]) and notes == ()


def test_a_short_gap_is_linear_in_time_and_noted(tmp_path: Path) -> None:
    whole = table({})
    recording = read_recording(written(tmp_path, table({"winch_speed_1": [3, 7, 8, 9, 10, 11]})), 2)
    assert recording.winch_speed[:, 0] == pytest.approx(whole["winch_speed_1"].to_numpy(), rel=1e-12)
    assert recording.winch_speed[:, 1].tolist() == whole["winch_speed_2"].tolist()
    (note,) = recording.notes
    assert "winch_speed_1 is interpolated in 6 samples without a number, from" in note
    assert f"from {whole['time'][3]:.6g} s" in note
    assert list(recording_errors(recording.path, 2)) == []


@pytest.mark.parametrize("kind", ["file", "frame"])
def test_a_short_gap_of_a_rope_length_is_linear_in_time_and_noted(kind: str, tmp_path: Path) -> None:
    frame = table({}).rename(columns={"winch_speed_1": "rope_length_1"}).assign(winch_speed_1=np.nan)
    frame.loc[[3, 7, 8, 9, 10, 11], "rope_length_1"] = np.nan
    recording = read_recording(written(tmp_path, frame), 2) if kind == "file" else recording_from_frame(frame, 2)
    assert recording.winch_speed[:, 0] == pytest.approx(np.full(COUNT, -2.0), rel=1e-9)
    note, rates = recording.notes
    assert "rope_length_1 is interpolated in 6 samples without a number, from" in note
    assert "winch speeds are the rates" in rates


@pytest.mark.parametrize("rows", [[0], [COUNT - 1], list(range(5, 6 + MAX_GAP_SAMPLES))])
def test_longer_gaps_of_a_rope_length_and_those_at_the_ends_are_refused(rows: list[int], tmp_path: Path) -> None:
    frame = table({"winch_speed_1": rows}).rename(columns={"winch_speed_1": "rope_length_1"})
    with pytest.raises(RecordingError, match=r"column rope_length_1: is empty, .*at most 5 in a row are interpolated"):
        read_recording(written(tmp_path, frame), 2)
    with pytest.raises(RecordingError, match=f"row {rows[0] + 1}, column rope_length_1"):
        recording_from_frame(frame, 2)


def test_a_frame_is_bridged_as_a_file_is() -> None:
    recording = recording_from_frame(table({"winch_speed_2": [4]}), 2)
    assert "winch_speed_2 is interpolated in 1 sample" in recording.notes[0]
    assert np.isfinite(recording.winch_speed).all()


@pytest.mark.parametrize(
    ("rows", "first_line"),
    [([0], 2), ([COUNT - 1], COUNT + 1), ([COUNT - 2, COUNT - 1], COUNT), (list(range(5, 6 + MAX_GAP_SAMPLES)), 7)],
)
def test_longer_gaps_and_those_at_the_ends_are_refused(tmp_path: Path, rows: list[int], first_line: int) -> None:
    path = written(tmp_path, table({"winch_speed_1": rows, "winch_speed_2": [3]}))
    with pytest.raises(RecordingError, match=f"line {first_line}, column winch_speed_1: is empty"):
        read_recording(path, 2)
    assert [error.line for error in recording_errors(path, 2)] == [row + 2 for row in rows]


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    gaps=st.dictionaries(
        st.sampled_from(["time", "winch_speed_1", "winch_speed_2", "rope_length_2"]),
        st.lists(st.integers(0, COUNT - 1), max_size=12),
    )
)
def test_checking_tells_of_errors_exactly_where_reading_refuses(tmp_path: Path, gaps: dict[str, list[int]]) -> None:
    path = written(tmp_path, table(gaps))
    lines = [error.line or 0 for error in recording_errors(path, 2)]
    assert lines == sorted(lines)
    if lines:
        with pytest.raises(RecordingError, match=f"line {lines[0]},"):
            read_recording(path, 2)
    else:
        assert np.isfinite(read_recording(path, 2).winch_speed).all()


def test_a_gap_of_few_samples_that_lasts_long_is_refused_with_its_times(tmp_path: Path) -> None:
    frame = table({"winch_speed_1": [10]})
    frame.loc[10:, "time"] += 0.5
    times = frame["time"].to_numpy()
    with pytest.raises(RecordingError) as caught:
        read_recording(written(tmp_path, frame), 2)
    said = f"column winch_speed_1: has no number between {times[9]:.6g} s and {times[11]:.6g} s; only gaps of up to "
    assert said in str(caught.value)


def test_a_recording_of_one_sample_without_a_speed_is_refused_in_one_line(tmp_path: Path) -> None:
    with warnings.catch_warnings(), pytest.raises(RecordingError, match="line 2, column winch_speed_1: is empty"):
        warnings.simplefilter("error")
        read_recording(written(tmp_path, table({"winch_speed_1": [0]}).head(1)), 2)
