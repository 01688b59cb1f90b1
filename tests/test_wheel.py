"""The wheel, installed in an empty environment outside the checkout, builds and runs FMUs."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run(build, check=True, timeout=300)
    return next(folder.glob("tautwire-*.whl"))


@pytest.mark.slow
def test_both_packages_and_the_examples_are_in_it(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {
        "tautwire/cli.py",
        "tautwire/commands/tracing.py",
        "tautwire/py.typed",
        "tautwire/examples/three/robot.toml",
        "tautwire/examples/three/fit.csv",
        "tautwire_fmu/slaves.py",
        "tautwire_fmu/laws/effects/damping.py",
    } <= names
    assert not [name for name in names if name.startswith(("tests", "build")) or "__pycache__" in name]


@pytest.mark.slow
def test_it_works_in_an_empty_environment(wheel: Path, tmp_path: Path) -> None:
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", str(environment)], check=True, timeout=120)
    python = environment / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", str(wheel)], check=True, timeout=900)
    work = tmp_path / "work"
    work.mkdir()
    shutil.copytree(ROOT / "system" / "tautwire" / "examples" / "caroca", work / "caroca")
    for arguments in (
        ["build", "caroca/robot.toml", "--out", "fmus"],
        ["simulate", "caroca/robot.toml", "--speeds", "caroca/fit.csv", "--until", "0.5", "--out", "result.csv"],
        ["linearise", "caroca/robot.toml", "--out", "model.json"],
    ):
        subprocess.run([environment / "bin" / "tautwire", *arguments], cwd=work, check=True, timeout=300)
    assert len(list((work / "fmus").glob("*.fmu"))) == 4
    assert len((work / "result.csv").read_text().splitlines()) == 102
