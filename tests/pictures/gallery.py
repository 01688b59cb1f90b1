"""The pictures of the gallery that single calls draw: gain and phase, modes along a path, the workspace."""

from __future__ import annotations

from pathlib import Path

from tautwire import bode_figure, linearise, modes_along, modes_along_figure, read_robot
from tautwire.reports.workspace_figure import workspace_figure
from tautwire.robot.pose_grid import orientation_grid
from tautwire.robot.trajectory import PAPER_HELIX
from tautwire.robot.workspace import workspace_on, wrench_feasible_workspace
from tests.support.robots import EXAMPLES


def draw_gallery(folder: Path) -> None:
    """Draw ``bode.png``, ``modes.png``, ``workspace.png`` and ``orientations.png`` as docs/gallery.md does."""
    three, eight, cogiro = (read_robot(EXAMPLES / name / "robot.toml") for name in ("three", "eight", "cogiro"))
    turns = orientation_grid(cogiro, (0.8, 0.8, 1.2), spacing=0.1)
    figures = {
        "bode": bode_figure(linearise(three).system, "winch_speed_1", ["position_x", "tension_2"]),
        "modes": modes_along_figure(modes_along(three, PAPER_HELIX)),
        "workspace": workspace_figure(eight, wrench_feasible_workspace(eight)),
        "orientations": workspace_figure(cogiro, workspace_on(turns, cogiro)),
    }
    for name, figure in figures.items():
        figure.savefig(folder / f"{name}.png", metadata={"Software": None})
