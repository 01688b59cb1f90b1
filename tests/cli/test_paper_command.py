"""``tautwire paper`` where it cannot write; what it writes is held by ``test_paper_ledger.py``."""

from __future__ import annotations

from pathlib import Path

import pytest

from tautwire.cli import run


def test_file_in_the_place_of_the_folder_is_refused_before_anything_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "taken").write_text("mine")
    assert run(["paper", "--out", str(tmp_path / "taken")]) == 2
    said = capsys.readouterr().err.strip()
    assert "taken: is a file" in said and len(said.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]
