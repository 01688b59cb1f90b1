"""Recordings in MATLAB files: vectors, members of structs and matrices, named as the columns of a CSV file."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, format_value, raise_error
from ..input_files import readable_file
from ..robot.schema import AXES, QUATERNION_COLUMNS
from .column_map import ColumnMap
from .mat_array import MAX_BYTES, MatArray
from .mat_contents import list_arrays, mat_level, read_arrays
from .recording_table import MAX_COLUMNS, ColumnTable, ErrorSink, is_column_name, parse_header, require_samples

_MAT_MAGIC = (b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")
_REWRITE_HINT = "save it again in MATLAB with -v7, or as CSV or Parquet under another name"
_TABLE_HINT = (
    "save plain vectors: s = table2struct(t, 'ToScalar', true), of a timetable of timetable2table(t), "
    "or s.time = ts.Time, s.x = ts.Data of a timeseries, then save('fit.mat', '-struct', 's')"
)
_MATRICES = ("winch_speed", "rope_length", "tension", "position")
_POSE_MATRICES = {"position": AXES, "orientation": QUATERNION_COLUMNS}
_MAX_EXACT_INTEGER = 2**53


@dataclass(frozen=True)
class MatColumn:
    """A column by the laboratory's name, ``log.force_2``: the part of an ``array`` that holds it.

    ``standard_name`` is what the columns of a CSV file call it, None where its name is none of these. ``index`` counts
    the columns of a matrix from 0, its rows where ``is_transposed``.
    """

    name: str
    standard_name: str | None
    array: MatArray
    index: int = 0
    is_transposed: bool = False

    def values(self, content: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        """The numbers of the column, of the arrays by their paths."""
        matrix = content[self.array.path]
        return matrix[self.index] if self.is_transposed else matrix[:, self.index]


def is_mat(path: str | Path) -> bool:
    """Whether a file is MATLAB's by its name or its first bytes; raises RecordingError where it cannot be read."""
    with readable_file(path, RecordingError) as file, file.open("rb") as content:
        return file.suffix.lower() == ".mat" or content.read(len(_MAT_MAGIC[0])) in _MAT_MAGIC


def open_mat(path: str | Path, columns: ColumnMap, sink: ErrorSink = raise_error) -> ColumnTable:
    """Open the MATLAB file of a recording, of level 4, 5 or 7.3, the last of which needs the package h5py.

    Raises RecordingError where it is no MATLAB file, holds tables that only MATLAB reads, or a column is missing, named
    twice, complex, or not as long as ``time``. Errors in the names of columns go to the ``sink``.
    """
    file = str(path)
    with _readable_mat(file):
        level = mat_level(path)
        arrays = list_arrays(path, level)
        stored, unread = mat_columns(arrays, file)
        declared = {name for name, standard_name in columns.standard_names.items() if name != standard_name}
        own_names = [
            column.name if column.name in declared else _unique_name(column, stored, file) for column in stored
        ]
        names = columns.renamed([*own_names, *unread], file)
        header = parse_header(names, file, columns.cable_count, sink)
        scaled = replace(header, units=columns.units({}, file), scales=columns.scales)
        wanted = {name: column for name, column in zip(names, stored, strict=False) if name in header.known_names}
        sources = {column.array.path: column.array for column in wanted.values()}
        _require_readable_size(sources.values(), file)
        content = read_arrays(path, level, sources.values())
        numbers = {name: scaled.to_si(name, _numbers(column, content, file)) for name, column in wanted.items()}
    return ColumnTable(file, header.with_recorded_columns(scaled), numbers)


def mat_column_names(path: str | Path) -> dict[str, str | None]:
    """Names of the columns in a MATLAB file, as the laboratory has them, with the standard name where each has one.

    Raises RecordingError as open_mat does.
    """
    with _readable_mat(str(path)):
        columns, _ = mat_columns(list_arrays(path, mat_level(path)), str(path))
        return {column.name: column.standard_name for column in columns}


def mat_samples(path: str | Path) -> dict[str, NDArray[np.float64]]:
    """Numbers of the columns in a MATLAB file by the laboratory's names, each (N,), rounded to float64.

    Raises RecordingError as open_mat does.
    """
    file = str(path)
    with _readable_mat(file):
        level = mat_level(path)
        columns, _ = mat_columns(list_arrays(path, level), file)
        sources = {column.array.path: column.array for column in columns}
        _require_readable_size(sources.values(), file)
        content = read_arrays(path, level, sources.values())
        return {column.name: np.asarray(column.values(content), dtype=np.float64) for column in columns}


@contextmanager
def _readable_mat(file: str) -> Iterator[None]:
    """Raises RecordingError for what scipy and h5py raise on a corrupt file, which may be anything."""
    try:
        yield
    except RecordingError:
        raise
    except Exception as problem:
        reason = format_value(str(problem), 200)
        raise RecordingError(file, f"cannot be read as a MATLAB file ({reason})", _REWRITE_HINT) from problem


def mat_columns(arrays: Sequence[MatArray], file: str) -> tuple[list[MatColumn], list[str]]:
    """The columns in these arrays by the laboratory's names, and the paths of arrays that are not read.

    Samples are as many as ``time`` has numbers, or else as most vectors, or as the longer side of most matrices. A
    matrix has a column for each of its columns where it has as many rows as there are samples, or for each of its rows
    where it has as many columns.

    Raises RecordingError where an array that is named as a column has another length, or a matrix could be read both
    ways.
    """
    for array in arrays:
        if array.is_table:
            problem = f"is a {format_value(array.class_name)}, an object that only MATLAB reads"
            raise RecordingError(f"{file}: {format_value(array.path)}", problem, _TABLE_HINT)
    _require_vector_of_time(arrays, file)
    sample_count = _sample_count(arrays, file)
    columns: list[MatColumn] = []
    unread = []
    for array in arrays:
        array_columns = list(_columns_of(array, sample_count, file))
        columns += array_columns
        if len(columns) > MAX_COLUMNS:
            raise RecordingError(file, f"has more than {MAX_COLUMNS} columns", "keep those of the robot")
        unread += [] if array_columns else [array.path]
    return columns, unread


def _require_vector_of_time(arrays: Sequence[MatArray], file: str) -> None:
    """Raises RecordingError where ``time`` has more than two dimensions, which tells no number of samples."""
    for array in arrays:
        if _last_part(array) == "time" and array.is_numeric and len(array.shape) > 2:
            problem = f"is {' x '.join(map(str, array.shape))}, must be a vector with one number per sample"
            hint = "save squeeze(time), and other signals with a row for each sample"
            raise RecordingError(f"{file}: {format_value(array.path)}", problem, hint)


def _sample_count(arrays: Sequence[MatArray], file: str) -> int:
    """Number of samples, that of ``time`` or else of most vectors, of most matrices where there are no vectors."""
    numeric = [array for array in arrays if array.is_numeric and len(array.shape) == 2 and math.prod(array.shape) > 1]
    vectors = [array for array in numeric if min(array.shape) == 1]
    times = [array for array in vectors if _last_part(array) == "time"]
    lengths = Counter(max(array.shape) for array in times or vectors or numeric)
    count = lengths.most_common(1)[0][0] if lengths else 0
    require_samples(count, file)
    return count


def _columns_of(array: MatArray, sample_count: int, file: str) -> Iterator[MatColumn]:
    last_part = _last_part(array)
    is_matrix = last_part in _MATRICES or _is_quaternion(array, sample_count)
    is_known = is_matrix or is_column_name(last_part)
    problem = _shape_problem(array, sample_count, last_part)
    if problem:
        if is_known:
            raise RecordingError(f"{file}: {format_value(array.path)}", *problem)
        return
    is_transposed = array.shape[0] != sample_count
    column_count = array.shape[0] if is_transposed else array.shape[1]
    for index in range(column_count):
        name, standard_name = array.path, last_part if is_known else None
        if is_matrix or column_count > 1:
            name = f"{array.path}_{index + 1}"
        if is_matrix:
            pose_names = _POSE_MATRICES.get(last_part)
            standard_name = pose_names[index] if pose_names else f"{last_part}_{index + 1}"
        yield MatColumn(name, standard_name, array, index, is_transposed)


def _is_quaternion(array: MatArray, sample_count: int) -> bool:
    """Whether an array holds a quaternion per sample; an orientation of other size is not read."""
    is_orientation = _last_part(array) == "orientation" and array.is_numeric and not array.is_complex
    return is_orientation and sorted(array.shape) == sorted((sample_count, len(QUATERNION_COLUMNS)))


def _shape_problem(array: MatArray, sample_count: int, last_part: str) -> tuple[str, str] | None:
    """Why an array has no columns of so many samples, and the hint; None where it has."""
    if not array.is_numeric or array.is_complex:
        problem = "is complex" if array.is_complex else "contains no numbers"
        return problem, "save one real number per sample, in SI units"
    size = " x ".join(map(str, array.shape))
    if len(array.shape) != 2 or sample_count not in array.shape:
        return f"is {size}, there are {sample_count} samples", "save one number per sample"
    rows, columns = array.shape
    if rows == columns > 1:
        hint = "save more or fewer samples, or each column as a vector of its own"
        return f"is {size}, its rows or its columns could be the samples", hint
    column_count = columns if rows == sample_count else rows
    most = len(AXES) if last_part == "position" else 1 if is_column_name(last_part) else MAX_COLUMNS
    if column_count > most or (last_part == "position" and column_count < most):
        return f"is {size}, must have {most} columns", "save one number per sample and column"
    return None


def _last_part(array: MatArray) -> str:
    return array.path.rpartition(".")[2]


def _unique_name(column: MatColumn, columns: Sequence[MatColumn], file: str) -> str:
    """The standard name of a column, or its own; raises RecordingError where another has the same standard name."""
    if column.standard_name is None:
        return column.name
    paths = [each.array.path for each in columns if each.standard_name == column.standard_name]
    if len(paths) > 1:
        problem = f"{format_value(paths[0])} and {format_value(paths[1])} are both the column {column.standard_name}"
        raise RecordingError(file, problem, "keep one of them")
    return column.standard_name


def _require_readable_size(arrays: Iterable[MatArray], file: str) -> None:
    size = sum(8 * math.prod(array.shape) for array in arrays)
    if size > MAX_BYTES:
        raise RecordingError(file, f"has {size} bytes of numbers, at most {MAX_BYTES} are read", "cut it into several")


def _numbers(column: MatColumn, content: Mapping[str, NDArray[Any]], file: str) -> NDArray[np.float64]:
    """The numbers of a column as float64; raises RecordingError where these would not be the same."""
    values, where = column.values(content), f"{file}: {format_value(column.name)}"
    if values.dtype.kind not in "biuf":
        problem = "is complex" if values.dtype.kind == "c" else "contains no numbers"
        raise RecordingError(where, problem, "save one real number per sample, in SI units")
    if values.dtype.kind in "iu" and np.any((values > _MAX_EXACT_INTEGER) | (values < -_MAX_EXACT_INTEGER)):
        raise RecordingError(where, "has integers beyond 2^53, which are not exact as float64", "save them as double")
    return np.ascontiguousarray(values, dtype=np.float64)
