"""Recordings in Parquet files: the columns that a CSV file would have, as numbers."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..errors import RecordingError, at_once, shown
from ..input_file import readable_file
from .columns import ColumnTable
from .header import Refuse, header_of, require_samples

BATCH = 2**16

_MAGIC = b"PAR1"
_ANEW = "write it anew as Parquet, or as CSV under another name"
_NUMERIC = (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal, pa.types.is_null)


def is_parquet(path: str | Path) -> bool:
    """Whether a file is Parquet by its name or its first bytes; raises RecordingError where it cannot be read."""
    with readable_file(path, RecordingError) as file, file.open("rb") as content:
        return file.suffix.lower() == ".parquet" or content.read(len(_MAGIC)) == _MAGIC


def open_parquet(path: str | Path, cable_count: int, sink: Refuse = at_once) -> ColumnTable:
    """The Parquet file of a recording; raises RecordingError where it is none, or a column is missing or no number.

    What is wrong with the names of columns goes to the ``sink``.
    """
    file = str(path)
    try:
        with pq.ParquetFile(path) as content:
            require_samples(content.metadata.num_rows, file)
            header = header_of(content.schema_arrow.names, file, cable_count, sink)
            # One by one, so that what Arrow holds is never more than one column.
            columns = {name: _column(content, name, f"{file}: column {name}") for name in header.known}
    except (pa.ArrowException, OSError, ValueError) as problem:
        raise RecordingError(file, f"cannot be read as Parquet ({shown(str(problem), 200)})", _ANEW) from problem
    return ColumnTable(file, header, columns)


def _column(content: pq.ParquetFile, name: str, where: str) -> NDArray[np.float64]:
    kind = content.schema_arrow.field(name).type
    if not any(numeric(kind) for numeric in _NUMERIC):
        raise RecordingError(where, f"holds {shown(str(kind))}, not numbers", "store it as float64, in SI units")
    cells = [
        batch.column(name).cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
        for batch in content.iter_batches(BATCH, columns=[name], use_threads=False)
    ]
    column = np.concatenate([np.empty(0), *cells])
    if len(column) != content.metadata.num_rows:
        problem = f"has {len(column)} rows, the file says {content.metadata.num_rows}"
        raise RecordingError(where, problem, _ANEW)
    return column
