"""The wheel, built from the sdist and alone in an environment, builds and runs FMUs on the oldest Python."""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from tests.support.folders import ROOT

ENVIRONMENTS = ROOT / ".venv-wheels"
SUPPORTED = ("3.10", "3.11", "3.12", "3.13")


def oldest_python() -> tuple[str, str]:
    """Version and file of the oldest supported Python on the path or of pyenv; without any, this one."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    for version in SUPPORTED:
        installed = sorted(pyenv.glob(f"{version}.*/bin/python"))
        places = [shutil.which(f"python{version}"), *map(str, installed)]
        for place in places:
            if place and _runs(place, version):
                return version, place
    return f"{sys.version_info.major}.{sys.version_info.minor}", sys.executable


def _runs(python: str, version: str) -> bool:
    """Whether it is that Python and can make environments; a shim may be on the path without its Python."""
    ask = "import sys, venv; print('%d.%d' % sys.version_info[:2])"
    completed = subprocess.run([python, "-c", ask], capture_output=True, text=True, timeout=60)
    return completed.returncode == 0 and completed.stdout.strip() == version


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist and the wheel that is built from it."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)], check=True, timeout=600)
    return folder


@pytest.mark.validate
def test_both_packages_and_the_examples_are_in_the_wheel(built: Path) -> None:
    (wheel,) = built.glob("tautwire-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {
        "tautwire/cli/__main__.py",
        "tautwire/cli/identification_commands.py",
        "tautwire/py.typed",
        "tautwire/reports/assets/style.css",
        "tautwire/reports/templates/base.html.jinja",
        "tautwire/fmus/templates/fmu.html.jinja",
        "tautwire/fmus/icons/point_mass.png",
        "tautwire/reports/vendor/plotly-gl3d-4.1.1.min.js.gz",
        "tautwire/reports/vendor/plotly-LICENSE",
        "tautwire/examples/three/robot.toml",
        "tautwire/examples/three/fit.csv",
        "tautwire/examples/three/plan.toml",
        "tautwire_fmu/slaves.py",
        "tautwire_fmu/laws/effects/damping.py",
    } <= names
    assert not [name for name in names if name.startswith(("tests", "build")) or "__pycache__" in name]


@pytest.mark.validate
def test_the_readme_states_the_size_of_the_wheel(built: Path) -> None:
    (wheel,) = built.glob("tautwire-*.whl")
    (stated,) = re.findall(r"The wheel is ([\d.]+) MB", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert float(stated) == pytest.approx(wheel.stat().st_size / 1e6, rel=0.1)


@pytest.mark.validate
def test_what_the_documents_name_is_in_the_sdist(built: Path) -> None:
    (sdist,) = built.glob("tautwire-*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    there = ("Makefile", "LICENSE", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "mkdocs.yml", "docs/system.svg")
    assert set(there) <= names
    assert {str(page.relative_to(ROOT)) for page in (ROOT / "docs").glob("*.md")} <= names
    assert "tests/project/test_wheel.py" in names


def environment_with(wheel: Path, python: str, version: str) -> Path:
    """An environment with the wheel and what it declares, which is installed once and kept for the next wheel."""
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        declared = [line for line in archive.read(metadata).splitlines() if line.startswith(b"Requires-Dist")]
    digest = hashlib.sha256(b"\n".join((python.encode(), *declared))).hexdigest()[:8]
    environment = ENVIRONMENTS / f"{version}-{digest}"
    # This Python's pip serves all environments. What they never import need not be compiled.
    pip = [sys.executable, "-m", "pip", "--python", environment / "bin" / "python"]
    install = [*pip, "install", "--quiet", "--no-compile"]
    ready = environment / ".ready"
    if ready.exists():
        install += ["--no-deps", "--force-reinstall"]
    else:
        subprocess.run([python, "-m", "venv", "--clear", "--without-pip", str(environment)], check=True, timeout=120)
    subprocess.run([*install, str(wheel)], check=True, timeout=1800)
    ready.touch()
    return environment


@pytest.mark.validate
def test_it_works_with_nothing_but_what_it_declares(built: Path, tmp_path: Path) -> None:
    version, python = oldest_python()
    (wheel,) = built.glob("tautwire-*.whl")
    environment = environment_with(wheel, python, version)
    work = tmp_path / "work"
    work.mkdir()
    for arguments in (
        ["new", "hall"],
        ["example", "caroca"],
        ["check", "caroca/robot.toml", "caroca/fit.csv"],
        ["build", "caroca/robot.toml", "--out", "fmus"],
        ["simulate", "caroca/robot.toml", "--speeds", "caroca/fit.csv", "--until", "0.5", "--out", "result.csv"],
        ["linearise", "caroca/robot.toml", "--out", "model.json"],
    ):
        subprocess.run([environment / "bin" / "tautwire", *arguments], cwd=work, check=True, timeout=300)
    assert len(list((work / "fmus").glob("*.fmu"))) == 4
    assert len((work / "result.csv").read_text().splitlines()) == 102
