"""The residual file keeps every sample of every recording, with units, and null where nothing was measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from tautwire.reports.residual_file import write_residuals
from tests.support.traces import made_trace, without_positions


def test_rows_are_the_samples_of_each_recording_beside_both_runs(tmp_path: Path) -> None:
    trace, file = made_trace(samples=301), tmp_path / "residuals.parquet"
    innovations = np.random.default_rng(1).normal(size=(301, 6))
    fit, check = trace.comparisons
    trace = replace(trace, comparisons=(replace(fit, innovations=innovations), check))
    write_residuals(trace, file)
    table = pq.read_table(file)
    assert table["recording"].to_pylist() == ["FIT"] * 301 + ["CHECK"] * 301
    assert table["time"].to_numpy().tolist() == [*fit.recording.time, *check.recording.time]
    assert table["tension_2_measured"].to_numpy()[:301].tolist() == fit.recording.tension[:, 1].tolist()
    assert table["z_before"].to_numpy()[301:].tolist() == check.before.position[:, 2].tolist()
    assert table["z_after"].to_numpy()[301:].tolist() == check.after.position[:, 2].tolist()
    assert table["tension_3_innovation"].to_numpy()[:301].tolist() == innovations[:, 5].tolist()
    assert table["tension_3_innovation"].null_count == 301
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema if field.metadata}
    assert (units["time"], units["x_after"], units["tension_1_before"], units["x_innovation"]) == ("s", "m", "N", "1")


def test_what_was_not_measured_is_null(tmp_path: Path) -> None:
    trace = without_positions(made_trace(check=False, samples=301))
    write_residuals(trace, tmp_path / "residuals.parquet")
    table = pq.read_table(tmp_path / "residuals.parquet")
    assert table["x_measured"].null_count == 301 and table["tension_1_measured"].null_count == 0
