"""Recordings in Parquet files: the columns of the CSV format, as numbers."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..errors import RecordingError, format_value, raise_error
from ..input_files import readable_file
from .column_map import ColumnMap
from .recording_table import ColumnTable, ErrorSink, parse_header, require_samples

BATCH_ROWS = 2**16

_PARQUET_MAGIC = b"PAR1"
_REWRITE_HINT = "export it again as Parquet, or as CSV under another name"
_NUMERIC_TYPE_CHECKS = (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal, pa.types.is_null)


def is_parquet(path: str | Path) -> bool:
    """Whether a file is Parquet by its name or its first bytes; raises RecordingError where it cannot be read."""
    with readable_file(path, RecordingError) as file, file.open("rb") as content:
        return file.suffix.lower() == ".parquet" or content.read(len(_PARQUET_MAGIC)) == _PARQUET_MAGIC


def open_parquet(path: str | Path, columns: ColumnMap, sink: ErrorSink = raise_error) -> ColumnTable:
    """Open the Parquet file of a recording; raises RecordingError where it is invalid, a column missing or not numeric.

    Errors in the names of columns go to the ``sink``.
    """
    file = str(path)
    with _readable_parquet(file), pq.ParquetFile(path) as content:
        require_samples(content.metadata.num_rows, file)
        names = columns.renamed(content.schema_arrow.names, file)
        header = parse_header(names, file, columns.cable_count, sink)
        scaled = replace(header, units=columns.units({}, file), scales=columns.scales)
        stored = dict(zip(names, content.schema_arrow.names, strict=True))
        # Column by column, so that Arrow never holds more than one in memory.
        numbers = {
            name: scaled.to_si(name, _read_column(content, stored[name], f"{file}: column {stored[name]}"))
            for name in header.known_names
        }
    return ColumnTable(file, header.with_recorded_columns(scaled), numbers)


def parquet_column_names(path: str | Path) -> tuple[str, ...]:
    """Names of the columns in a Parquet file, as recorded; raises RecordingError as open_parquet does."""
    with _readable_parquet(str(path)), pq.ParquetFile(path) as content:
        return tuple(content.schema_arrow.names)


def parquet_samples(path: str | Path) -> dict[str, NDArray[np.float64]]:
    """Numbers of the columns in a Parquet file that have a numeric type and a name of their own, each (N,).

    NaN where a cell is null. Raises RecordingError as open_parquet does.
    """
    file = str(path)
    with _readable_parquet(file), pq.ParquetFile(path) as content:
        require_samples(content.metadata.num_rows, file)
        numeric = [
            each.name for each in content.schema_arrow if any(is_of(each.type) for is_of in _NUMERIC_TYPE_CHECKS)
        ]
        single = [name for name in numeric if content.schema_arrow.names.count(name) == 1]
        return {name: _read_column(content, name, f"{file}: column {name}") for name in single}


@contextmanager
def _readable_parquet(file: str) -> Iterator[None]:
    """Raises RecordingError for what pyarrow raises on a corrupt file."""
    try:
        yield
    except (pa.ArrowException, OSError, ValueError) as problem:
        reason = format_value(str(problem), 200)
        raise RecordingError(file, f"cannot be read as Parquet ({reason})", _REWRITE_HINT) from problem


def _read_column(content: pq.ParquetFile, name: str, where: str) -> NDArray[np.float64]:
    arrow_type = content.schema_arrow.field(name).type
    if not any(numeric(arrow_type) for numeric in _NUMERIC_TYPE_CHECKS):
        raise RecordingError(
            where, f"holds {format_value(str(arrow_type))}, not numbers", "store it as float64, in SI units"
        )
    cells = [
        batch.column(name).cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
        for batch in content.iter_batches(BATCH_ROWS, columns=[name], use_threads=False)
    ]
    column = np.concatenate([np.empty(0), *cells])
    if len(column) != content.metadata.num_rows:
        problem = f"has {len(column)} rows, the file says {content.metadata.num_rows}"
        raise RecordingError(where, problem, _REWRITE_HINT)
    return column
