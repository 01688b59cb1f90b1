"""Formats that are no text, by the bytes with which their files begin, and what makes a readable file of each."""

from __future__ import annotations

_PARQUET = "then write it with pandas: to_parquet, or to_csv"
# By first bytes: what the file is, and how to get text, or a format that is read, out of it.
_FORMATS: dict[bytes, tuple[str, str]] = {
    b"PK\x03\x04": ("is a zip archive or a spreadsheet, not text", "save it as {format} in UTF-8"),
    b"\x1f\x8b": ("is compressed by gzip, not text", "decompress it first"),
    b"BZh": ("is compressed by bzip2, not text", "decompress it first"),
    b"\xfd7zXZ\0": ("is compressed by xz, not text", "decompress it first"),
    b"7z\xbc\xaf\x27\x1c": ("is a 7z archive, not text", "unpack it first"),
    b"\x28\xb5\x2f\xfd": ("is compressed by zstd, not text", "decompress it first"),
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": (
        "is an old spreadsheet (.xls) or another file of old Office, not text",
        "open it there and save it as {format} in UTF-8",
    ),
    b"\x93NUMPY": ("is an array of NumPy (.npy), not text", f"load it with numpy.load, {_PARQUET}"),
    b"TDSm": (
        "is a TDMS file of LabVIEW, not text",
        "save it as {format} in UTF-8: TdmsFile(...).as_dataframe().to_csv of the package nptdms does",
    ),
    b"TDSh": (
        "is the index of a TDMS file (.tdms_index), not text",
        "take the .tdms file beside it, saved as {format}",
    ),
    b"\x89HDF\r\n\x1a\n": (
        "is HDF5, not text",
        "read it with h5py or pandas.read_hdf and write Parquet or {format}; one of MATLAB (-v7.3) is named .mat",
    ),
    b"\x89PNG": ("is a picture (PNG), not text", "save the numbers, as {format} in UTF-8"),
    b"\xff\xd8\xff": ("is a picture (JPEG), not text", "save the numbers, as {format} in UTF-8"),
    b"%PDF": ("is a PDF, not text", "save the numbers, as {format} in UTF-8"),
    b"#ROSBAG": (
        "is a bag of ROS 1, not text",
        "convert it to one of ROS 2 (rosbags-convert), which is read, or save it as {format}",
    ),
    b"SQLite format 3\0": ("is an SQLite database, not text", "save its table as {format} in UTF-8"),
    b"ARROW1": ("is a Feather or Arrow file, not text", f"load it with pandas.read_feather, {_PARQUET}"),
    b"\x80\x04\x95": ("is a pickle of Python, not text", f"load it with pandas.read_pickle, {_PARQUET}"),
    b"\x80\x05\x95": ("is a pickle of Python, not text", f"load it with pandas.read_pickle, {_PARQUET}"),
    b"c3d": ("is a C3D file, not text", "save it as {format} in UTF-8"),
}
_C3D_MARK = (1, 0x50)  # the second byte of a C3D file, behind the number of a block


def foreign_format(head: bytes, expected_format: str) -> tuple[str, str] | None:
    """What a file with these first bytes is, as a clause, and what to do; None where it is no format that is known."""
    marks = [mark for mark in _FORMATS if head.startswith(mark)]
    if not marks and len(head) > _C3D_MARK[0] and head[_C3D_MARK[0]] == _C3D_MARK[1] and b"\0" in head[:64]:
        marks = [b"c3d"]
    if not marks:
        return None
    problem, hint = _FORMATS[marks[0]]
    return problem, hint.format(format=expected_format)


def utf_16_without_mark(head: bytes) -> str | None:
    """The byte order of UTF-16 that begins without its mark: every other byte of ASCII text is then zero."""
    even, odd = head[0:1000:2], head[1:1000:2]
    if len(head) < 8:
        return None
    # Other text has no zero byte at all; a few letters beyond Latin have none in either place.
    if even.count(0) == 0 and odd.count(0) >= 0.9 * len(odd):
        return "utf-16-le"
    return "utf-16-be" if odd.count(0) == 0 and even.count(0) >= 0.9 * len(even) else None
