"""The pages under docs/: their Python runs as it stands, and together they make a site without a warning."""

import importlib
import os
import pkgutil
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy.ssp.simulation as ssp_simulation
import pytest
import typer

import tautwire
from tautwire.campaigns import plan_file as plans
from tautwire.cli import app
from tautwire.cli import run as command
from tautwire.cli.progress_lines import LINE_INTERVAL
from tautwire.cosimulation.robot_wiring import result_columns
from tautwire.estimation.trace_result import Correlation, FittedParameter, Resonance
from tautwire.linear import linearise
from tautwire.linear.linear_plant import model_document
from tautwire.materials.material_table import COLUMN_RULES
from tautwire.recordings.recording_table import known_columns
from tautwire.reports import trace_document
from tautwire.robot import robot_file_reader as robots
from tautwire.robot.robot_template import new_robot_text
from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.formula import VARIABLES_BY_TARGET
from tests.support.folders import ROOT
from tests.support.robots import example
from tests.support.traces import made_trace

DOCS = ROOT / "docs"

# Of the page about an effect of one's own, run after its example.
EFFECT_HOLDS = """
from tautwire.robot.robot_file_writer import write_robot
assert abs(still.position - plain.platform.start).max() < 1e-6
assert np.allclose(heavier, 1.0 + 15.0 * 5.0 / (300.0 * 9.81))
assert not np.allclose(swings, linearise(plain).modes.frequencies, rtol=1e-6)
assert "hose" in tried
write_robot(hosed, "hosed.toml")
assert read_robot("hosed.toml").effects == hosed.effects
neutral = plain.with_effect(EffectSetting("hose", {"weight": 0.0}))
assert np.array_equal(static_tensions(neutral), static_tensions(plain))
"""


def code_of(page: str) -> dict[str, str]:
    """The Python of a page, by its title; numbered where it has none."""
    blocks = re.findall(
        r"```python(?: title=\"(.*?)\")?\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL
    )
    return {title or str(number): code for number, (title, code) in enumerate(blocks)}


@pytest.mark.validate(but=["index.md"])
@pytest.mark.parametrize("page", ["index.md", "linear.md", "gallery.md"])
def test_examples_of_a_page_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(["example", "three", "."]) == 0
    for code in code_of(page).values():
        exec(compile(code, page, "exec"), {})


@pytest.mark.validate
def test_example_of_the_controllers_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    results: dict[str, Any] = {}
    for code in code_of("control.md").values():
        exec(compile(code, "control.md", "exec"), results)
    for name in ("same", "by_fmu"):
        assert abs(results["motion"].position - results[name].position).max() < 1e-9
    for name in ("filtered", "proportional"):
        assert abs(results[name].position[-1] - results["path"].end).max() < 0.02
    for name in ("compensated", "steady"):
        reference = results["path"].position(results[name].time)
        assert abs(results[name].position - reference).max() < 1e-4
    uncompensated, shaped_path = results["uncompensated"], results["shaped_path"]
    assert uncompensated.time[-1] > shaped_path.duration > results["path"].duration
    assert abs(uncompensated.position - shaped_path.position(uncompensated.time)).max() > 1e-3


@pytest.mark.validate
def test_examples_of_the_fmus_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # The page replaces a function of FMPy.
    monkeypatch.setattr(ssp_simulation, "instantiate_fmu", ssp_simulation.instantiate_fmu)
    assert command(["example", "three", "."]) == 0
    assert command(["build", "robot.toml", "--out", "build"]) == 0
    results: dict[str, Any] = {}
    for code in code_of("fmus.md").values():
        exec(compile(code, "fmus.md", "exec"), results)
    assert results["result"]["platform.position.z"][-1] == pytest.approx(example("three").platform.start[2], abs=1e-6)


@pytest.mark.validate
def test_an_effect_is_added_by_following_its_page(tmp_path: Path) -> None:
    for source in ("system/tautwire", "fmu_src/tautwire_fmu"):
        shutil.copytree(ROOT / source, tmp_path / source, ignore=shutil.ignore_patterns("__pycache__"))
    code = code_of("effect.md")
    for title, text in code.items():
        place, _, where = title.partition(": ")
        if where:
            put_in(tmp_path / place, where, text)
        elif place.endswith(".py"):
            (tmp_path / place).write_text(text, encoding="utf-8")
    (tmp_path / "try_it.py").write_text(code["try it"] + EFFECT_HOLDS, encoding="utf-8")
    paths = os.pathsep.join(str(tmp_path / folder) for folder in ("system", "fmu_src"))
    environment = {**os.environ, "PYTHONPATH": paths}
    # Not from site-packages: an editable install comes after PYTHONPATH.
    subprocess.run([sys.executable, "try_it.py"], cwd=tmp_path, env=environment, check=True, timeout=300)


def put_in(file: Path, where: str, text: str) -> None:
    """Puts a line of the page into a file, where the page says."""
    content = file.read_text(encoding="utf-8")
    marks = {"beside the other imports": r"(?=^from \.hysteresis)", "in ALL": r"(?<=^    HYSTERESIS,\n)"}
    mark = marks.get(where, r"(?<=^UNITS: Dict\[str, Dict\[str, int\]\] = \{\n)")
    changed, count = re.subn(mark, lambda match: text, content, flags=re.MULTILINE)
    assert count == 1, where
    file.write_text(changed, encoding="utf-8")


@pytest.mark.validate
def test_the_site_builds_without_a_warning_and_asks_nothing_of_the_network(tmp_path: Path) -> None:
    pytest.importorskip("material", reason="mkdocs-material is not installed: pip install mkdocs-material")
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}, check=True, timeout=120)
    pages = list(tmp_path.rglob("*.html"))
    sources = [*DOCS.glob("*.md"), *DOCS.glob("tutorials/*.ipynb")]
    assert {path.stem for path in sources} <= {page.stem for page in pages}
    mathematics = (tmp_path / "mathematics.html").read_text(encoding="utf-8")
    assert mathematics.count("<math") > 40 and "$" not in mathematics
    reference = (tmp_path / "reference.html").read_text(encoding="utf-8")
    assert [name for name in tautwire.__all__ if f'id="tautwire.{name}"' not in reference] == []
    assert "Raises RobotFileError" in reference and ":func:" not in reference
    packages = (tmp_path / "reference-packages.html").read_text(encoding="utf-8")
    assert [name for name in public_names() if not re.search(rf'id="{name}"', packages)] == []
    for page in pages:
        loaded = re.findall(
            r"<(?:script|link|img|iframe)[^>]*?(?:src|href)=\"?([^\s\">]+)", page.read_text(encoding="utf-8")
        )
        assert loaded
        assert not [address for address in loaded if address.startswith(("http:", "https:", "//"))]


def test_the_first_page_says_how_often_a_piped_command_tells_its_progress() -> None:
    assert LINE_INTERVAL == 10.0
    assert "a line every ten seconds where output is piped" in (DOCS / "index.md").read_text(encoding="utf-8")


def public_names() -> Iterator[str]:
    """Patterns of the names in ``__all__`` of each package but the command line, which may stand under a module."""
    for each in pkgutil.iter_modules(tautwire.__path__, "tautwire."):
        if each.ispkg and each.name != "tautwire.cli":
            for name in getattr(importlib.import_module(each.name), "__all__", ()):
                yield rf"{re.escape(each.name)}\.(\w+\.)?{name}"


def named_in(page: str) -> set[str]:
    """All words that a page writes as code."""
    code = re.findall(r"`([^`\n]+)`", (DOCS / page).read_text(encoding="utf-8"))
    return {word for each in code for word in re.findall(r"\w+", each)}


def keys_in(document: Any) -> Iterator[str]:
    """The keys of a document and of all in it."""
    if isinstance(document, dict):
        yield from document
    for each in document.values() if isinstance(document, dict) else document if isinstance(document, list) else ():
        yield from keys_in(each)


def of_cable(names: Iterator[str]) -> set[str]:
    """Names with the number of a cable written as "i"."""
    return {re.sub(r"_\d+$", "_i", name) for name in names}


def test_page_of_files_tells_every_key_of_a_robot_file() -> None:
    keys = {
        *robots.TOP_LEVEL_KEYS,
        *robots.NOISE_RULES,
        *robots.OFFSET_RULES,
        *robots.WINCH_LIMIT_RULES,
        *VARIABLES_BY_TARGET,
        "cables",
    }
    written = set(re.findall(r"^(?:# )?(\w+) = ", new_robot_text("hall"), re.MULTILINE))
    assert len(written) > 25
    assert (keys | written) - named_in("formats.md") == set()


def test_page_of_files_tells_every_number_of_every_effect() -> None:
    page = (DOCS / "formats.md").read_text(encoding="utf-8").partition("### Effects")[2]
    units = {"m2": "m²", "kg/m3": "kg/m³", "1": ""}
    for effect in BY_NAME.values():
        rows = [
            f"| `{each.name}` | {units.get(each.unit, each.unit)} | "
            f"{'' if each.neutral is None else f'{each.neutral:g}'} | {each.description} |"
            for each in effect.parameters
        ]
        table = page[page.index(f"\n| `{effect.name}` ") :]
        shown = [re.sub(r"^\|[^|]*", "", line) for line in table.splitlines()[1 : len(rows) + 1]]
        assert shown == rows


def test_page_of_files_tells_every_column_of_recordings_and_results() -> None:
    columns = {*known_columns(1), *(column.name for column in result_columns(1, winches=(1,), is_rigid=True))}
    assert of_cable(iter(columns)) - named_in("formats.md") == set()
    # One for phase_degrees, one for each uncertainty.
    assert {name.removesuffix("_uncertainty") for name in COLUMN_RULES} - named_in("formats.md") == set()


def test_page_of_files_tells_every_key_of_a_model() -> None:
    assert set(model_document(linearise(example("three")))) - named_in("formats.md") == set()


def test_page_of_files_tells_every_key_of_a_report() -> None:
    trace = made_trace(samples=200)
    swinging = Resonance(0.45, ("x",), ("fit",))
    together = Correlation((FittedParameter("damping", (1,), "damping"), FittedParameter("drum", (1,), "slip")), 0.3)
    document = trace_document(replace(trace, resonances=(swinging,), correlations=(together,)))
    parameters = {p.name for effect in BY_NAME.values() for p in effect.parameters}
    assert {"between", "moves_with", "other_cables", "frequency_hz"} <= set(keys_in(document))
    assert of_cable(keys_in(document)) - parameters - named_in("formats.md") == set()


def test_page_of_campaigns_tells_every_key_of_a_plan() -> None:
    assert set(plans.PLAN_KEYS) - named_in("campaign.md") == set()


def test_pages_name_only_what_is_there() -> None:
    for page in (*DOCS.glob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"):
        for place in re.findall(r"`((?:tests|system|fmu_src|docs)/[\w/.]+)`", page.read_text(encoding="utf-8")):
            assert (ROOT / place).exists(), f"{page.name}: {place}"


def test_pages_show_commands_and_options_that_exist() -> None:
    group = typer.main.get_command(app)
    assert isinstance(group, typer.core.TyperGroup)
    shown = [line for page in DOCS.glob("*.md") for line in commands_of(page.read_text(encoding="utf-8"))]
    assert len(shown) > 20
    for line in shown:
        name, *arguments = shlex.split(line, comments=True)[1:]
        group.commands[name].make_context(name, arguments)
    with pytest.raises(Exception, match="No such option"):
        group.commands["build"].make_context("build", ["robot.toml", "--oot", "build/"])


def commands_of(page: str) -> list[str]:
    """Lines of its blocks that run the command line."""
    return re.findall(r"^tautwire .*", page.replace("\\\n", " "), re.MULTILINE)
