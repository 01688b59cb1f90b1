"""Writes the files of a verdict on a rope."""

from __future__ import annotations

import json
from pathlib import Path

from ..robots.robot import Robot
from ..robots.writing import robot_text
from .document import material_document
from .figure import material_figure
from .robot_material import robot_material, with_material
from .verdict import MaterialVerdict

MATERIAL_FILES = ("fit.json", "material.png", "material.svg", "relaxation.toml", "robot.toml")
DOTS_PER_INCH = 150


def write_material(verdict: MaterialVerdict, folder: Path, robot: Robot | None = None) -> None:
    """Write ``fit.json``, the figure as PNG and SVG, and the lines for a robot file into a folder.

    ``robot`` is written too, as ``robot.toml``, with the rope on all its cables.
    """
    document = json.dumps(material_document(verdict), indent=1, allow_nan=False)
    (folder / "fit.json").write_text(document + "\n", encoding="utf-8")
    figure = material_figure(verdict)
    figure.savefig(folder / "material.png", dpi=DOTS_PER_INCH)
    figure.savefig(folder / "material.svg")
    rope = robot_material(verdict.model("robot").material)
    (folder / "relaxation.toml").write_text(rope.text(), encoding="utf-8")
    if robot:
        (folder / "robot.toml").write_text(robot_text(with_material(robot, rope)), encoding="utf-8")
