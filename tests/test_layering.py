"""Imports between the product's rooms go one way, at the top of modules and inside of functions alike."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

SYSTEM = Path(__file__).resolve().parents[1] / "system"
FMU_SOURCES = SYSTEM.parent / "fmu_src"
FILES = (
    "array_validation",
    "atomic_output",
    "input_files",
    "json_document",
    "machine_code_cache",
    "memoisation",
    "name_suggestions",
    "number_format",
    "process_signals",
    "provenance",
    "toml_text",
)
ROOMS = (
    "robot",
    "recordings",
    "fmus",
    "cosimulation",
    "linear",
    "control",
    "estimation",
    "materials",
    "reports",
    "campaigns",
    "paper",
    "cli",
)
LAYERS = (("errors", "foreign_formats"), FILES, ("validation",), *((room,) for room in ROOMS))
LAYER_OF = {name: layer for layer, names in enumerate(LAYERS) for name in names}


@cache
def imported_modules(file: Path, root: Path) -> tuple[tuple[int, tuple[str, ...]], ...]:
    """Line and full dotted name of each import anywhere in a module; names imported from a package are appended."""
    return tuple(_imported_modules(file, root))


def _imported_modules(file: Path, root: Path) -> Iterator[tuple[int, tuple[str, ...]]]:
    package = file.relative_to(root).parts[:-1]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, tuple(alias.name.split("."))) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = (*base, *(node.module.split(".") if node.module else ()))
            yield from ((node.lineno, (*module, alias.name)) for alias in node.names)


def upward_imports(system: Path) -> list[str]:
    """The imports of a module in a higher layer, or in another one of the same layer."""
    results = []
    for file in sorted((system / "tautwire").rglob("*.py")):
        room = file.relative_to(system / "tautwire").with_suffix("").parts[0]
        for line, imported in imported_modules(file, system):
            if room == "__init__" or imported[0] != "tautwire" or imported[1] in ("__version__", room):
                continue
            if LAYER_OF[imported[1]] >= LAYER_OF[room]:
                results.append(f"{file.relative_to(system)}:{line} imports {'.'.join(imported)}")
    return results


def import_circle(system: Path) -> list[tuple[str, ...]]:
    """Modules that import each other in a circle, also inside of functions; empty where there is none."""
    files = {file.relative_to(system).with_suffix("").parts: file for file in (system / "tautwire").rglob("*.py")}
    imports = {
        name: {module for _, imported in imported_modules(file, system) for module in (imported, imported[:-1])}
        for name, file in files.items()
    }
    try:
        TopologicalSorter({name: (modules & set(files)) - {name} for name, modules in imports.items()}).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_every_module_and_package_of_the_root_has_a_layer():
    names = {path.stem for path in (SYSTEM / "tautwire").iterdir() if path.suffix == ".py" or list(path.glob("*.py"))}
    assert names - {"__init__"} == set(LAYER_OF)


def test_imports_lead_to_lower_layers_only():
    assert upward_imports(SYSTEM) == []


@pytest.mark.parametrize(
    "statement",
    (
        "from ..estimation.likelihood import Likelihood",
        "from .. import estimation",
        "import tautwire.estimation.likelihood",
        "def late():\n    from ..estimation import trace",
    ),
)
def test_an_import_of_a_higher_layer_is_found(tmp_path, statement):
    room = tmp_path / "tautwire" / "robot"
    room.mkdir(parents=True)
    (room / "schema.py").write_text(statement, encoding="utf-8")
    assert len(upward_imports(tmp_path)) == 1


def test_no_modules_import_each_other_in_a_circle():
    assert import_circle(SYSTEM) == []


def test_a_circle_through_an_import_inside_of_a_function_is_found(tmp_path):
    room = tmp_path / "tautwire" / "robot"
    room.mkdir(parents=True)
    (room / "kinematics.py").write_text("from .statics import tensions", encoding="utf-8")
    (room / "statics.py").write_text("def late():\n    from . import kinematics", encoding="utf-8")
    assert {name[-1] for name in import_circle(tmp_path)} == {"kinematics", "statics"}


def test_what_travels_in_fmus_imports_nothing_of_the_system():
    imported = {name[0] for file in FMU_SOURCES.rglob("*.py") for _, name in imported_modules(file, FMU_SOURCES)}
    assert "tautwire" not in imported
