"""Result files: what they hold, when they appear, and that memory does not grow with their rows."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tautwire.cosimulation import result_file
from tautwire.cosimulation.result_file import BLOCK_BYTES, Column, open_result_file
from tautwire.errors import InputError, TautwireError
from tautwire.provenance import PROVENANCE_KEY, Provenance

COLUMNS = [Column("time", "s"), Column("x", "m"), Column("tension_1", "N")]
ROWS = np.column_stack([np.arange(7) * 0.1, np.geomspace(1e-9, 1e9, 7), np.linspace(-1.0, 1.0, 7) / 3.0])
NAMES = ["result.csv", "result.parquet"]


def write(target: Path, rows: np.ndarray, fault: BaseException | None = None) -> None:
    with open_result_file(target, COLUMNS) as result:
        for time, *row in rows:
            result.add(float(time), np.array(row))
        if fault is not None:
            raise fault


def read(path: Path) -> pd.DataFrame:
    return pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path)


@pytest.mark.parametrize("name", NAMES)
def test_its_provenance_is_metadata_and_no_line_of_its_own(tmp_path: Path, name: str) -> None:
    made = Provenance("0.1.0", "tautwire simulate robot.toml", "2026-01-02T03:04:05Z", {"robot.toml": "ab" * 32})
    with open_result_file(tmp_path / name, COLUMNS, made) as result:
        result.add(0.0, np.array([1.0, 2.0]))
    assert list(read(tmp_path / name).columns) == ["time", "x", "tension_1"]
    if name.endswith(".parquet"):
        stored = json.loads(pq.read_schema(tmp_path / name).metadata[PROVENANCE_KEY.encode()])
    else:
        (note,) = json.loads((tmp_path / "result.csv-metadata.json").read_text(encoding="utf-8"))["notes"]
        stored = note["provenance"]
    assert stored == made.document()
    with open_result_file(tmp_path / name, COLUMNS, made) as result:
        result.add(0.0, np.array([3.0, 4.0]))
    assert read(tmp_path / name)["x"].tolist() == [3.0]


@pytest.mark.parametrize("text", ['{"@context": "http://www.w3.org/ns/csvw", "url": "result.csv"}', "[1]", "\xff{"])
def test_metadata_of_its_owner_is_not_replaced(tmp_path: Path, text: str) -> None:
    owned = tmp_path / "result.csv-metadata.json"
    owned.write_text(text, encoding="latin-1")
    made = Provenance("0.1.0", None, "2026-01-02T03:04:05Z", {})
    with (
        pytest.raises(InputError, match="is not Tautwire's"),
        open_result_file(tmp_path / "result.csv", COLUMNS, made),
    ):
        pytest.fail("was not refused before the run")
    assert owned.read_text(encoding="latin-1") == text
    assert [path.name for path in tmp_path.iterdir()] == [owned.name]


@pytest.mark.parametrize("name", [*NAMES, "result.PARQUET", "result"])
def test_it_holds_the_rows_under_their_names(tmp_path: Path, name: str) -> None:
    write(tmp_path / name, ROWS)
    is_parquet = (tmp_path / name).read_bytes().startswith(b"PAR1")
    assert is_parquet == name.lower().endswith(".parquet")
    frame = pd.read_parquet(tmp_path / name) if is_parquet else pd.read_csv(tmp_path / name)
    assert list(frame.columns) == ["time", "x", "tension_1"]
    assert np.allclose(frame.to_numpy(), ROWS, rtol=1e-15, atol=0.0)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_csv_file_is_written_as_pandas_writes_a_frame(tmp_path: Path) -> None:
    write(tmp_path / "result.csv", ROWS)
    frame = pd.DataFrame(ROWS, columns=[column.name for column in COLUMNS])
    assert (tmp_path / "result.csv").read_text() == frame.to_csv(index=False)


def test_a_parquet_file_names_the_units(tmp_path: Path) -> None:
    write(tmp_path / "result.parquet", ROWS)
    schema = pq.read_schema(tmp_path / "result.parquet")
    assert [schema.field(c.name).metadata[b"unit"].decode() for c in COLUMNS] == ["s", "m", "N"]
    assert set(schema.types) == {pa.float64()}


@pytest.mark.parametrize("name", NAMES)
def test_a_failure_keeps_the_rows_that_came_and_says_where(tmp_path: Path, name: str) -> None:
    with pytest.raises(TautwireError, match=r"^cable torn; the run up to then is in .*result") as caught:
        write(tmp_path / name, ROWS[:4], TautwireError("cable torn"))
    assert str(caught.value.__cause__) == "cable torn"
    assert np.allclose(read(tmp_path / name).to_numpy(), ROWS[:4], rtol=1e-15, atol=0.0)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("rows", "fault"), [(0, TautwireError("cable torn")), (7, KeyboardInterrupt()), (7, OSError("disk full"))]
)
def test_without_rows_or_after_anything_else_nothing_is_left(
    tmp_path: Path, name: str, rows: int, fault: BaseException
) -> None:
    (tmp_path / name).write_text("before")
    with pytest.raises(type(fault)) as caught:
        write(tmp_path / name, ROWS[:rows], fault)
    assert caught.value is fault
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "before"


@pytest.mark.validate(but=["result.parquet"])
@pytest.mark.parametrize("name", NAMES)
def test_rows_go_to_disk_as_they_come(tmp_path: Path, name: str) -> None:
    with open_result_file(tmp_path / name, COLUMNS) as result:
        (folder,) = tmp_path.glob("*/new")
        row, sizes = np.array([1.0, 2.0]), []
        for block in range(4):
            for index in range(BLOCK_BYTES // 24):
                result.add(float(block * 1_000_000 + index), row)
            sizes.append((folder / name).stat().st_size)
    assert np.all(np.diff(sizes) > 100_000)
    assert len(read(tmp_path / name)) == result.count == 4 * (BLOCK_BYTES // 24)
    if name.endswith(".parquet"):
        assert pq.ParquetFile(tmp_path / name).num_row_groups == 4


@pytest.mark.validate(but=["result.parquet"])
@pytest.mark.parametrize("name", NAMES)
def test_memory_does_not_grow_with_the_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    block_bytes = 2**17
    monkeypatch.setattr(result_file, "BLOCK_BYTES", block_bytes)
    columns = [Column(f"c{i}", "m") for i in range(100)]
    row, block = np.arange(99.0), block_bytes // 800

    def most_held(blocks: int) -> int:
        """Bytes that Python held at most, and Arrow between blocks."""
        before, arrow = pa.total_allocated_bytes(), 0
        tracemalloc.start()
        with open_result_file(tmp_path / name, columns) as result:
            for index in range(blocks * block):
                result.add(float(index), row)
                if index % block == block - 1:
                    arrow = max(arrow, pa.total_allocated_bytes() - before)
        held = tracemalloc.get_traced_memory()[1] + arrow
        tracemalloc.stop()
        return held

    most_held(1)
    few, many = most_held(2), most_held(20)
    assert block_bytes < many < few + 0.1 * block_bytes
