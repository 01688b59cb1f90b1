"""Recordings as other programs write them: read as the standard file, or refused with the line that is not clear."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tautwire.errors import RecordingError
from tautwire.recordings.recording import Recording, read_recording

STANDARD = """time,winch_speed_1,tension_1,x,y
0,0.1,1000,1.5,2.5
0.01,0.11,1100,1.6,2.6
0.02,-0.12,1200.5,1.7,
"""
SEMICOLONS = STANDARD.replace(",", ";")
GERMAN = SEMICOLONS.replace(".", ",")


def read(folder: Path, content: str | bytes) -> Recording:
    """The recording of one cable in a text."""
    path = folder / "fit.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_recording(path, 1)


def lines_of(text: str) -> list[str]:
    return text.splitlines()


def with_lines(text: str, *, above: str = "", below_header: str = "", within: str = "", header: str = "") -> str:
    """The text with other lines: above the header, below it, within the samples, or another header."""
    first, *samples = lines_of(text)
    parts = [above, header or first, below_header, *samples[:1], within, *samples[1:]]
    return "\n".join(part for part in parts if part) + "\n"


MILLI = """time;winch_speed_1;tension_1;x;y
s;mm/s;kN;mm;cm
0;100;1;1500;250
0.01;110;1.1;1600;260
0.02;-120;1.2005;1700;
"""
ALIGNED = """time   winch_speed_1  tension_1    x    y
0        0.1     1000   1.5  2.5
  0.01   0.11    1100   1.6  2.6
0.02    -0.12    1200.5 1.7  nan
"""
ISO = (
    STANDARD.replace("\n0,", "\n2024-05-31T23:59:59.99Z,")
    .replace("\n0.01,", "\n2024-06-01T00:00:00Z,")
    .replace("\n0.02,", "\n2024-06-01T02:00:00.01+02:00,")
)
LOCAL = ISO.replace("T", " ").replace("Z", "").replace("02:00:00.01+02:00", "00:00:00.01")
CLOCK = (
    STANDARD.replace("\n0,", "\n9:59:59.99,").replace("\n0.01,", "\n10:00:00,").replace("\n0.02,", "\n10:00:00.010,")
)
UNITS_IN_HEADER = "time [ms],winch_speed_1 (mm/s),tension_1 / kN,x/mm,y"
MILLISECONDS = UNITS_IN_HEADER + "\n0,100,1,1500,2.5\n10,110,1.1,1600,2.6\n20,-120,1.2005,1700,\n"


@pytest.mark.parametrize(
    ("content", "note"),
    [
        (STANDARD, None),
        ("\ufeff" + STANDARD, None),
        (STANDARD.replace("\n", "\r"), None),
        ("\n\r\n" + STANDARD.replace("\n", "\r\n\r\n"), None),
        (STANDARD.encode("utf-16"), "as UTF-16"),
        (b"\xfe\xff" + GERMAN.encode("utf-16-be"), "as UTF-16; with semicolons and decimal commas"),
        (SEMICOLONS, "with semicolons"),
        (STANDARD.replace(",", "\t"), "with tabs"),
        (GERMAN, "with semicolons and decimal commas"),
        (GERMAN.replace(";", "\t").replace("\n", "\r"), "with tabs and decimal commas"),
        (GERMAN.replace("0,11", '"0,11"').replace("time", '"time"'), "with semicolons and decimal commas"),
        (STANDARD.replace("0.11", '"0.11"'), None),
        (ALIGNED, "with spaces"),
        (ALIGNED.replace(".", ","), "with spaces and decimal commas"),
        (SEMICOLONS.replace("\n", ";\n"), "with semicolons"),
        (STANDARD.replace("\n", ",\n").replace(",\n", "\n", 1), None),
        (with_lines(STANDARD, above="# a test\n% of,two\n// marks"), None),
        (with_lines(STANDARD, within="# the platform was pushed, 3 times"), None),
        ("# " + STANDARD, "the comment in line 1 is the header"),
        ("%% a test\n%" + STANDARD, "the comment in line 2 is the header"),
        ("# " + ALIGNED.replace("\n", "\n# of noon\n", 1), "with spaces; the comment in line 1 is the header"),
        (
            "# " + ", ".join(lines_of(STANDARD)[0].split(",")) + "\n" + ALIGNED.partition("\n")[2],
            "with spaces below a header with commas; the comment in line 1 is the header",
        ),
        (
            with_lines(GERMAN, above="Exported by DAQ 3.1\nOperator;J. Smith\nRate;100,0\n"),
            "with semicolons and decimal commas; text above the header in line 5 is ignored",
        ),
        (MILLI, "with semicolons; winch_speed_1 in mm/s; tension_1 in kN; x in mm; y in cm"),
        (
            MILLI.replace(".", ",").replace("s;mm/s;kN;mm;cm", "[s];[mm/s];[kN];[mm];[cm]"),
            "with semicolons and decimal commas; winch_speed_1 in mm/s; tension_1 in kN; x in mm; y in cm",
        ),
        (
            MILLI.replace("s;mm/s", "# units: s;mm/s").replace("time", "#time"),
            "with semicolons; winch_speed_1 in mm/s; tension_1 in kN; x in mm; y in cm; "
            "the comment in line 1 is the header",
        ),
        (with_lines(STANDARD, below_header="s,m/s,N,m,m"), None),
        (
            MILLI.replace("s;mm/s;kN;mm;cm", "# [s] [mm/s] [kN] [mm] [cm]"),
            "with semicolons; winch_speed_1 in mm/s; tension_1 in kN; x in mm; y in cm",
        ),
        (with_lines(STANDARD, below_header="# it was y"), None),
        (
            ALIGNED.replace("time   ", "time [ms] ")
            .replace("1    x ", "1  x [m] ")
            .replace(".01", "10")
            .replace(".02", "20"),
            "with spaces; time in ms",
        ),
        (ALIGNED.replace("0.11", '"0.11"').replace("\n0 ", '\n"0" '), "with spaces"),
        (MILLISECONDS, "time in ms; winch_speed_1 in mm/s; tension_1 in kN; x in mm"),
        (
            MILLISECONDS.replace("ms", "µs").replace("\n10,", "\n10000,").replace("\n20,", "\n2e4,").encode("latin-1"),
            "as Latin-1; time in us; winch_speed_1 in mm/s; tension_1 in kN; x in mm",
        ),
        (b"# m\xfcde\n" + STANDARD.encode(), "as Latin-1"),
        (ISO, "time is ISO 8601 with an offset from UTC, in s from the first sample"),
        (LOCAL, "time is ISO 8601, in s from the first sample"),
        (CLOCK, "time is hh:mm:ss, in s from the first sample"),
        (CLOCK.replace("time", "time [hh:mm:ss.fff]"), "time is hh:mm:ss, in s from the first sample"),
        (
            with_lines(CLOCK, below_header="hh:mm:ss,m/s,N,m,m").replace(",", ";").replace(".", ","),
            "with semicolons and decimal commas; time is hh:mm:ss, in s from the first sample",
        ),
    ],
)
def test_a_dialect_is_read_as_the_standard_file(tmp_path: Path, content: str | bytes, note: str | None) -> None:
    standard, other = read(tmp_path, STANDARD), read(tmp_path, content)
    assert other.frame().equals(standard.frame())
    assert other.unknown_columns == ()
    path = tmp_path / "fit.csv"
    assert other.notes == (() if note is None else (f"{path}: read {note}",))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (STANDARD.replace(".", ","), ["line 2", "8 cells, the header has 5", "decimal point"]),
        (STANDARD.replace("1000", '"1,000"'), ["line 2, column tension_1", "'1,000'", "decimal point"]),
        (
            "time;winch_speed_1;x\n0;0;1,234\n1;0;2,345\n",
            ["line 2", "'1,234' may be decimal or separate thousands", "decimals"],
        ),
        (GERMAN.replace("1000", "1.000"), ["line 2, column tension_1", "'1.000'", "decimal comma", "thousands"]),
        (GERMAN.replace("0,11", "0.11"), ["line 3, column winch_speed_1", "'0.11'", "decimal comma"]),
        (SEMICOLONS.replace("1200.5", "1,200.5"), ["line 4, column tension_1", "'1,200.5'", "not a number"]),
        (GERMAN.replace("1200,5", "1.200,5"), ["line 4, column tension_1", "'1.200,5'"]),
        (MILLI.replace("kN", "klbf"), ["line 2, column tension_1", "'klbf'", "unit of force", "N, kN, mN"]),
        (MILLI.replace("kN", "mm"), ["line 2, column tension_1", "'mm'", "unit of force"]),
        (MILLI.replace("kN", ""), ["line 2, column tension_1", "no unit", "N, kN"]),
        (MILLI.replace("s;mm/s;kN", "# s;mm/s;klbf"), ["line 2, column tension_1", "'klbf'"]),
        (MILLISECONDS.replace("[ms]", "[samples]"), ["line 1, column time", "'[samples]'", "s, ms, us"]),
        (MILLISECONDS.replace("(mm/s)", "(rpm)"), ["line 1, column winch_speed_1", "'(rpm)'", "speed"]),
        (
            with_lines(MILLISECONDS, below_header="ms,mm/s,N,mm,m"),
            ["line 2, column tension_1", "in N here", "in kN in"],
        ),
        (STANDARD.replace("time", "time [hh:mm:ss]"), ["line 1, column time", "'[hh:mm:ss]'"]),
        ("0,0,0,0,0\n" + STANDARD, ["line 1", "numbers of all columns", "line 2", "below"]),
        ("s,mm/s,kN,mm,cm\n" + STANDARD, ["line 1", "units of all columns", "line 2", "below"]),
        ("# time, x\n# time, x, y\n0,1,2\n1,1,2\n", ["line 1", "names the columns, and so does line 2"]),
        (STANDARD + STANDARD, ["line 5", "repeats the names of the columns"]),
        (STANDARD.replace("\n0.01", "\n% 0.01"), ["line 3, column time", "'% 0.01'"]),
        (ISO.replace("00:00:00Z", "00:00:00"), ["line 3, column time", "'2024-06-01T00:00:00'", "offset from UTC"]),
        (ISO.replace("06-01", "06-31"), ["line 3, column time", "'2024-06-31T00:00:00Z'"]),
        (ISO.replace("2024-06-01T00", "2024-06-01T24"), ["line 3, column time", "ISO 8601"]),
        (LOCAL.replace("2024-05-31", "31-05-2024"), ["line 2, column time", "'31-05-2024 23:59:59.99'", "ISO 8601"]),
        (CLOCK.replace("10:00:00,", "10:00:60,"), ["line 3, column time", "'10:00:60'", "hh:mm:ss"]),
        (CLOCK.replace("10:00:00,", "600,"), ["line 3, column time", "'600'", "hh:mm:ss"]),
        (CLOCK.replace("10:00:00,", "0:00:00,"), ["line 3, column time", "rise"]),
        (SEMICOLONS.replace("1100", "1100;"), ["line 3", "6 cells, the header has 5"]),
        (SEMICOLONS.replace("\n", ";\n").replace("2.6;", "2.6"), ["line 3", "5 cells", "has 6"]),
        (ALIGNED.replace("nan", ""), ["line 4", "4 cells, the header has 5"]),
        (with_lines(SEMICOLONS, above="a;b\n\n\n# c").replace("1100", "fast"), ["line 7, column tension_1", "'fast'"]),
        (b"time,winch_speed_1,note\n0,1,\xe9\n1,1,\n", ["line 2", "0xe9 is not UTF-8"]),
        (b"\xe9\n\xe8\n", ["line 1", "0xe9 is not UTF-8"]),
        (b"\xff\xfe" + "a".encode("utf-16-le") + b"\x00\xd8", ["UTF-16"]),
        (STANDARD.encode("utf-32"), ["zero byte"]),
        ("\n" * 600 + STANDARD, ["blank lines", "names of the columns"]),
        ("Exported by DAQ\nTime;winch_speed_1;x\n0;1;2\n", ["line 2", "time is missing", "'Time'"]),
    ],
)
def test_what_is_not_clear_is_refused(tmp_path: Path, content: str | bytes, words: list[str]) -> None:
    with pytest.raises(RecordingError) as caught:
        read(tmp_path, content)
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


def test_notes_are_one_line_whatever_a_column_is_called(tmp_path: Path) -> None:
    recording = read(tmp_path, b"time,winch_speed_1,\x9c\n0,1,2\n1,1,2\n")
    assert recording.unknown_columns == ("\x9c",)
    assert all(note.isprintable() for note in recording.notes)


@pytest.mark.parametrize(
    "cell", ["time" + " " * 100_000 + "x", "9" * 100_000 + "x", "(" * 100_000, "time " + "[" * 9999]
)
def test_long_cells_are_refused_soon(tmp_path: Path, cell: str) -> None:
    with pytest.raises(RecordingError, match="time is missing"):
        read(tmp_path, f"{cell},winch_speed_1,x\n0,1,2\n1,2,3\n")


def test_labels_that_begin_as_comments_are_no_comments(tmp_path: Path) -> None:
    recording = read(tmp_path, "label,time,winch_speed_1\n#1,0,1\n#2,1,2\n#3,2,3\n")
    assert recording.time.tolist() == [0.0, 1.0, 2.0]


def test_a_comment_does_not_begin_inside_quotation_marks(tmp_path: Path) -> None:
    text = 'time,winch_speed_1,note\n0,1,"a\n#b"\n# "c\n1,2,d\n2,3,e\n'
    assert read(tmp_path, text).winch_speed[:, 0].tolist() == [1.0, 2.0, 3.0]


FIGURE = st.floats(-1e9, 1e9).map(lambda number: round(number, 4))


@dataclass(frozen=True)
class Dialect:
    """How a table is written."""

    separator: str
    decimal_mark: str
    encoding: str
    line_end: str
    commented_header: bool
    above: str
    quoted: bool
    trailing: bool
    units: bool

    def written(self, table: pd.DataFrame) -> bytes:
        """The table, whose numbers are all written with decimals."""
        rows = [list(table.columns)] + ([["s", "m/s", "N", "m"]] if self.units else [])
        rows += [[repr(number).replace(".", self.decimal_mark) for number in row] for row in table.values.tolist()]
        text = io.StringIO()
        quoting = csv.QUOTE_ALL if self.quoted and self.separator != " " else csv.QUOTE_MINIMAL
        csv.writer(text, delimiter=self.separator, lineterminator="\n", quoting=quoting).writerows(rows)
        lines = text.getvalue().splitlines()
        lines = [line + self.separator for line in lines] if self.trailing else lines
        lines[0] = ("# " if self.commented_header else "") + lines[0]
        return (self.above + "\n".join(lines)).replace("\n", self.line_end).encode(self.encoding)


DIALECTS = st.builds(
    Dialect,
    st.sampled_from([",", ";", "\t", " "]),
    st.sampled_from([".", ","]),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.booleans(),
    st.sampled_from(["", "\n", "# by hand\n", "DAQ 3.1\n\nRate;5\n", "// a, b\nOperator: J. Smith, at night\n"]),
    st.booleans(),
    st.booleans(),
    st.booleans(),
)


@pytest.mark.validate
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    dialect=DIALECTS, rows=st.lists(st.tuples(FIGURE, FIGURE, FIGURE), min_size=2, max_size=5), step=st.floats(0.01, 9)
)
def test_any_dialect_is_read_back_equal(
    tmp_path: Path, dialect: Dialect, rows: list[tuple[float, float, float]], step: float
) -> None:
    table = pd.DataFrame(rows, columns=["winch_speed_1", "tension_1", "x"])
    table.insert(0, "time", np.arange(len(rows)) * round(step, 3) + 0.5)
    written = dialect.written(table)
    if dialect.decimal_mark == "," and dialect.separator == ",":
        with pytest.raises(RecordingError):
            read(tmp_path, written if not dialect.quoted else written.replace(b'"', b""))
        return
    assert read(tmp_path, written).frame()[list(table.columns)].equals(table)


@pytest.mark.parametrize("text", ["gain 3,5 V", "3,5", "1,234"])
def test_commas_of_a_column_that_is_not_read_are_no_decimal_marks(text: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"0.0{row};0.1;1.5;{text}" for row in range(3)]
    path.write_text("\n".join(["time;winch_speed_1;x;remark", *rows]), encoding="utf-8")
    recording = read_recording(path, 1)
    assert recording.position[:, 0].tolist() == [1.5, 1.5, 1.5]
    assert recording.unknown_columns == ("remark",)
