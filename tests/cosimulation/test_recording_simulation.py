"""Runs over recordings: what they are recorded into, and that memory does not grow with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pyarrow.parquet as pq
import pytest

from tautwire.cosimulation import result_file
from tautwire.cosimulation.isolation import CALL_TIMEOUT
from tautwire.cosimulation.recording_simulation import read_recorded_inputs, simulate_recording
from tautwire.cosimulation.result_file import open_result_file
from tautwire.cosimulation.robot_wiring import result_columns
from tautwire.cosimulation.run_arguments import SimulationOptions
from tautwire.errors import RecordingError
from tests.bench.long import STEP, write_recording
from tests.support.memory import TOLD, resident_memory
from tests.support.robots import example


class Rows(list[tuple[float, np.ndarray]]):
    """A recorder in memory."""

    def add(self, time: float, row: np.ndarray) -> None:
        self.append((time, row.copy()))


@pytest.mark.validate
def test_the_recorder_gets_a_row_for_every_sample_until_the_end(tmp_path: Path) -> None:
    write_recording(tmp_path / "recording.parquet", 50)
    rows, robot = Rows(), example("three")
    statistics, notes = simulate_recording(
        read_recorded_inputs(robot, tmp_path / "recording.parquet", 0.02),
        rows,
        SimulationOptions(0.5 * STEP),
        lambda what, done: None,
    )
    assert [time for time, _ in rows] == pytest.approx(np.arange(21) * STEP)
    assert {row.shape for _, row in rows} == {(len(result_columns(3)) - 1,)}
    assert rows[0][1][:3].tolist() == list(robot.platform.start)
    assert statistics.steps == 40
    assert notes == ()


def test_less_than_two_samples_are_refused(tmp_path: Path) -> None:
    write_recording(tmp_path / "recording.parquet", 50)
    with pytest.raises(RecordingError, match="fewer than two samples"):
        read_recorded_inputs(example("three"), tmp_path / "recording.parquet", -1.0)


@pytest.mark.validate
@pytest.mark.skipif(not TOLD, reason="only Linux tells the resident memory this way")
def test_memory_stays_flat_over_a_long_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(result_file, "BLOCK_BYTES", 2**17)
    write_recording(tmp_path / "recording.parquet", 8_000)
    seen: dict[int, float] = {}

    def look(what: str, done: float) -> None:
        if int(100.0 * done) not in seen:
            seen[int(100.0 * done)] = sum(resident_memory())

    with open_result_file(tmp_path / "result.parquet", result_columns(3)) as rows:
        simulate_recording(
            read_recorded_inputs(example("three"), tmp_path / "recording.parquet"),
            rows,
            SimulationOptions(STEP, call_timeout=CALL_TIMEOUT),
            look,
        )
    assert pq.read_metadata(tmp_path / "result.parquet").num_rows == 8_001
    assert seen[100] < seen[20] + 1.0


def test_how_the_recording_was_read_is_told(tmp_path: Path) -> None:
    write_recording(tmp_path / "recording.parquet", 50)
    frame = pd.read_parquet(tmp_path / "recording.parquet")
    frame["current"] = 1.0
    frame.loc[5, "winch_speed_1"] = np.nan
    frame.to_csv(tmp_path / "log.csv", index=False)
    gap, unread = read_recorded_inputs(example("three"), tmp_path / "log.csv").notes
    assert "winch_speed_1 is interpolated in 1 sample" in gap
    assert unread.endswith("not read: current")
