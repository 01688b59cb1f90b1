"""Samples are read by the laboratory's names, as written, whatever the dialect; what is no number is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from tautwire.recordings.column_samples import column_samples


@pytest.mark.parametrize(
    "text",
    [
        "a,b,c\n1.5,,3\n2.5,nan,x\n",
        "Logger 7\n\n# a;b;c\na;b;c;\n1,5;;3;\n2,5;NA;x;\n",
        "a b c\n1.5 nan 3\n2.5 NaN x\n",
        'a\tb\tc\n"1.5"\t\t3\n# paused\n2.5\t\tx\n',
    ],
    ids=["commas", "semicolons and decimal commas", "spaces", "tabs, quotes and a comment"],
)
def test_samples_of_a_csv_file_are_numbers_by_name(text: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    samples = column_samples(tmp_path / "log.csv")
    expected = {"a": [1.5, 2.5], "b": [np.nan, np.nan], "c": [3.0, np.nan]}
    for name, numbers in expected.items():
        np.testing.assert_array_equal(samples.values[name], numbers)
    assert not samples.units


@pytest.mark.parametrize("units", ["s;mm;N\n", "# s;mm;N\n"])
def test_a_line_of_units_is_told(units: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(f"a;b;c\n{units}1;2;3\n", encoding="utf-8")
    samples = column_samples(tmp_path / "log.csv")
    assert samples.units == {"a": "s", "b": "mm", "c": "N"}
    assert samples.values["c"].tolist() == [3.0]


def test_clock_times_are_seconds_from_the_first(tmp_path: Path) -> None:
    text = "a;b;c\n2026-05-04T23:59:59.5;23:59:59,5;1\n2026-05-05T00:00:00;00:00:01;2\n?;;3\n"
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    samples = column_samples(tmp_path / "log.csv")
    assert samples.clocks == {"a", "b"}
    np.testing.assert_array_equal(samples.values["a"], [0.0, 0.5, np.nan])
    np.testing.assert_array_equal(samples.values["b"], [0.0, 1.5, np.nan])


def test_a_csv_file_that_is_not_valid_has_no_samples(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text('a,b,c\n1,2,3\n"1,2,3\n', encoding="utf-8")
    assert column_samples(tmp_path / "log.csv").values == {}


def test_columns_of_parquet_without_numbers_or_a_name_of_their_own_have_no_samples(tmp_path: Path) -> None:
    columns = [pa.array([1, None]), pa.array([1.0, 2.0]), pa.array(["a", "b"]), pa.array([3, 4])]
    pq.write_table(pa.table(columns, names=["n", "twice", "text", "twice"]), tmp_path / "log.parquet")
    samples = column_samples(tmp_path / "log.parquet").values
    assert samples.keys() == {"n"}
    np.testing.assert_array_equal(samples["n"], [1.0, np.nan])


def test_a_matrix_of_matlab_alone_has_a_column_for_each_of_its_own(tmp_path: Path) -> None:
    savemat(tmp_path / "log.mat", {"data": np.arange(15.0).reshape(5, 3), "rate": 100.0, "stamp": 2**60})
    samples = column_samples(tmp_path / "log.mat").values
    assert {name: numbers.tolist() for name, numbers in samples.items()} == {
        f"data_{index + 1}": np.arange(15.0).reshape(5, 3)[:, index].tolist() for index in range(3)
    }
