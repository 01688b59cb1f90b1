"""Full disks, closed streams, killed processes, two runs at once: what is there then, and what is said."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pandas as pd
import pytest

from tautwire.atomic_output import STAGING_PREFIX, atomic_file, atomic_folder
from tautwire.cli import run
from tautwire.errors import DiskFullError, InputError
from tests.support.progress import without_progress_lines
from tests.support.robots import EXAMPLES

THREE = EXAMPLES / "three"
ROBOT, FIT = str(THREE / "robot.toml"), str(THREE / "fit.csv")
# A trace has its worker processes at once, though tests are kept on one processor.
ON_TWO_PROCESSORS = """
import tautwire.estimation
from tautwire.cli import main
tautwire.estimation.processors = lambda: 2
main()
"""
COMMAND = [sys.executable, "-m", "tautwire.cli"]
LONG = ["simulate", ROBOT, "--speeds", FIT, "--step", "1e-4"]
QUICK = ["workspace", ROBOT, "--spacing", "40"]
INTERRUPTED = "tautwire: interrupted; nothing was written\n"

linux = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes as Linux lists them")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def until(true: object, seconds: float = 60.0) -> bool:
    """Whether what is asked comes true in time."""
    assert callable(true)
    begun = time.monotonic()
    while not true():
        if time.monotonic() - begun > seconds:
            return False
        time.sleep(0.05)
    return True


def parents() -> dict[int, int]:
    """The parent of each process that has not ended."""
    results = {}
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = place.read_text().rpartition(")")[2].split()[:2]
        except OSError:
            continue
        if state != "Z":
            results[int(place.parent.name)] = int(parent)
    return results


def descendants(number: int) -> set[int]:
    known, found, size = parents(), {number}, 0
    while len(found) > size:
        size = len(found)
        found |= {child for child, parent in known.items() if parent in found}
    return found - {number}


@contextmanager
def begun(folder: Path, arguments: list[str], out: Path) -> Iterator[subprocess.Popen[str]]:
    """A command that is at work: what it writes has its place beside the target, temporary files are in ``scratch``."""
    scratch = folder / "scratch"
    scratch.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-c", ON_TWO_PROCESSORS, *arguments, "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "TMPDIR": str(scratch)},
        text=True,
    )
    try:
        assert until(lambda: list(folder.glob(f"{STAGING_PREFIX}*/new")))
        yield process
    finally:
        process.kill()
        process.communicate()


CASES = {
    "build": (["build", str(EXAMPLES / "eight" / "robot.toml")], 0),
    "simulate": (LONG, 1),
    "trace": (["trace", ROBOT, FIT], 2),
}


@pytest.mark.validate
@linux
@pytest.mark.parametrize("case", CASES)
def test_what_a_killed_run_leaves_is_cleared_by_the_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    arguments, helpers = CASES[case]
    out = tmp_path / "out"
    with begun(tmp_path, arguments, out) as process:
        assert until(lambda: len(descendants(process.pid)) >= helpers)
        others = descendants(process.pid)
        process.kill()
        process.communicate(timeout=60)
        assert until(lambda: not others & parents().keys(), 20.0)
    left = names(tmp_path)
    assert "out" not in left
    assert [name for name in left if name.startswith(STAGING_PREFIX)]
    assert run([*QUICK, "--out", str(tmp_path / "workspace.csv"), "--quiet"]) == 0
    assert names(tmp_path) == ["scratch", "workspace.csv", "workspace.csv-metadata.json"]


@pytest.mark.validate
@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
@pytest.mark.parametrize(("case", "number"), [("build", 1), ("build", 15), ("simulate", 15), ("trace", 15)])
def test_a_request_to_end_is_like_ctrl_c(tmp_path: Path, case: str, number: int) -> None:
    arguments, helpers = CASES[case]
    with begun(tmp_path, arguments, tmp_path / "out") as process:
        assert sys.platform != "linux" or until(lambda: len(descendants(process.pid)) >= helpers)
        others = descendants(process.pid) if sys.platform == "linux" else set()
        process.send_signal(number)
        stdout, stderr = process.communicate(timeout=60)
    assert (without_progress_lines(stderr), stdout) == (INTERRUPTED, "")
    # Python lets SIGINT's own handler end a process by that signal where it was caught within some exec.
    assert process.returncode in (1, -signal.SIGINT)
    assert not others or until(lambda: not others & parents().keys(), 20.0)
    assert names(tmp_path) == ["scratch"]
    assert names(tmp_path / "scratch") == []


@pytest.mark.validate
def test_a_second_run_to_the_same_target_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.csv"
    with begun(tmp_path, [*LONG, "--until", "0.5"], out) as process:
        assert run([*QUICK, "--out", str(out)]) == 2
        stderr = capsys.readouterr().err
        assert (
            stderr == f"tautwire: {out}: another run is writing there; wait until it is done, or choose another --out\n"
        )
        assert run([*QUICK, "--out", str(tmp_path / "other.csv"), "--quiet"]) == 0
        process.communicate(timeout=120)
        assert process.returncode == 0
    assert len(pd.read_csv(out)) == len(pd.read_csv(FIT).query("time <= 0.5"))
    results = [f"{name}.csv{suffix}" for name in ("other", "out") for suffix in ("", "-metadata.json")]
    assert names(tmp_path) == [*results, "scratch"]
    assert run([*QUICK, "--out", str(out), "--quiet"]) == 0


@pytest.mark.validate
def test_neither_are_two_runs_mixed_in_one_folder(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "out")
    (tmp_path / "out").mkdir()
    with atomic_folder(tmp_path / "out") as scratch:
        (scratch / "a").write_text("first")
        for target in (tmp_path / "out", tmp_path / "link", tmp_path / "out" / ".." / "out"):
            with pytest.raises(InputError, match="another run is writing there"), atomic_folder(target):
                pass
    assert names(tmp_path / "out") == ["a"]


@pytest.mark.validate
def test_a_folder_that_is_there_keeps_its_other_files(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    (out / "platform.fmu").write_text("old")
    assert run(["build", ROBOT, "--out", str(out), "--quiet"]) == 0
    assert names(out) == ["cable_1.fmu", "cable_2.fmu", "cable_3.fmu", "mine.txt", "platform.fmu", "three.ssp"]
    assert (out / "mine.txt").read_text() == "mine"
    assert (out / "platform.fmu").read_bytes().startswith(b"PK")


LIMITED = """
import json, resource, sys
import matplotlib.font_manager  # it has files of its own
from tautwire.cli.application import run

# Python would leave a module's bytecode cut off.
sys.dont_write_bytecode = True
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
print(json.dumps([run(arguments) for arguments in json.loads(sys.argv[2])]))
"""
WRITING = [
    [*QUICK, "--out", "out/workspace.csv"],
    ["new", "out/hall"],
    ["linearise", ROBOT, "--out", "out/model.json"],
    ["material", "--out", "out"],
    ["excite", ROBOT, "--effects", "damping,payload", "--programs", "2", "--duration", "5", "--out", "out/program.csv"],
    ["build", ROBOT, "--out", "out"],
    ["simulate", ROBOT, "--speeds", FIT, "--until", "0.2", "--out", "out/result.csv"],
    ["simulate", ROBOT, "--speeds", FIT, "--until", "0.2", "--out", "out/result.parquet"],
]


@pytest.mark.validate
@pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")
@pytest.mark.parametrize("already", [False, True])
def test_a_full_disk_is_reported_and_nothing_is_half_written(tmp_path: Path, already: bool) -> None:
    if already:
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "result.csv").write_text("before")
    commands = WRITING if already else WRITING[:2]
    process = subprocess.run(
        [sys.executable, "-c", LIMITED, "100", json.dumps(commands)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert json.loads(process.stdout) == [1] * len(commands)
    error_lines = without_progress_lines(process.stderr).splitlines()
    for line, arguments in zip(error_lines, commands, strict=True):
        target = "out/hall.toml" if arguments[0] == "new" else arguments[-1]
        assert line.startswith(f"tautwire: {target}: was not written, no disk space left (File too large); make room")
    assert not (tmp_path / "out").exists() or names(tmp_path / "out") == ["result.csv"]
    assert not already or (tmp_path / "out" / "result.csv").read_text() == "before"


def test_no_other_refusal_is_taken_for_a_full_disk(tmp_path: Path) -> None:
    for problem, expected in ((OSError(28, "No space left on device"), DiskFullError), (OSError(5, "I/O"), OSError)):
        with pytest.raises(expected) as caught, atomic_file(tmp_path / "a"):
            raise problem
        assert isinstance(caught.value, DiskFullError) == (expected is DiskFullError)
    assert names(tmp_path) == []


@pytest.mark.parametrize("command", [QUICK, ["build", ROBOT], ["material"]])
def test_no_permission_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    def refused(place: Path, *arguments: object, **options: object) -> None:
        raise PermissionError(13, "Permission denied", str(place))

    out = tmp_path / "out"
    monkeypatch.setattr(Path, "mkdir", refused)
    assert run([*command, "--out", str(out)]) == 2
    stderr = capsys.readouterr().err
    assert stderr == f"tautwire: {out}: cannot write there: Permission denied; choose another --out\n"
    assert names(tmp_path) == []


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    assert run([*QUICK, "--out", str(closed / "workspace.csv")]) == 2
    assert "cannot write there: Permission denied" in capsys.readouterr().err


@linux
@pytest.mark.parametrize(
    ("out", "words"),
    [
        ("/proc/tautwire/out.csv", "cannot write there"),
        ("/dev/null", "is not a regular file"),
        ("pipe", "is not a regular file"),
        ("file/out.csv", "is a file"),
        ("nowhere/out.csv", "is a broken link"),
    ],
)
def test_where_no_file_can_be_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], out: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    Path("file").touch()
    Path("nowhere").symlink_to("absent")
    assert run([*QUICK, "--out", out]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert captured.err.startswith(f"tautwire: {out.partition('/out')[0] if out[0] != '/' else out}: ")
    assert words in captured.err
    assert names(tmp_path) == ["file", "nowhere", "pipe"]
    assert not Path("/dev/null").is_file()


SHELL = {
    "nobody reads": ("{} | head -n 0", "1", ""),
    "full": ("{} > /dev/full", "1", "tautwire: standard output, or a temporary file in"),
    "closed": ("{} >&-", "0", ""),
    "all closed": ("{} <&- >&- 2>&-", "0", ""),
    "errors to nowhere": ("{} 2> /dev/full > /dev/null", "0", ""),
    "errors closed": ("{} 2>&- > /dev/null", "0", ""),
}


@pytest.mark.validate
@linux
@pytest.mark.parametrize("case", SHELL)
def test_streams_that_nobody_reads_cost_no_result(tmp_path: Path, case: str) -> None:
    form, status, words = SHELL[case]
    out = tmp_path / "workspace.csv"
    command = " ".join([*COMMAND, *QUICK, "--out", str(out)])
    completed = subprocess.run(
        ["bash", "-c", form.format(command) + '; echo "status ${PIPESTATUS[0]}"'],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert completed.stdout == f"status {status}\n"
    stderr = without_progress_lines(completed.stderr)
    assert stderr.startswith(words) and stderr.count("\n") == bool(words)
    assert len(pd.read_csv(out)) == 12
    assert names(tmp_path) == ["workspace.csv", "workspace.csv-metadata.json"]


@pytest.mark.validate
@linux
def test_what_is_wrong_does_not_end_up_in_the_result(tmp_path: Path) -> None:
    command = " ".join([*COMMAND, "linearise", str(tmp_path / "absent.toml"), "--json", "--out", "a.json"])
    completed = subprocess.run(
        ["bash", "-c", f"{command} 2>&-"], capture_output=True, text=True, timeout=60, check=False
    )
    assert (completed.returncode, completed.stdout) == (2, "")


def test_a_locked_folder_is_not_taken_for_a_leftover(tmp_path: Path) -> None:
    left = tmp_path / f"{STAGING_PREFIX}0123456789ab"
    (left / "new").mkdir(parents=True)
    (left / "new" / "half").write_text("half")
    (left / "lock").touch()
    mine = tmp_path / f"{STAGING_PREFIX}of-mine"
    mine.mkdir()
    with atomic_file(tmp_path / "a") as first:
        first.write_text("first")
        with atomic_file(tmp_path / "b") as second:
            second.write_text("second")
        assert first.read_text() == "first"
        assert not left.exists()
    assert names(tmp_path) == [mine.name, "a", "b"]
