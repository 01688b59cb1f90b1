"""The progress bar on a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from tautwire.cli import COMMANDS, run
from tautwire.cli import console as shared
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
    "material": (["--out", "out"], "fitting"),
}
# These take minutes: what does the work is taken from them, after its first word.
LONG = {
    "trace": ([ROBOT, FIT, "--out", "out"], "tautwire.estimation.trace"),
    "campaign": (["plan.toml", "--out", "out"], "tautwire.campaigns.campaign_runner.run_campaign"),
    "paper": (["--out", "out"], "tautwire.paper.write_paper"),
}
# It only writes a text.
AT_ONCE = {"columns", "example", "new"}


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> StringIO:
    """What a terminal shows of the bar."""
    shown = StringIO()
    monkeypatch.setattr(shared, "Console", lambda **options: Console(file=shown, force_terminal=True, width=120))
    return shown


def test_every_command_is_watched_but_what_is_done_at_once() -> None:
    assert {command.__name__ for command in COMMANDS} == AT_WORK.keys() | LONG.keys() | AT_ONCE


@pytest.mark.validate(but=["check", "build", "fmus", "simulate", "linearise", "workspace"])
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


def test_nothing_is_drawn_where_nobody_watches(monkeypatch: pytest.MonkeyPatch) -> None:
    heard = StringIO()
    monkeypatch.setattr(shared, "Console", lambda **options: Console(file=heard))
    with shared.progress_bar() as tell:
        tell("running", 0.5)
    assert heard.getvalue() == ""
