"""What the terminal is told while something long goes on."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console

from tautwire.commands import shared


def test_time_left_is_told_of_work_whose_parts_come_minutes_apart(monkeypatch: pytest.MonkeyPatch) -> None:
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
