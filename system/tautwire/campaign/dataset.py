"""The rows of a campaign on disk: Parquet parts that are there whole or not at all, and what is done already."""

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
from ..errors import InputError
from .errors import OtherPlanError, PlanError
from .plan import Plan
from .rows import RowColumn
from .run import Result

RUNS, SERIES, BOOK = "runs", "series", "campaign.json"
LOCK = ".campaign.lock"
PARTIAL = ".partial"
TYPES = {"whole": pa.int64(), "number": pa.float64(), "flag": pa.bool_(), "text": pa.string()}


@contextmanager
def opened(folder: Path, plan: Plan) -> Iterator[None]:
    """The folder of a campaign, made where it is not there, and this process alone in it until the block ends.

    Raises OtherPlanError where rows of another plan are there, InputError where another process writes them.
    """
    try:
        (folder / RUNS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(folder), f"cannot write there: {error.strerror}", "choose another --out") from error
    with _alone(folder):
        _require_same(folder, plan)
        for name in (RUNS, SERIES):
            for left in (folder / name).glob(f"*{PARTIAL}"):
                left.unlink()
        # Series are written first: without their rows they are of runs that will be made again.
        for part in (folder / SERIES).glob("*.parquet"):
            if not (folder / RUNS / part.name).exists():
                part.unlink()
        yield


def _require_same(folder: Path, plan: Plan) -> None:
    book = folder / BOOK
    if not any((folder / RUNS).glob("*.parquet")):
        _write_whole(book, json.dumps({"digest": plan.digest(), "tautwire": __version__}).encode())
        return
    if not book.exists():
        raise OtherPlanError(str(folder), "unknown", plan.digest())
    try:
        made_by = str(json.loads(book.read_text(encoding="utf-8"))["digest"])
    except (ValueError, KeyError, TypeError) as error:
        raise PlanError(str(book), "is damaged", "choose another --out") from error
    if made_by != plan.digest():
        raise OtherPlanError(str(folder), made_by, plan.digest())


def done_rows(folder: Path, count: int) -> NDArray[np.bool_]:
    """Which of ``count`` runs have a row, shape (count,); raises PlanError where a part cannot be read."""
    done = np.zeros(count, dtype=bool)
    for part in parts_of(folder):
        done[_read(part, ["index"])["index"].to_numpy()] = True
    return done


def parts_of(folder: Path, name: str = RUNS) -> list[Path]:
    """The parts of the rows, or of the series, in the order in which they were written."""
    return sorted((folder / name).glob("*.parquet"))


def read_rows(folder: Path, columns: Sequence[str] | None = None, name: str = RUNS) -> pa.Table:
    """Some columns of all rows by ascending index; of all series, by index and time."""
    wanted = None if columns is None else list(dict.fromkeys(["index", *columns]))
    table = pa.concat_tables([_read(part, wanted) for part in parts_of(folder, name)])
    order = np.argsort(table["index"].to_numpy(), kind="stable")
    return table.take(pa.array(order))


def _read(part: Path, columns: list[str] | None) -> pa.Table:
    try:
        return pq.read_table(part, columns=columns, partitioning=None)
    except (pa.ArrowInvalid, KeyError) as error:
        raise PlanError(str(part), "is damaged", "delete it; its runs are then made again") from error


class Parts:
    """Rows on their way to disk: kept until :meth:`flush`, which writes them as one part with their series."""

    def __init__(self, folder: Path, columns: Sequence[RowColumn]) -> None:
        self._folder = folder
        self._schema = pa.schema([pa.field(each.name, TYPES[each.kind]) for each in columns])
        self._kept: list[Result] = []
        taken = [int(part.stem.rpartition("-")[2]) for part in parts_of(folder)]
        self._next = max(taken, default=0) + 1

    def add(self, results: Sequence[Result]) -> None:
        """Keep some rows."""
        self._kept += results

    @property
    def waiting(self) -> int:
        """How many rows are kept."""
        return len(self._kept)

    def flush(self) -> None:
        """Write what is kept, series first; raises OSError where the disk refuses, and then keeps it."""
        if not self._kept:
            return
        name = f"part-{self._next:06d}.parquet"
        series = _series_table(self._kept)
        if series is not None:
            _write_table(self._folder / SERIES / name, series)
        _write_table(self._folder / RUNS / name, pa.Table.from_pylist([r.row for r in self._kept], self._schema))
        self._next += 1
        self._kept = []

    def __enter__(self) -> Parts:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write what is kept, also where the block ends early; a disk that refuses is told once."""
        with suppress(OSError) if isinstance(error, OSError) else nullcontext():
            self.flush()


def _series_table(results: Sequence[Result]) -> pa.Table | None:
    kept = [result for result in results if result.series]
    if not kept:
        return None
    index = np.concatenate([np.full(len(each.series["time"]), each.row["index"]) for each in kept])
    columns = {name: np.concatenate([each.series[name] for each in kept]) for name in kept[0].series}
    return pa.table({"index": index.astype(np.int64), **columns})


def _write_table(path: Path, table: pa.Table) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(path.name + PARTIAL)
    try:
        with beside.open("wb") as file:
            pq.write_table(table, file)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def _write_whole(path: Path, content: bytes) -> None:
    beside = path.with_name(path.name + PARTIAL)
    beside.write_bytes(content)
    beside.replace(path)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Hold a lock that ends with this process, where the system has such."""
    fcntl: Any
    try:
        import fcntl
    except ImportError:
        yield
        return
    with (folder / LOCK).open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            mend = "wait until it has ended, or choose another --out"
            raise InputError(str(folder), "another process writes there", mend) from error
        yield
