"""Rows on disk: atomic parts, resumed campaigns, and errors for other plans and full disks."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from tautwire.campaigns import campaign_dataset as dataset
from tautwire.campaigns.campaign_dataset import PartWriter, completed_runs, open_dataset, part_files, read_rows
from tautwire.campaigns.campaign_plan import PlanError, PlanMismatchError
from tautwire.campaigns.campaign_run import RunResult
from tautwire.campaigns.dataset_schema import row_columns
from tautwire.errors import InputError
from tests.support.campaigns import AT_REST, moving, read


def result(index: int, frequency: float = 1.5, points: int = 0) -> RunResult:
    row = {"index": index, "sample": index, "held": True, "frequency_1": frequency}
    series = {name: np.arange(points) + 10.0 * index for name in ("time", "x")} if points else {}
    return RunResult(row, series)


def test_rows_come_back_in_the_order_of_runs_with_nulls_where_there_is_nothing(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    with open_dataset(tmp_path / "out", plan), PartWriter(tmp_path / "out", row_columns(plan, 3)) as parts:
        parts.add([result(5, points=3), result(2, points=3)])
        parts.flush()
        parts.add([result(0, 2.5, points=3), RunResult({"index": 7, "sample": 7, "failure": "ValueError: no"})])
    assert len(part_files(tmp_path / "out")) == 2
    rows = read_rows(tmp_path / "out").to_pylist()
    assert [row["index"] for row in rows] == [0, 2, 5, 7]
    assert [row["frequency_1"] for row in rows] == [2.5, 1.5, 1.5, None]
    assert [row["failure"] for row in rows] == [None, None, None, "ValueError: no"]
    assert list(np.flatnonzero(completed_runs(tmp_path / "out", 8))) == [0, 2, 5, 7]
    series = read_rows(tmp_path / "out", ["x"], "series")
    assert series["index"].to_pylist() == [0, 0, 0, 2, 2, 2, 5, 5, 5]
    assert series["x"].to_pylist() == [0.0, 1.0, 2.0, 20.0, 21.0, 22.0, 50.0, 51.0, 52.0]


def test_rows_are_written_where_the_block_ends_early(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    with (
        pytest.raises(KeyboardInterrupt),
        open_dataset(tmp_path / "out", plan),
        PartWriter(tmp_path / "out", row_columns(plan, 3)) as parts,
    ):
        parts.add([result(3)])
        raise KeyboardInterrupt
    assert list(np.flatnonzero(completed_runs(tmp_path / "out", 8))) == [3]


def test_a_later_call_writes_beside_the_parts_of_an_earlier_one(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    for index in (1, 2):
        with open_dataset(tmp_path / "out", plan), PartWriter(tmp_path / "out", row_columns(plan, 3)) as parts:
            parts.add([result(index)])
    assert [part.name for part in part_files(tmp_path / "out")] == ["part-000001.parquet", "part-000002.parquet"]


def test_what_a_killed_process_left_half_written_is_cleared(tmp_path: Path) -> None:
    plan = read(tmp_path, moving())
    out = tmp_path / "out"
    with open_dataset(out, plan), PartWriter(out, row_columns(plan, 3)) as parts:
        parts.add([result(0, points=2)])
    (out / "runs" / "part-000002.parquet.partial").write_bytes(b"half")
    (out / "series" / "part-000002.parquet").write_bytes((out / "series" / "part-000001.parquet").read_bytes())
    with open_dataset(out, plan):
        assert [each.name for each in (out / "runs").iterdir()] == ["part-000001.parquet"]
        assert [each.name for each in (out / "series").iterdir()] == ["part-000001.parquet"]


@pytest.mark.parametrize(("old", "new"), [("seed = 7", "seed = 8"), ("count = 8", "count = 16"), ("2.2e9", "2.3e9")])
def test_rows_of_another_plan_are_refused(old: str, new: str, tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    with open_dataset(tmp_path / "out", plan), PartWriter(tmp_path / "out", row_columns(plan, 3)) as parts:
        parts.add([result(0)])
    other = read(tmp_path, AT_REST.replace(old, new))
    with (
        pytest.raises(PlanMismatchError, match=f"{plan.digest()}, this one is {other.digest()}"),
        open_dataset(tmp_path / "out", other),
    ):
        pass
    with open_dataset(tmp_path / "out", plan):
        pass


def test_a_plan_that_made_no_row_may_be_changed(tmp_path: Path) -> None:
    plan, other = read(tmp_path, AT_REST), read(tmp_path, AT_REST.replace("seed = 7", "seed = 8"))
    with open_dataset(tmp_path / "out", plan):
        pass
    with open_dataset(tmp_path / "out", other), PartWriter(tmp_path / "out", row_columns(other, 3)) as parts:
        parts.add([result(0)])
    with pytest.raises(PlanMismatchError), open_dataset(tmp_path / "out", plan):
        pass


def test_a_part_that_is_damaged_is_named(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    with open_dataset(tmp_path / "out", plan):
        (tmp_path / "out" / "runs" / "part-000001.parquet").write_bytes(b"no parquet at all")
        with pytest.raises(PlanError, match=r"part-000001.parquet: is damaged; delete it"):
            completed_runs(tmp_path / "out", 8)


def test_two_processes_do_not_write_one_folder(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    plan = read(tmp_path, AT_REST)
    with (
        open_dataset(tmp_path / "out", plan),
        pytest.raises(InputError, match="another process writes there"),
        open_dataset(tmp_path / "out", plan),
    ):
        pass


def test_a_full_disk_leaves_no_half_part_and_what_was_written_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = read(tmp_path, AT_REST)
    out = tmp_path / "out"

    def full(table: Any, file: Any) -> None:
        file.write(b"some bytes")
        raise OSError(errno.ENOSPC, "No space left on device")

    with (
        open_dataset(out, plan),
        pytest.raises(OSError, match="No space"),
        PartWriter(out, row_columns(plan, 3)) as parts,
    ):
        parts.add([result(1)])
        parts.flush()
        monkeypatch.setattr(dataset.pq, "write_table", full)
        parts.add([result(2)])
        parts.flush()
    assert [each.name for each in (out / "runs").iterdir()] == ["part-000001.parquet"]
    assert pq.read_table(out / "runs" / "part-000001.parquet")["index"].to_pylist() == [1]
