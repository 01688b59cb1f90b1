"""Files that explain an FMU to its user: a page on law and variables, the licenses, and an icon."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from importlib.resources import files
from textwrap import dedent
from types import ModuleType
from typing import TYPE_CHECKING, Any

from fmpy.model_description import ModelDescription, ScalarVariable

from tautwire_fmu.laws import cable, point_mass, rigid_body, sampled_control, winch_drive
from tautwire_fmu.laws.effects import BY_NAME

if TYPE_CHECKING:
    from jinja2 import Template

LAWS: Mapping[str, ModuleType] = {
    "cable": cable,
    "point_mass": point_mass,
    "rigid_body": rigid_body,
    "winch": winch_drive,
    "controller": sampled_control,
}
WHOLE_ROBOT = "robot"
# Modules that say what goes in and out, where it is not the slave of this kind in the package that FMUs contain.
SLAVE_MODULES = {WHOLE_ROBOT: ("tautwire.fmus.native", "robot_slave.py")}
# What model exchange adds.
FURTHER = "further"
TABLES = {
    "Inputs": "input",
    "Outputs": "output",
    "Parameters": "parameter",
    "States": "local",
    "Derivatives of the states, and event indicators": FURTHER,
}
# What travels inside an FMU of Python.
LICENSED_PACKAGES = ("tautwire", "pythonfmu")
ICON_PATHS = {"2.0": "model.png", "3.0": "terminalsAndIcons/icon.png"}
CODE_PATTERN = re.compile(r"(?::\w+:)?(`{1,2})~?(.+?)\1", re.DOTALL)


def documentation_files(
    kind: str,
    data: Mapping[str, Any],
    description: ModelDescription,
    packages: tuple[str, ...] = LICENSED_PACKAGES,
) -> dict[str, bytes]:
    """Contents by path in the archive: ``documentation/index.html``, the licenses, and the icon where FMI has it.

    ``kind`` is a key of :data:`LAWS` or :data:`WHOLE_ROBOT`, ``data`` the resource of the FMU, ``packages`` those
    whose code is in it.
    """
    return {
        "documentation/index.html": documentation_page(kind, data, description).encode("utf-8"),
        "documentation/licenses/license.txt": license_text(packages).encode("utf-8"),
        ICON_PATHS[_fmi_version(description)]: files(__package__).joinpath(f"icons/{kind}.png").read_bytes(),
    }


def documentation_page(kind: str, data: Mapping[str, Any], description: ModelDescription) -> str:
    """HTML page about an FMU: its law with formulas and source, its effects, its variables with units and values."""
    variables = description.modelVariables
    return _template().render(
        name=description.modelName,
        description=description.description,
        fmi_version=_fmi_version(description),
        tool=description.generationTool,
        component_blocks=_text_blocks(_slave_docstring(kind)),
        law=data.get("law"),
        law_blocks=[block for law in _laws(kind, data) for block in _text_blocks(law.__doc__ or "")],
        effects=[BY_NAME[setting["name"]] for setting in data.get("effects", ())],
        formulas=data.get("formulas") or {},
        has_model_exchange=description.modelExchange is not None,
        tables={
            title: [variable for variable in variables if _kind_of(variable) == kind_of]
            for title, kind_of in TABLES.items()
            if kind_of != FURTHER or description.modelExchange is not None
        },
    )


def _laws(kind: str, data: Mapping[str, Any]) -> list[ModuleType]:
    """Laws of a component, or of the components that a whole robot has."""
    if kind != WHOLE_ROBOT:
        return [LAWS[kind]]
    platform = "rigid_body" if data["is_rigid"] else "point_mass"
    return [LAWS[part] for part in ("cable", platform, *(["winch"] if data["winches"] else []))]


def _kind_of(variable: ScalarVariable) -> str:
    """Causality of a variable, but of local ones those apart that model exchange adds."""
    is_further = variable.name.startswith(("der(", "event_indicator_"))
    return FURTHER if is_further else str(variable.causality)


@cache
def license_text(packages: tuple[str, ...] = LICENSED_PACKAGES) -> str:
    """License texts of the packages whose code is in an FMU."""
    return "\n\n".join(f"{package}\n\n{_package_license(package)}" for package in packages)


@cache
def _template() -> Template:
    # Imported here: jinja2 takes longer to import than this module.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("tautwire.fmus")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.get_template("fmu.html.jinja")


def _fmi_version(description: ModelDescription) -> str:
    return "3.0" if str(description.fmiVersion).startswith("3.") else "2.0"


def _package_license(package: str) -> str:
    try:
        paths = metadata.files(package) or []
    except metadata.PackageNotFoundError:
        paths = []
    texts = [path.read_text(encoding="utf-8") for path in paths if path.name == "LICENSE"]
    return texts[0] if texts else "MIT License, https://opensource.org/license/mit\n"


@cache
def _slave_docstring(kind: str) -> str:
    """What goes in and out, read from the source: an import would bring in pythonfmu, perhaps that of a loaded FMU."""
    package, name = SLAVE_MODULES.get(kind, ("tautwire_fmu", f"{kind}_slave.py"))
    source = files(package).joinpath(name).read_text(encoding="utf-8")
    return (ast.get_docstring(ast.parse(source)) or "").partition(" of ")[2]


def _text_blocks(docstring: str) -> list[dict[str, Any]]:
    """Paragraphs and indented formulas of a docstring, without its markup."""
    blocks = []
    for block in re.split(r"\n\s*\n", docstring.strip("\n")):
        is_formula = block.startswith("    ")
        text = dedent(block) if is_formula else CODE_PATTERN.sub(r"\2", block)
        blocks.append({"is_formula": is_formula, "text": text})
    return blocks
