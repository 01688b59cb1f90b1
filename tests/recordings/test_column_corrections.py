"""Lines that read columns otherwise keep what is declared of them already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from tautwire.recordings import column_corrections
from tautwire.recordings.column_corrections import ColumnCorrection, negated, reordered, scaled
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.schema import RecordedColumn

COUNT = 3
SPEEDS = [f"winch_speed_{cable}" for cable in (1, 2, 3)]


def corrected_lines(recording: Recording, steps: Sequence[Sequence[ColumnCorrection]]) -> tuple[str, ...]:
    """The lines of [recording.columns]."""
    tables = column_corrections.corrected_lines(recording, steps)
    assert list(tables) == ["recording.columns"]
    return tables["recording.columns"]


def log(folder: Path, names: dict[str, str], declared: str = "", suffix: str = "csv") -> Recording:
    """A recording of three cables with these names of columns, read with these lines of [recording.columns]."""
    columns = ["time", *SPEEDS, "x", "y", "z", "tension_1"]
    frame = pd.DataFrame(np.arange(8.0 * len(columns)).reshape(8, -1), columns=columns).rename(columns=names)
    file, table = folder / f"log.{suffix}", folder / "columns.toml"
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file)
    table.write_text(f"[recording.columns]\n{declared}\n", encoding="utf-8")
    return read_recording(file, COUNT, table)


LABORATORY = {"time": "t", **{f"winch_speed_{cable}": f"Drive{cable}.V1" for cable in (1, 2, 3)}, "x": "Body X"}
DECLARED = 'time = "t"\n"winch_speed_{}" = { name = "Drive{}.V1", unit = "mm/s", sign = -1 }\nx = { name = "Body X" }'


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_names_units_and_signs_stay(tmp_path: Path, suffix: str) -> None:
    recording = log(tmp_path, LABORATORY, DECLARED, suffix)
    steps = [scaled(["time"], 1e-3, "ms"), negated(SPEEDS), scaled(["x", "y"], 1e-3, "mm")]
    assert corrected_lines(recording, steps) == (
        '"winch_speed_{}" = { name = "Drive{}.V1", unit = "mm/s" }',
        'time = { name = "t", unit = "ms" }',
        'x = { name = "Body X", unit = "mm" }',
        'y = { unit = "mm" }',
    )


def test_names_in_a_matlab_file_stay(tmp_path: Path) -> None:
    columns = {"t": np.arange(8.0), **{f"V{cable}": np.ones(8) for cable in (1, 2, 3)}}
    savemat(tmp_path / "log.mat", columns)
    declared = (RecordedColumn("time", "t"), RecordedColumn("winch_speed_{}", "V{}", sign=-1.0))
    recording = read_recording(tmp_path / "log.mat", COUNT, declared)
    assert corrected_lines(recording, [scaled(["time"], 1e-3, "ms"), negated(SPEEDS)]) == (
        '"winch_speed_{}" = { name = "V{}" }',
        'time = { name = "t", unit = "ms" }',
    )


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_declared_unit_or_factor_has_another_factor(tmp_path: Path, suffix: str) -> None:
    recording = log(tmp_path, LABORATORY, DECLARED, suffix)
    assert corrected_lines(recording, [scaled(SPEEDS, 1e-3, "mm/s")]) == (
        '"winch_speed_{}" = { name = "Drive{}.V1", unit = "mm/s", factor = 0.001, sign = -1 }',
    )
    counted = log(tmp_path, {}, "winch_speed_2 = { factor = 0.25 }", suffix)
    assert corrected_lines(counted, [scaled(SPEEDS, 0.1, "dm/s")])[1] == "winch_speed_2 = { factor = 0.025 }"


def test_an_entry_of_one_cable_comes_before_that_of_all_so_each_has_its_own_line(tmp_path: Path) -> None:
    recording = log(tmp_path, {}, "winch_speed_2 = { sign = -1 }")
    assert corrected_lines(recording, [negated(SPEEDS)]) == (
        "winch_speed_1 = { sign = -1 }",
        'winch_speed_2 = { name = "winch_speed_2" }',
        "winch_speed_3 = { sign = -1 }",
    )


def test_a_unit_beside_a_name_in_the_header_stays_and_has_a_factor(tmp_path: Path) -> None:
    recording = log(tmp_path, {"time": "time [s]", "x": "x [cm]"})
    assert corrected_lines(recording, [scaled(["time", "x"], 1e-3, "ms")]) == (
        'time = { unit = "s", factor = 0.001 }',
        'x = { unit = "cm", factor = 0.001 }',
    )


def test_columns_change_places_with_their_scales(tmp_path: Path) -> None:
    recording = log(tmp_path, LABORATORY, DECLARED.replace("x = {", "winch_speed_2 = {").replace("Body X", "Drive2.V1"))
    assert corrected_lines(recording, [reordered(SPEEDS, [SPEEDS[1], SPEEDS[0], SPEEDS[2]])]) == (
        'winch_speed_1 = { name = "Drive2.V1" }',
        'winch_speed_2 = { name = "Drive1.V1", unit = "mm/s", sign = -1 }',
    )


def test_a_later_step_corrects_what_the_one_before_it_reads(tmp_path: Path) -> None:
    steps = [
        scaled(["z"], 1e-3, "mm"),
        (ColumnCorrection("x", "z", sign=-1.0), ColumnCorrection("z", "x")),
        (ColumnCorrection("x", shift=2.0),),
    ]
    assert corrected_lines(log(tmp_path, {}), steps) == (
        'z = { name = "x" }',
        'x = { name = "z", unit = "mm", sign = -1, offset = 2000 }',
    )


def test_a_column_that_is_not_in_the_file_has_no_line(tmp_path: Path) -> None:
    cells = [f"tension_{cable}" for cable in (1, 2, 3)]
    assert corrected_lines(log(tmp_path, {}), [negated(cells)]) == ("tension_1 = { sign = -1 }",)


def test_all_digits_of_a_large_offset_count(tmp_path: Path) -> None:
    recording = log(tmp_path, {}, "x = { offset = 4512345.678 }")
    (line,) = corrected_lines(recording, [(ColumnCorrection("x", shift=-3.2),)])
    assert line == "x = { offset = 4512348.878 }"


def test_a_unit_of_another_quantity_is_written_as_its_factor(tmp_path: Path) -> None:
    assert corrected_lines(log(tmp_path, {}), [scaled(["winch_speed_1", "x"], 1e-3, "mm")]) == (
        "winch_speed_1 = { factor = 0.001 }",
        'x = { unit = "mm" }',
    )


def test_units_in_the_header_of_all_cables_have_one_line(tmp_path: Path) -> None:
    recording = log(tmp_path, {speed: f"{speed} [m/s]" for speed in SPEEDS})
    assert corrected_lines(recording, [scaled(SPEEDS, 1e-3, "mm/s")]) == (
        '"winch_speed_{}" = { unit = "m/s", factor = 0.001 }',
    )


def test_clock_times_have_no_line(tmp_path: Path) -> None:
    recording = replace(log(tmp_path, {}), has_time_column=False)
    assert column_corrections.corrected_lines(recording, [scaled(["time"], 60.0, "min")]) == {}
