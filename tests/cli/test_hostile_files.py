"""Robot files, recordings and tables of any kind: read, or refused in one line that names them, nothing written."""

from __future__ import annotations

import gzip
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from tautwire import input_files as input_file
from tautwire.cli import run
from tautwire.errors import InputError
from tautwire.materials import PAPER_TABLE, read_material_table
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.hostile import as_parquet, damaged, described, recorded, same_recordings, same_robots, zipped
from tests.support.robots import EXAMPLES

THREE = EXAMPLES / "three"
ROBOT, FIT = THREE / "robot.toml", THREE / "fit.csv"
ROBOT_TEXT = ROBOT.read_text(encoding="utf-8")
RECORDED = "\n".join(FIT.read_text(encoding="utf-8").splitlines()[:7])
TABLE_TEXT = "\n".join(
    line for line in PAPER_TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")
)
ONE_LINE = 4000
EXAMPLES_OF_ROBOTS, EXAMPLES_OF_RECORDINGS, EXAMPLES_OF_TABLES = 60, 30, 20

HOSTILE = settings(
    deadline=None,
    phases=(Phase.generate,),
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)
NUMBERS = count()


@contextmanager
def place_for(folder: Path, content: bytes, name: str) -> Iterator[Path]:
    """A file in a folder of its own."""
    own = folder / str(next(NUMBERS))
    own.mkdir()
    (own / name).write_bytes(content)
    try:
        yield own / name
    finally:
        shutil.rmtree(own)


def refused(arguments: list[str], place: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What a command says of a file that is wrong, after checking what every refusal has."""
    before = sorted(path.name for path in place.parent.iterdir())
    capsys.readouterr()
    assert run(arguments) == 2, arguments[0]
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1 and captured.err.endswith("\n"), captured.err
    # A robot file may also name a file beside it that is wrong.
    assert captured.err.startswith(f"tautwire: {place.parent}{os.sep}"), captured.err
    assert captured.err[:-1].isprintable() and len(captured.err) < ONE_LINE
    assert sorted(path.name for path in place.parent.iterdir()) == before
    return captured.err


def reported_by_check(
    arguments: list[str], place: Path, capsys: pytest.CaptureFixture[str], expected: int | None
) -> None:
    """All lines name the file, and the status says whether something is wrong."""
    capsys.readouterr()
    status = run(["check", *arguments])
    captured = capsys.readouterr()
    assert status in ((0, 2) if expected is None else (expected,)), captured.out
    if status == 2:
        assert captured.out and all(line.startswith(f"{place}") for line in captured.out.splitlines()), captured.out
    assert all(line.isprintable() and len(line) < ONE_LINE for line in (captured.out + captured.err).splitlines())


ROBOT_COMMANDS = {
    "build": ["build", "ROBOT", "--out", "OUT"],
    "fmus": ["fmus", "ROBOT"],
    "simulate": ["simulate", "ROBOT", "--speeds", str(FIT), "--out", "OUT/result.csv", "--report", "OUT/run.html"],
    "linearise": ["linearise", "ROBOT", "--out", "OUT/model.json"],
    "trace": ["trace", "ROBOT", str(FIT), "--out", "OUT"],
    "excite": ["excite", "ROBOT", "--out", "OUT/program.csv"],
    "material": ["material", "--robot", "ROBOT", "--out", "OUT"],
}


OF_FMUS = ("build", "fmus", "simulate")


def filled(command: list[str], **places: Path) -> list[str]:
    for name, place in places.items():
        command = [part.replace(name, str(place)) for part in command]
    return command


def robot_is_sound(place: Path) -> bool | None:
    """Whether a robot can be read and held; None where it is so, but its FMUs are not there."""
    try:
        robot = read_robot(place)
        static_tensions(robot)
    except InputError:
        return False
    return None if robot.fmus else True


@pytest.mark.validate
@settings(HOSTILE, max_examples=EXAMPLES_OF_ROBOTS)
@given(content=described(ROBOT_TEXT), command=st.sampled_from(sorted(ROBOT_COMMANDS)))
def test_any_robot_file_is_read_or_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes, command: str
) -> None:
    with place_for(tmp_path, content, "robot.toml") as place:
        sound = robot_is_sound(place)
        reported_by_check([str(place)], place, capsys, 0 if sound else 2)
        if sound is False or (sound is None and command in OF_FMUS):
            refused(filled(ROBOT_COMMANDS[command], ROBOT=place, OUT=place.parent / "out"), place, capsys)


@pytest.mark.validate
@settings(HOSTILE, max_examples=20)
@given(content=same_robots(ROBOT_TEXT))
def test_the_same_robot_otherwise_written_is_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes
) -> None:
    with place_for(tmp_path, content, "robot.toml") as place:
        assert read_robot(place) == read_robot(ROBOT)
        reported_by_check([str(place)], place, capsys, 0)


RECORDING_COMMANDS = {
    "simulate": ["simulate", str(ROBOT), "--speeds", "RECORDING", "--out", "OUT/result.csv"],
    "trace": ["trace", str(ROBOT), "RECORDING", "--out", "OUT"],
    "check": ["trace", str(ROBOT), str(FIT), "--check", "RECORDING", "--out", "OUT"],
}
SUFFIXES = (".csv", ".csv", ".csv", ".parquet", ".mf4", ".txt", "")


@pytest.mark.validate
@settings(HOSTILE, max_examples=EXAMPLES_OF_RECORDINGS)
@given(
    content=recorded(RECORDED) | damaged(as_parquet(RECORDED)),
    suffix=st.sampled_from(SUFFIXES),
    command=st.sampled_from(sorted(RECORDING_COMMANDS)),
)
def test_any_recording_is_read_or_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes, suffix: str, command: str
) -> None:
    with place_for(tmp_path, content, f"fit{suffix}") as place:
        out = place.parent / "out"
        try:
            assert read_recording(place, 3).sample_count >= 2
        except InputError:
            reported_by_check([str(ROBOT), str(place)], place, capsys, 2)
            refused(filled(RECORDING_COMMANDS[command], RECORDING=place, OUT=out), place, capsys)
        else:
            # Six samples are too few for a trace, or tell of a start that is out of reach.
            reported_by_check([str(ROBOT), str(place)], place, capsys, None)


@pytest.mark.validate
@settings(HOSTILE, max_examples=40)
@given(content=same_recordings(RECORDED))
def test_the_same_recording_otherwise_written_is_the_same(tmp_path: Path, content: bytes) -> None:
    with place_for(tmp_path, content, "fit.csv") as place:
        assert read_recording(place, 3).frame().equals(read_recording(FIT, 3).first(6).frame())


@pytest.mark.validate
@settings(HOSTILE, max_examples=EXAMPLES_OF_TABLES)
@given(content=recorded(TABLE_TEXT))
def test_any_table_of_a_dynamic_test_is_read_or_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes
) -> None:
    with place_for(tmp_path, content, "dma.csv") as place:
        try:
            read_material_table(place)
        except InputError:
            refused(["material", str(place), "--out", str(place.parent / "out")], place, capsys)


READERS = {
    **ROBOT_COMMANDS,
    "check": ["check", "ROBOT"],
    "campaign": ["campaign", "ROBOT", "--out", "OUT"],
    "workspace": ["workspace", "ROBOT", "--out", "OUT/workspace.csv"],
    "speeds": ["simulate", str(ROBOT), "--speeds", "ROBOT", "--out", "OUT/result.csv"],
    "fit": ["trace", str(ROBOT), "ROBOT", "--out", "OUT"],
    "judge": ["trace", str(ROBOT), str(FIT), "--check", "ROBOT", "--out", "OUT"],
    "table": ["material", "ROBOT", "--out", "OUT"],
    "material and robot": ["trace", "ROBOT", str(PAPER_TABLE), "--out", "OUT"],
}


def folder(place: Path) -> None:
    place.mkdir()


def absent(place: Path) -> None:
    """Nothing at all."""


def link_to_itself(place: Path) -> None:
    place.symlink_to(place)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names")
@pytest.mark.parametrize("make", [folder, absent, link_to_itself, os.mkfifo], ids=lambda make: make.__name__)
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_file_is_refused_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], reader: str, make: Callable[[Path], None]
) -> None:
    place = tmp_path / "given.csv"
    make(place)
    arguments = filled(READERS[reader], ROBOT=place, OUT=tmp_path / "out")
    if reader == "check":
        reported_by_check([str(place)], place, capsys, 2)
    else:
        refused(arguments, place, capsys)


def vast(place: Path) -> None:
    """10 GB of nothing, which need not lie on the disk."""
    with place.open("wb") as file:
        file.truncate(10 * 2**30)


def vast_text(place: Path) -> None:
    """A text at first, then the same."""
    with place.open("wb") as file:
        file.write(RECORDED.encode() + b"\n" + b" " * input_file.HEAD_SIZE)
        file.truncate(10 * 2**30)


def many_rows(place: Path) -> None:
    """A Parquet file of two megabytes, in which each column has 50 million numbers."""
    names = RECORDED.partition("\n")[0].split(",")
    table = pa.table({name: pa.array(np.zeros(5_000_000)) for name in names[:1]})
    table = pa.table({name: table.column(0) for name in names})
    with pq.ParquetWriter(place, table.schema) as writer:
        for _ in range(10):
            writer.write_table(table)
    assert place.stat().st_size < 2**22


def many_columns(place: Path) -> None:
    header, _, samples = RECORDED.partition("\n")
    place.write_text(",".join([header, *(f"a{number}" for number in range(500_000))]) + "\n" + samples)


def long_line(place: Path) -> None:
    place.write_text("a" * 50_000_000)


VAST = {
    "vast": (vast, ["fit", "table"], "zero byte"),
    "vast text": (vast_text, ["speeds", "check"], "at most"),
    "many rows": (many_rows, ["judge"], "at most 20000000 are read"),
    "many columns": (many_columns, ["speeds"], "at most 10000 are read"),
    "long line": (long_line, ["fit"], ""),
}


@pytest.mark.validate
@pytest.mark.parametrize(
    ("case", "reader"), [(case, reader) for case, (_, readers, _) in VAST.items() for reader in readers]
)
def test_what_claims_to_be_vast_is_refused_soon_and_in_little_memory(tmp_path: Path, case: str, reader: str) -> None:
    make, _, words = VAST[case]
    place = tmp_path / ("given.parquet" if make is many_rows else "given.csv")
    make(place)
    arguments = filled(READERS[reader], ROBOT=place, OUT=tmp_path / "out")
    completed = subprocess.run(
        [sys.executable, "-c", IN_LITTLE_MEMORY, *arguments], capture_output=True, text=True, timeout=60, check=False
    )
    assert completed.returncode == 2, completed.stderr[-2000:]
    said = completed.stdout if reader == "check" else completed.stderr
    assert said.count("\n") == 1 and words in said
    assert said.removeprefix("tautwire: ").startswith(str(place))
    assert [path.name for path in tmp_path.iterdir()] == [place.name]


IN_LITTLE_MEMORY = """
import resource, sys
from tautwire.cli.application import main
import tautwire.estimation, tautwire.recordings.recording, tautwire.materials

used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize() if sys.platform == "linux" else 2**33
resource.setrlimit(resource.RLIMIT_AS, (used + 2**30, resource.RLIM_INFINITY))
sys.argv[0] = "tautwire"
main()
"""


@pytest.mark.validate
@pytest.mark.parametrize(
    ("content", "reader"), [("zip", "build"), ("gzip", "table"), ("Parquet", "fit"), ("MDF", "fit"), ("noise", "fit")]
)
def test_in_a_process_of_its_own_there_is_no_more_to_see(tmp_path: Path, content: str, reader: str) -> None:
    """A traceback, a warning of a library or a message at exit would be there."""
    place = tmp_path / "given.csv"
    place.write_bytes(
        {
            "zip": zipped(RECORDED.encode()),
            "gzip": gzip.compress(RECORDED.encode()),
            "Parquet": as_parquet(RECORDED)[:-20],
            "MDF": b"MDF     4.10    tautwire",
            "noise": bytes(range(256)),
        }[content]
    )
    completed = subprocess.run(
        [sys.executable, "-m", "tautwire.cli", *filled(READERS[reader], ROBOT=place, OUT=tmp_path / "out")],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (completed.returncode, completed.stdout) == (2, "")
    assert completed.stderr.count("\n") == 1 and completed.stderr.startswith(f"tautwire: {place}: ")
    assert [path.name for path in tmp_path.iterdir()] == [place.name]
