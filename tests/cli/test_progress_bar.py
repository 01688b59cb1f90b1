"""The progress bar on a terminal, and lines of progress elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from tautwire.cli import COMMANDS, run
from tautwire.cli import console as shared
from tautwire.cli.progress_lines import ActivityProgress, progress_line, progress_lines
from tautwire.errors import TautwireError
from tests.support.campaigns import AT_REST, plan_file
from tests.support.robots import EXAMPLES

ROBOT, FIT = (str(EXAMPLES / "three" / name) for name in ("robot.toml", "fit.csv"))
AT_WORK = {
    "check": ([ROBOT, FIT], "checking both together"),
    "build": ([ROBOT, "--out", "out"], "building"),
    "fmus": ([ROBOT], "building"),
    "simulate": ([ROBOT, "--speeds", FIT, "--until", "0.1", "--out", "out.csv"], "co-simulating"),
    "linearise": ([ROBOT, "--out", "out.json"], "linearising"),
    "workspace": ([ROBOT, "--spacing", "40", "--out", "out.csv"], "computing the workspace"),
    "excite": (
        [ROBOT, "--effects", "damping,payload", "--programs", "2", "--duration", "1", "--out", "out.csv"],
        "trying programs",
    ),
}
# These take long: what does the work is taken from them, after its first word.
LONG = {
    "trace": ([ROBOT, FIT, "--out", "out"], "tautwire.estimation.trace"),
    "campaign": (["plan.toml", "--out", "out"], "tautwire.campaigns.campaign_runner.run_campaign"),
    "material": (["--out", "out"], "tautwire.materials.trace_material"),
    "paper": (["--out", "out"], "tautwire.paper.write_paper"),
}
# They only read or write a text, or compute one pose.
AT_ONCE = {"columns", "example", "import_", "new", "pose"}


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> StringIO:
    """What a terminal shows of the bar."""
    shown = StringIO()
    monkeypatch.setattr(shared, "Console", lambda **options: Console(file=shown, force_terminal=True, width=120))
    return shown


def test_every_command_is_watched_but_what_is_done_at_once() -> None:
    assert {command.__name__ for command in COMMANDS} == AT_WORK.keys() | LONG.keys() | AT_ONCE


@pytest.mark.validate(but=["check", "linearise", "workspace"])
@pytest.mark.parametrize("command", AT_WORK)
def test_a_command_at_work_names_what_it_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, heard: StringIO, command: str
) -> None:
    arguments, words = AT_WORK[command]
    monkeypatch.chdir(tmp_path)
    assert run([command, *arguments]) == 0
    assert words in heard.getvalue()


def first_word(*arguments: object) -> None:
    """Tells one thing to whatever hears, and ends."""
    (tell,) = [each for each in arguments if callable(each)]
    tell("the first word", 0.5)
    raise TautwireError("enough")


@contextmanager
def nobody(scheduler: str | None, workers: int) -> Iterator[object]:
    """A cluster of no use."""
    yield SimpleNamespace(cluster=None, dashboard_link="", nthreads=lambda: {"worker": 1})


@pytest.mark.parametrize("command", LONG)
def test_a_long_command_hands_its_bar_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, heard: StringIO, command: str
) -> None:
    if command == "campaign":
        pytest.importorskip("distributed", reason="Dask is not installed")
    arguments, worker = LONG[command]
    plan_file(tmp_path, AT_REST)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(worker, first_word)
    monkeypatch.setattr("tautwire.campaigns.dask_cluster.dask_client", nobody)
    assert run([command, *arguments]) == 1
    assert "the first word" in heard.getvalue()


def test_remaining_time_is_estimated_where_parts_come_minutes_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    now, heard = [0.0], StringIO()
    console = Console(file=heard, force_terminal=True, width=120, get_time=lambda: now[0])
    monkeypatch.setattr(shared, "Console", lambda **options: console)
    with shared.progress_bar() as tell:
        for done in (0.5, 0.5625, 0.625):
            tell("running", done)
            now[0] += 100.0
    # A sixteenth came in 100 s each; that half was done before says nothing.
    assert "0:10:00" in heard.getvalue()


def test_a_short_command_says_nothing_where_nobody_watches(monkeypatch: pytest.MonkeyPatch) -> None:
    heard = StringIO()
    monkeypatch.setattr(shared, "Console", lambda **options: Console(file=heard))
    with shared.progress_bar() as tell:
        tell("running", 0.5)
    assert heard.getvalue() == ""


def test_where_no_bar_can_be_drawn_a_line_tells_what_is_done_and_how_long_it_will_take(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shared, "progress_lines", partial(progress_lines, interval=0.05))
    with shared.progress_bar() as tell:
        tell("running", 0.0)
        time.sleep(0.1)
        tell("running", 0.5)
        time.sleep(0.1)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "0 s: running" and lines[-1] == "0 s: running, 50 %, about 0 s left"
    with shared.progress_bar(shared.CommandOutput(quiet=True)) as tell:
        tell("running", 0.5)
        time.sleep(0.1)
    assert capsys.readouterr().err == ""


def test_remaining_time_of_a_line_is_that_of_what_was_begun_with_it() -> None:
    progress = ActivityProgress("running", 100.0, 0.5, 100.0, 0.5)
    assert progress_line(progress, 30.0, 110.0) == "30 s: running"
    assert progress_line(progress, 30.0, 110.0, 600.0) == "30 s of at most 10 min: running"
    # A tenth came in 60 s, four tenths are left; 20 s ago.
    progress = progress.updated("running", 0.6, 160.0)
    assert progress_line(progress, 300.0, 180.0) == "300 s: running, 60 %, about 220 s left"
    assert progress_line(progress.updated("writing", 0.0, 181.0), 901.0, 181.0) == "15 min: writing"
