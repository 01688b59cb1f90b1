"""The pictures of the gallery that single calls draw: gain and phase, modes along a path, the workspace."""

from __future__ import annotations

from pathlib import Path

from tautwire import bode_figure, linearise, modes_along, modes_along_figure, read_robot
from tautwire.reports.workspace_figure import workspace_figure
from tautwire.robot.trajectory import PAPER_HELIX
from tautwire.robot.workspace import wrench_feasible_workspace
from tests.support.robots import EXAMPLES


def draw_gallery(folder: Path) -> None:
    """Draw ``bode.png``, ``modes.png`` and ``workspace.png`` as the lines in docs/gallery.md do."""
    three, eight = (read_robot(EXAMPLES / name / "robot.toml") for name in ("three", "eight"))
    figures = {
        "bode": bode_figure(linearise(three).system, "winch_speed_1", ["position_x", "tension_2"]),
        "modes": modes_along_figure(modes_along(three, PAPER_HELIX)),
        "workspace": workspace_figure(eight, wrench_feasible_workspace(eight)),
    }
    for name, figure in figures.items():
        figure.savefig(folder / f"{name}.png", metadata={"Software": None})
