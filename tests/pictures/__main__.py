"""Draws the icons of the FMUs, and the pictures of README and docs that come from runs, these into a folder.

Run as ``python -m tests.pictures docs``.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tautwire import read_recording, read_robot, trace
from tests.pictures.component_icons import draw_icons
from tests.pictures.gallery import draw_gallery
from tests.pictures.traced_run import draw
from tests.support.folders import ROOT
from tests.support.robots import EXAMPLES

THREE = EXAMPLES / "three"


def main(folder: Path) -> None:
    """Draw the icons and the gallery; trace the three-cable example, and draw its run with what was left."""
    draw_icons(ROOT / "system" / "tautwire" / "fmus" / "icons")
    draw_gallery(folder)
    robot = read_robot(THREE / "robot.toml")
    fit, check = (read_recording(THREE / f"{name}.csv", robot.cable_count) for name in ("fit", "check"))
    draw(trace(robot, fit, check), folder / "traced_run.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
