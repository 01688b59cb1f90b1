"""The README's Python runs as it stands."""

import re
from pathlib import Path

import pytest

from tautwire.cli import application

README = Path(__file__).parent.parent / "README.md"


@pytest.mark.slow
def test_every_python_example_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    examples = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) >= 4
    for example in examples:
        exec(compile(example, str(README), "exec"), {})
    assert "The model lacks damping; with it, what is left is noise." in capsys.readouterr().out
    assert (tmp_path / "report" / "index.html").exists()


def test_every_command_is_named() -> None:
    shown = README.read_text(encoding="utf-8")
    for command in application.registered_commands:
        assert command.callback and f"\ntautwire {command.callback.__name__} " in shown
