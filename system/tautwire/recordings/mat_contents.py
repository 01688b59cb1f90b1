"""Contents of MATLAB files of levels 4, 5 and 7.3: a list of their arrays, and those that are wanted."""

from __future__ import annotations

import math
import struct
import warnings
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from .mat_array import MAX_ARRAYS, MAX_BYTES, MAX_DEPTH, MatArray, MatFormatError
from .mat_level_5 import HEADER_SIZE, arrays_of_level_5

_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
# The version and the mark of the byte order at the end of the header, in both orders.
_LEVEL_5 = (b"\x00\x01IM", b"\x01\x00MI")
_LEVEL_73 = (b"\x00\x02IM", b"\x02\x00MI")

_LEVEL_4_SIZES = {0: 8, 1: 4, 2: 4, 3: 2, 4: 2, 5: 1}  # bytes of a number by the type's digit
_PIECE = 2**16  # bytes


def mat_level(path: str | Path) -> str:
    """Level of a MATLAB file by its first bytes: ``4``, ``5`` or ``7.3``; raises MatFormatError where it is none."""
    with Path(path).open("rb") as file:
        head = file.read(HEADER_SIZE)
    if head.startswith(_HDF5_MAGIC) or head[124:] in _LEVEL_73:
        return "7.3"
    if head[124:] in _LEVEL_5:
        return "5"
    # Level 4 has no mark; one of its first four bytes is zero, none of a text is.
    if len(head) >= 20 and 0 in head[:4]:
        return "4"
    raise MatFormatError("its first bytes are not those of MATLAB")


def list_arrays(path: str | Path, level: str) -> list[MatArray]:
    """List the arrays of a MATLAB file, without reading them; raises MatFormatError where they are too many."""
    if level == "7.3":
        with _hdf5_file(path) as file:
            return list(_arrays_in_group(file, "", [MAX_ARRAYS]))
    if level == "5":
        with Path(path).open("rb") as file:
            return list(arrays_of_level_5(file))
    return list(_arrays_of_level_4(path))


def read_arrays(path: str | Path, level: str, wanted: Iterable[MatArray]) -> Mapping[str, NDArray[Any]]:
    """Read numeric arrays as MATLAB has them, by their paths; raises what scipy or h5py do where it is not valid."""
    paths = [array.path for array in wanted]
    if level == "7.3":
        with _hdf5_file(path) as file:
            # MATLAB stores the last index first.
            return {name: np.asarray(file[name.replace(".", "/")][()]).T for name in paths}
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        variables = [name.partition(".")[0] for name in paths]
        content = loadmat(str(path), appendmat=False, variable_names=variables, struct_as_record=False)
    return {name: _member(content, name) for name in paths}


def _member(content: Mapping[str, Any], path: str) -> NDArray[Any]:
    variable, *members = path.split(".")
    value = content[variable]
    for member in members:
        value = getattr(value[0, 0], member)
    return np.asarray(value)


def _arrays_of_level_4(path: str | Path) -> Iterator[MatArray]:
    """List the arrays of a file of level 4 by their headers, each of five integers and a name."""
    size = Path(path).stat().st_size
    with Path(path).open("rb") as file:
        order = "<" if 0 <= struct.unpack("<i", file.read(4))[0] <= 5000 else ">"
        file.seek(0)
        while header := file.read(20):
            if len(header) < 20:
                raise MatFormatError("it ends within an array")
            kind, rows, columns, has_imaginary_part, name_length = struct.unpack(f"{order}5i", header)
            number_size = _LEVEL_4_SIZES.get(kind % 1000 // 10)
            if number_size is None or kind % 10 > 2 or min(kind, rows, columns, name_length) < 0:
                raise MatFormatError(f"an array has the shape {rows} x {columns} and the type {kind}")
            name = file.read(min(name_length, _PIECE)).partition(b"\0")[0].decode("latin-1")
            following = file.tell() + rows * columns * number_size * (2 if has_imaginary_part == 1 else 1)
            if following > size or name_length > _PIECE:
                raise MatFormatError("it ends within an array")
            yield MatArray(name, (rows, columns), has_imaginary_part == 1, "other" if kind % 10 else "")
            file.seek(following)


def _hdf5_file(path: str | Path) -> Any:
    """The HDF5 file open for reading; raises RecordingError where h5py is not installed."""
    try:
        import h5py  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError as problem:
        message = "reading MATLAB files of level 7.3 needs the package h5py, which is not installed"
        raise RecordingError(str(path), message, "run pip install h5py, or save it in MATLAB with -v7") from problem
    return h5py.File(path, "r")


def _arrays_in_group(group: Any, prefix: str, allowed: list[int], depth: int = 0) -> Iterator[MatArray]:
    """The arrays of a group and of those in it; links that lead out of it, or to other files, are not followed."""
    import h5py

    for name in group:
        allowed[0] -= 1
        if allowed[0] < 0 or depth > MAX_DEPTH:
            raise MatFormatError(f"it holds more than {MAX_ARRAYS} arrays, or some of them deeper than {MAX_DEPTH}")
        path = f"{prefix}{name}"
        # Names with # are what objects and cells consist of; those with a point cannot be MATLAB's.
        if path.startswith("#") or "." in name:
            continue
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            yield MatArray(path, (), class_name="link")
            continue
        value = group[name]
        class_name = _matlab_class(value)
        if isinstance(value, h5py.Group) and class_name in ("", "struct"):
            yield from _arrays_in_group(value, f"{path}.", allowed, depth + 1)
        else:
            yield _hdf5_array(value, path, class_name)


def _matlab_class(value: Any) -> str:
    text = value.attrs.get("MATLAB_class", b"")
    return text.decode("latin-1") if isinstance(text, bytes) else str(text)


def _hdf5_array(value: Any, path: str, class_name: str) -> MatArray:
    import h5py

    if "MATLAB_object_decode" in value.attrs or not isinstance(value, h5py.Dataset) or value.shape is None:
        return MatArray(path, (), class_name=class_name or "other")
    shape = value.shape[::-1]
    is_complex = value.dtype.kind == "c"
    is_numeric = value.dtype.kind in "biufc" and class_name not in ("char", "cell", "struct", "function_handle")
    if not is_numeric or "MATLAB_empty" in value.attrs or value.is_virtual or value.external:
        return MatArray(path, shape, class_name="other")
    if math.prod(value.chunks or (1,)) * value.dtype.itemsize > MAX_BYTES:
        raise MatFormatError(f"{path} is in chunks of more than {MAX_BYTES} bytes")
    return MatArray(path, shape, is_complex)
