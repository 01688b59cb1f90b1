"""The README's Python and commands run as they stand."""

import re
import shlex
from pathlib import Path

import pytest

from tautwire.cli import app
from tautwire.cli import run as command
from tests.support.folders import ROOT
from tests.support.robots import EXAMPLES

# Traces, programs and the paper take minutes and have tests of their own; a campaign needs a plan of the user's.
LEFT_OUT = ("trace", "excite", "paper", "campaign")
README = ROOT / "README.md"


@pytest.mark.validate
def test_every_python_example_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    examples = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) >= 4
    for example in examples:
        exec(compile(example, str(README), "exec"), {})
    assert "The model lacks damping; with it, the residual is white noise." in capsys.readouterr().out
    assert (tmp_path / "report" / "index.html").exists()


def test_every_command_is_named() -> None:
    shown = README.read_text(encoding="utf-8")
    for each in app.registered_commands:
        assert each.callback and f"\ntautwire {each.callback.__name__} " in shown


def shown_commands() -> list[list[str]]:
    """The words of each command shown, without comments, the shipped robot in the place of the shell's variable."""
    lines = re.findall(r"^tautwire (.*)$", README.read_text(encoding="utf-8"), re.MULTILINE)
    return [shlex.split(line.replace("$E", str(EXAMPLES / "three")), comments=True) for line in lines]


def test_the_shell_s_variable_is_the_folder_of_a_shipped_robot() -> None:
    (folder,) = re.findall(r"^E=(\S+)", README.read_text(encoding="utf-8"), re.MULTILINE)
    assert (README.parent / folder).resolve() == (EXAMPLES / "three").resolve()


@pytest.mark.validate(but=["new", "check", "build", "fmus"])
@pytest.mark.parametrize(
    "words", [each for each in shown_commands() if each[0] not in LEFT_OUT], ids=lambda each: each[0]
)
def test_every_command_runs(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(words) == 0
    written = [words[k + 1] for k, word in enumerate(words) if word in ("--out", "--report", "--plot")]
    assert all((tmp_path / each).exists() for each in written)


def test_it_is_short() -> None:
    assert len(README.read_text(encoding="utf-8").split()) < 1350
