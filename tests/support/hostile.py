"""Robot files, recordings and tables as they must not be, and the same in ways in which they may be."""

from __future__ import annotations

import gzip
import io
import zipfile
from collections.abc import Callable, Sequence
from functools import partial

import pandas as pd
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

Cells = list[list[str]]

ROBOT_VALUES = (
    *('""', '"x"', '"\\u0000"', '"ä 🤖 \\u202e"', '"a\\nb"', '"linear"', '"Logarithmic"', "''", '"1,5"', '"../x.fmu"'),
    *("nan", "-nan", "inf", "-inf", "0", "-0.0", "-1", "1e-320", "1e-15", "1e15", "1e300", "1e999", "1_000", "0x7f"),
    *("9" * 400, "9" * 5000, "true", "[]", "{}", "[1, 2, 3]", "[1.0, 2.0]", "[nan, 0, 0]", "[0, 0, 0]", "[1e15, 0, 0]"),
    *('["a", "b", "c"]', "[[], [], []]", "[" * 2000 + "]" * 2000, "1979-05-27T07:32:00Z", "07:32:00", "1,5", "1.5.2"),
    *("'''", '"""', "[[", "# nothing", "", "\\", "[true, false, true]", "[28.86, 0.0, 5.0]", "[-30.0, 0.0, 5.0]"),
)
ROBOT_LINES = (
    *("[effect.damping]", "[effect.damping]\ndamping = 1e9", "[[effect.damping]]\ndamping = 1e9\ncables = [0]"),
    *(
        "[effect.nothing]",
        "[effect]\ndamping = 3",
        "[formula]\nforce_x = '1 +'",
        "[formula]\ntension = '(' * 3",
        "[cable]",
    ),
    *(
        "[winch]\ndrum_radius = -1",
        "[winch]",
        "[fmu]\nplatform = 'absent.fmu'",
        "[fmu]\nship = 'a.fmu'",
        "[fmu]\nplatform = '.'",
    ),
    *(
        "[tension]",
        "[tension]\nminimum = 5\nmaximum = 1\npreferred = 3",
        "[[cable]]",
        "[platform]",
        "name = 3",
        "[sensors.a]",
    ),
    *("a.b.c = 1", '"" = 1', "\x00", "\ufeff", "[[platform]]", "cable = 3", "platform = 3", "\r", "=", "[", "é = 1"),
)
CELLS = (
    *("", " ", "nan", "NaN", "NA", "inf", "-Infinity", "1e400", "-1e13", "1e-320", "0", "-0.0", "1,5", "1.5.2", "0x10"),
    *(
        "1_000",
        "\uff11\uff12",
        "\u0663",
        "--",
        "true",
        "None",
        "12m",
        "=1+1",
        '"',
        '"1"',
        "'1'",
        "1e5",
        "1e999999999",
        "9" * 400,
    ),
    *("a" * 200_000, "\u00a0", "\u200b1", "NULL", "2020-01-01", "\ufeff", "1;2", "\t1", "e", "+", "."),
)
NAMES = (
    *(
        "",
        "time",
        "Time",
        "time ",
        "x",
        "X",
        "winch_speed_0",
        "winch_speed_4",
        "winch_speed_1",
        "winch_speed_01",
        "tension_9",
    ),
    *(
        "frequency",
        "\u00e9",
        "\U0001f916",
        "a" * 5000,
        "tension_1_uncertainty",
        '"',
        "#",
        "1.5",
        "winch_speed_" + "9" * 30,
    ),
)


def described(text: str) -> SearchStrategy[bytes]:
    """Robot files made of this one: lines dropped, doubled, swapped, with other values, between others; and damage."""
    return st.one_of(_other_lines(text), _other_lines(text).map(str.encode), damaged(text.encode())).map(_bytes)


@st.composite
def _other_lines(draw: DrawFn, text: str) -> str:
    lines = text.splitlines()
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(lines) - 1))
        how = draw(st.sampled_from(["value", "value", "value", "drop", "double", "swap", "add", "add", "rename"]))
        key = lines[at].partition("=")[0]
        if how == "value":
            lines[at] = f"{key}= {draw(st.sampled_from(ROBOT_VALUES))}"
        elif how == "drop":
            del lines[at]
        elif how == "double":
            lines.insert(at, lines[at])
        elif how == "swap":
            other = draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = lines[other], lines[at]
        elif how == "add":
            lines.insert(at, draw(st.sampled_from(ROBOT_LINES)))
        else:
            lines[at] = lines[at].replace(
                key.strip() or " ", draw(st.sampled_from(["mass", "Anchor", "x", "start", ""])), 1
            )
        if not lines:
            break
    return "\n".join(lines)


def _bytes(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")


def damaged(content: bytes) -> SearchStrategy[bytes]:
    """The same in other encodings and containers, cut off, with noise in it, or nothing of it."""
    places = st.integers(0, len(content))
    return st.one_of(
        st.binary(max_size=200),
        st.sampled_from([one(content) for one in CONTAINERS]),
        places.map(lambda end: content[:end]),
        st.builds(lambda at, put: content[:at] + put + content[at:], places, st.binary(min_size=1, max_size=40)),
        st.builds(
            lambda at, put: content[:at] + put + content[at + len(put) :], places, st.binary(min_size=1, max_size=8)
        ),
    )


def zipped(content: bytes) -> bytes:
    """An archive with a file of this content."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a", content)
    return file.getvalue()


def _as(encoding: str, content: bytes) -> bytes:
    return content.decode("utf-8", "replace").encode(encoding, "replace")


CONTAINERS: Sequence[Callable[[bytes], bytes]] = (
    lambda content: b"",
    lambda content: b"\n\n \n",
    lambda content: b"\0" * 1000,
    lambda content: b"\xef\xbb\xbf",
    lambda content: b"\xff\xfe",
    lambda content: b"PAR1",
    lambda content: b"PAR1" + content + b"\xff\xff\xff\x7fPAR1",
    lambda content: b"MDF     4.10",
    lambda content: b"MDF     4.10    tautwire" + b"\xff" * 200,
    lambda content: b"\x89PNG\r\n\x1a\n" + content,
    lambda content: b"%PDF-1.7\n" + content,
    lambda content: b"<!DOCTYPE html><html></html>",
    lambda content: b"a" * 3_000_000,
    lambda content: b"," * 300_000,
    lambda content: b'"' + content,
    lambda content: b"[" * 100_000,
    zipped,
    gzip.compress,
    *(partial(_as, encoding) for encoding in ("utf-16", "utf-16-le", "utf-32", "utf-7", "cp037")),
)


def same_robots(text: str) -> SearchStrategy[bytes]:
    """The same robot otherwise written."""
    return st.builds(
        lambda mark, ends, pad: mark + (text + pad).replace("\n", ends).encode(),
        st.sampled_from([b"", b"\xef\xbb\xbf"]),
        st.sampled_from(["\n", "\r\n"]),
        st.sampled_from(["", "\n\n# ä 🤖\n", "\n"]),
    )


def cells_of(text: str) -> Cells:
    return [line.split(",") for line in text.splitlines()]


def recorded(text: str) -> SearchStrategy[bytes]:
    """CSV files made of this one: cells, names, rows and columns changed, other separators; and damage."""
    separators = st.sampled_from([",", ",", ",", ",", ";", "\t", " ", "|", ", ", ",,"])
    ends = st.sampled_from(["\n", "\n", "\r\n", "\r", "\n\n", "\x0b", "\u2028"])
    points = st.sampled_from([".", ".", ".", ","])
    written = st.builds(_written, _other_cells(cells_of(text)), separators, ends, points)
    return st.one_of(written, written, damaged(text.encode()))


def _written(cells: Cells, separator: str, end: str, point: str) -> bytes:
    rows = (separator.join(row).replace(".", point) if point != "." else separator.join(row) for row in cells)
    return end.join(rows).encode("utf-8", "surrogatepass")


@st.composite
def _other_cells(draw: DrawFn, cells: Cells) -> Cells:
    cells = [list(row) for row in cells]
    for _ in range(draw(st.integers(0, 3))):
        row, column = draw(st.integers(0, len(cells) - 1)), draw(st.integers(0, len(cells[0]) - 1))
        how = draw(
            st.sampled_from(["cell", "cell", "name", "drop", "double", "swap", "column", "twin", "cut", "swap names"])
        )
        if how == "cell":
            cells[row][column % max(len(cells[row]), 1) : column + 1] = [draw(st.sampled_from(CELLS))]
        elif how == "name":
            cells[0][column] = draw(st.sampled_from(NAMES))
        elif how == "drop" and len(cells) > 1:
            del cells[row]
        elif how == "double":
            cells.insert(row, list(cells[row]))
        elif how == "swap":
            other = draw(st.integers(0, len(cells) - 1))
            cells[row], cells[other] = cells[other], cells[row]
        elif how == "column" and len(cells[0]) > 1:
            cells = [each[:column] + each[column + 1 :] for each in cells]
        elif how == "twin":
            cells = [[*each, each[column] if column < len(each) else ""] for each in cells]
        elif how == "cut":
            cells[row] = cells[row][:column]
        else:
            other = draw(st.integers(0, len(cells[0]) - 1))
            cells[0][column], cells[0][other] = cells[0][other], cells[0][column]
        if not cells[0]:
            cells[0] = [""]
    return cells


@st.composite
def same_recordings(draw: DrawFn, text: str) -> bytes:
    """The same recording otherwise written: columns in another order, with others beside, quoted, padded."""
    cells = cells_of(text)
    order = draw(st.permutations(range(len(cells[0]))))
    rows = [[row[at] for at in order] for row in cells]
    if draw(st.booleans()):
        rows = [[*row, "note" if number == 0 else f'"a, {number}"'] for number, row in enumerate(rows)]
    if draw(st.booleans()):
        rows = [[f'"{cell}"' if not cell.startswith('"') else cell for cell in row] for row in rows]
    separator, end = draw(st.sampled_from([",", ", "])), draw(st.sampled_from(["\n", "\r\n"]))
    mark = draw(st.sampled_from([b"", b"\xef\xbb\xbf"]))
    blank = draw(st.sampled_from(["", end, end * 3]))
    return mark + (end.join(separator.join(row) for row in rows) + end + blank).encode()


def as_parquet(text: str) -> bytes:
    """A CSV text's table as Parquet."""
    file = io.BytesIO()
    pd.read_csv(io.StringIO(text)).to_parquet(file, index=False)
    return file.getvalue()
