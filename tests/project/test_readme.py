"""The README's Python and shell blocks run as they are printed."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tautwire.cli import app
from tautwire.cli import run as command
from tests.support.folders import ROOT

README = ROOT / "README.md"
# tests/project/test_wheel.py installs it.
INSTALLED = "pip install"
# Others run what takes minutes: tests/paper/test_paper_reproduction.py and tests/cli/test_commands.py.
MINUTES_LONG = ("tautwire paper ", "tautwire trace ")


def blocks_of(language: str) -> list[str]:
    """The README's blocks of a language; those of the shell have an empty one."""
    pairs = re.findall(r"^```(\w*)\n(.*?)^```$", README.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    return [text for name, text in pairs if name == language]


def shell_blocks() -> list[str]:
    """The shell blocks that need no installation, without what takes minutes."""
    blocks = [block for block in blocks_of("") if not block.startswith(INSTALLED)]
    return ["\n".join(line for line in b.splitlines() if not line.startswith(MINUTES_LONG)) + "\n" for b in blocks]


def run_in_shell(script: str, folder: Path) -> None:
    """Runs a block line by line, as it is typed, with this environment's commands; the first failure ends it."""
    paths = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    subprocess.run(["sh", "-eu", "-c", script], cwd=folder, env={**os.environ, "PATH": paths}, check=True, timeout=1500)


def written_by(script: str) -> list[str]:
    """What the commands of a block are told to write."""
    commands = "\n".join(line for line in script.splitlines() if not line.startswith("#"))
    return re.findall(r"--(?:out|report|plot) (\S+)", commands)


@pytest.mark.validate
def test_every_python_example_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(["example", "three"]) == 0
    examples = blocks_of("python")
    assert len(examples) >= 4
    for example in examples:
        exec(compile(example, str(README), "exec"), {})
    assert "The model lacks damping; with it, the residual is white noise." in capsys.readouterr().out
    assert (tmp_path / "report" / "index.html").exists()


def test_every_command_is_named() -> None:
    """That of other programs' files, which do not ship, as a comment."""
    shown = README.read_text(encoding="utf-8")
    for each in app.registered_commands:
        assert re.search(rf"^(# )?tautwire {each.name} ", shown, re.MULTILINE)


@pytest.mark.validate
@pytest.mark.parametrize("block", shell_blocks(), ids=["main job", "commands"])
def test_every_shell_block_runs_as_printed(block: str, tmp_path: Path) -> None:
    run_in_shell(block, tmp_path)
    folder = tmp_path / "three" if "\ncd three\n" in block else tmp_path
    assert all((folder / each).exists() for each in written_by(block))


def test_what_is_installed_is_this_project() -> None:
    (block,) = [block for block in blocks_of("") if block.startswith(INSTALLED)]
    assert block.split()[:4] == ["pip", "install", ".", "#"]


def test_it_is_short() -> None:
    assert len(README.read_text(encoding="utf-8").split()) < 1350
