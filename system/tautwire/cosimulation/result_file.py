"""Result files: rows of a run written to disk as they come, as Parquet or CSV by the file's name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..atomic_output import atomic_file
from ..errors import TautwireError
from ..provenance import Provenance, csv_metadata_path, refuse_foreign_csv_metadata

Array = NDArray[np.float64]
WriteRows = Callable[[Array], None]

PARQUET_SUFFIX = ".parquet"
BLOCK_BYTES = 2**22


@dataclass(frozen=True)
class Column:
    """A column of a result file, and the unit of its numbers."""

    name: str
    unit: str


class ResultFile:
    """A recorder that writes its rows block by block; it holds no more than one block of ``BLOCK_BYTES``.

    ``count`` rows were recorded so far. A row of the file is the time (s), then the observed outputs.
    """

    def __init__(self, width: int, write: WriteRows) -> None:
        self._block = np.empty((max(1, BLOCK_BYTES // (8 * width)), width), order="F")
        self._write = write
        self._filled = 0
        self.count = 0

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.cosimulation.Recorder`."""
        self._block[self._filled, 0] = time
        self._block[self._filled, 1:] = row
        self._filled += 1
        self.count += 1
        if self._filled == len(self._block):
            self.flush()

    def flush(self) -> None:
        """Write the rows that are still held."""
        if self._filled:
            self._write(self._block[: self._filled])
            self._filled = 0


@contextmanager
def open_result_file(
    target: Path, columns: Sequence[Column], provenance: Provenance | None = None
) -> Iterator[ResultFile]:
    """A result file that becomes ``target`` when the block ends well, or fails after some rows.

    It is Parquet where the name ends in ``.parquet``, with each column's unit in its field's metadata and the
    provenance in its schema's, else CSV, with its metadata beside it.

    Raises InputError where ``target`` or its metadata cannot be written; a TautwireError of the block, once there are
    rows, as one that says where these are. After anything else nothing is left.
    """
    failure: TautwireError | None = None
    is_parquet = target.suffix.lower() == PARQUET_SUFFIX
    if provenance is not None and not is_parquet:
        refuse_foreign_csv_metadata(target)
    writer = partial(_parquet_writer, provenance=provenance) if is_parquet else _csv_writer
    with atomic_file(target) as scratch, writer(scratch, columns) as write:
        result = ResultFile(len(columns), write)
        try:
            yield result
        except TautwireError as error:
            if not result.count:
                raise
            failure = error
        result.flush()
    if not is_parquet:
        write_csv_metadata(target, provenance)
    if failure is not None:
        raise TautwireError(f"{failure}; the run up to then is in {target}") from failure


def write_csv_metadata(target: Path, provenance: Provenance | None) -> None:
    """Writes the provenance of a CSV file beside it, where "CSV on the Web" looks for it; nothing where it is None.

    In the CSV file itself it would be a line that other programs do not expect. Raises InputError where another file
    stands there.
    """
    if provenance is not None:
        refuse_foreign_csv_metadata(target)
        with atomic_file(csv_metadata_path(target)) as scratch:
            scratch.write_text(provenance.csv_metadata(target.name), encoding="utf-8")


@contextmanager
def _parquet_writer(path: Path, columns: Sequence[Column], provenance: Provenance | None = None) -> Iterator[WriteRows]:
    """A row group for every block."""
    schema = pa.schema(
        [pa.field(column.name, pa.float64(), nullable=False, metadata={"unit": column.unit}) for column in columns],
        metadata=provenance.schema_metadata() if provenance else None,
    )
    with pq.ParquetWriter(path, schema, use_dictionary=False) as writer:
        yield lambda rows: writer.write_table(pa.Table.from_arrays([pa.array(c) for c in rows.T], schema=schema))


@contextmanager
def _csv_writer(path: Path, columns: Sequence[Column]) -> Iterator[WriteRows]:
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(column.name for column in columns) + "\n")
        # A process that is forked from this one must not inherit text that is yet to be written.
        file.flush()
        yield lambda rows: pd.DataFrame(rows).to_csv(file, header=False, index=False, lineterminator="\n")
