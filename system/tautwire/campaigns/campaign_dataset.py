"""The dataset of a campaign on disk: Parquet parts written atomically, a manifest and a lock."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from .. import __version__
from ..atomic_output import acquire_lock
from ..errors import InputError
from ..provenance import Provenance
from .campaign_plan import Plan, PlanError, PlanMismatchError
from .campaign_run import RunResult
from .dataset_schema import RowColumn

RUNS_FOLDER, SERIES_FOLDER, MANIFEST_FILE = "runs", "series", "campaign.json"
LOCK_FILE = ".campaign.lock"
PARTIAL_SUFFIX = ".partial"
ARROW_TYPES = {"whole": pa.int64(), "number": pa.float64(), "flag": pa.bool_(), "text": pa.string()}


@contextmanager
def open_dataset(folder: Path, plan: Plan, provenance: Provenance | None = None) -> Iterator[None]:
    """Open the folder of a campaign, created if absent, with an exclusive lock until the block ends.

    Raises PlanMismatchError where it contains rows of another plan, InputError where another process writes there.
    """
    try:
        (folder / RUNS_FOLDER).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(folder), f"cannot write there: {error.strerror}", "choose another --out") from error
    with _exclusive_lock(folder):
        _require_same_plan(folder, plan, provenance)
        for name in (RUNS_FOLDER, SERIES_FOLDER):
            for partial_file in (folder / name).glob(f"*{PARTIAL_SUFFIX}"):
                partial_file.unlink()
        # Series are written before rows: a series part without its rows is of runs that will be repeated.
        for part in (folder / SERIES_FOLDER).glob("*.parquet"):
            if not (folder / RUNS_FOLDER / part.name).exists():
                part.unlink()
        yield


def _require_same_plan(folder: Path, plan: Plan, provenance: Provenance | None) -> None:
    manifest = folder / MANIFEST_FILE
    if not any((folder / RUNS_FOLDER).glob("*.parquet")):
        document: dict[str, Any] = {"digest": plan.digest(), "tautwire": __version__}
        document |= {"provenance": provenance.document()} if provenance else {}
        _write_atomically(manifest, json.dumps(document).encode())
        return
    if not manifest.exists():
        raise PlanMismatchError(str(folder), "unknown", plan.digest())
    try:
        stored_digest = str(json.loads(manifest.read_text(encoding="utf-8"))["digest"])
    except (ValueError, KeyError, TypeError) as error:
        raise PlanError(str(manifest), "is damaged", "choose another --out") from error
    if stored_digest != plan.digest():
        raise PlanMismatchError(str(folder), stored_digest, plan.digest())


def completed_runs(folder: Path, count: int) -> NDArray[np.bool_]:
    """Mask of the runs that have a row, shape (count,); raises PlanError where a part cannot be read."""
    completed = np.zeros(count, dtype=bool)
    for part in part_files(folder):
        completed[_read_part(part, ["index"])["index"].to_numpy()] = True
    return completed


def part_files(folder: Path, subfolder: str = RUNS_FOLDER) -> list[Path]:
    """The parts of the rows, or of the series, in the order in which they were written."""
    return sorted((folder / subfolder).glob("*.parquet"))


def read_rows(folder: Path, columns: Sequence[str] | None = None, subfolder: str = RUNS_FOLDER) -> pa.Table:
    """Read some columns of all rows, sorted by index; of all series, by index and time."""
    selected = None if columns is None else list(dict.fromkeys(["index", *columns]))
    table = pa.concat_tables([_read_part(part, selected) for part in part_files(folder, subfolder)])
    order = np.argsort(table["index"].to_numpy(), kind="stable")
    return table.take(pa.array(order))


def _read_part(part: Path, columns: list[str] | None) -> pa.Table:
    try:
        return pq.read_table(part, columns=columns, partitioning=None)
    except (pa.ArrowInvalid, KeyError) as error:
        raise PlanError(str(part), "is damaged", "delete it; its runs are then repeated") from error


class PartWriter:
    """Buffered writer of rows: :meth:`flush` writes them as one Parquet part, with their series as another."""

    def __init__(self, folder: Path, columns: Sequence[RowColumn], provenance: Provenance | None = None) -> None:
        self._folder = folder
        self._metadata = provenance.schema_metadata() if provenance else None
        self._schema = pa.schema([pa.field(each.name, ARROW_TYPES[each.kind]) for each in columns])
        self._buffer: list[RunResult] = []
        part_numbers = [int(part.stem.rpartition("-")[2]) for part in part_files(folder)]
        self._next_number = max(part_numbers, default=0) + 1

    def add(self, results: Sequence[RunResult]) -> None:
        """Add rows to the buffer."""
        self._buffer += results

    @property
    def buffered_count(self) -> int:
        """Number of rows in the buffer."""
        return len(self._buffer)

    def flush(self) -> None:
        """Write the buffer, series first; raises OSError where the disk refuses, and then keeps the buffer."""
        if not self._buffer:
            return
        name = f"part-{self._next_number:06d}.parquet"
        series = _series_table(self._buffer)
        if series is not None:
            _write_table(self._folder / SERIES_FOLDER / name, series.replace_schema_metadata(self._metadata))
        rows = pa.Table.from_pylist([each.row for each in self._buffer], self._schema)
        _write_table(self._folder / RUNS_FOLDER / name, rows.replace_schema_metadata(self._metadata))
        self._next_number += 1
        self._buffer = []

    def __enter__(self) -> PartWriter:
        return self

    def __exit__(
        self, error_type: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Flush the buffer, also where the block ends early; an error of the disk is raised only once."""
        with suppress(OSError) if isinstance(error, OSError) else nullcontext():
            self.flush()


def _series_table(results: Sequence[RunResult]) -> pa.Table | None:
    with_series = [result for result in results if result.series]
    if not with_series:
        return None
    index = np.concatenate([np.full(len(each.series["time"]), each.row["index"]) for each in with_series])
    columns = {name: np.concatenate([each.series[name] for each in with_series]) for name in with_series[0].series}
    return pa.table({"index": index.astype(np.int64), **columns})


def _write_table(path: Path, table: pa.Table) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    try:
        with partial.open("wb") as file:
            pq.write_table(table, file)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _write_atomically(path: Path, content: bytes) -> None:
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    partial.write_bytes(content)
    partial.replace(path)


@contextmanager
def _exclusive_lock(folder: Path) -> Iterator[None]:
    """Hold an exclusive file lock that ends with this process, where files can be locked."""
    with (folder / LOCK_FILE).open("w") as file:
        try:
            acquire_lock(file)
        except BlockingIOError as error:
            hint = "wait until it ends, or choose another --out"
            raise InputError(str(folder), "another process writes there", hint) from error
        yield
