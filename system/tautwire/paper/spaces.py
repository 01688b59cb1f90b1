"""The paper's figures in space: Fig. 5a, Fig. 9 and Fig. 12b."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..robots.robot import Robot
from .parameters import Parameters
from .records import Record, Records
from .style import COLOURS, INK, RULE, Drawn

SIZE = 4.2
ZOOM = 0.88


def draw_spaces(parameters: Parameters, records: Records) -> Iterator[Drawn]:
    """The paths of Figs 5a and 12b, and both robots of Fig. 9 with theirs."""
    figure = Figure(figsize=(SIZE, SIZE))
    _path(_space(figure, 111), records["three/logarithmic"], "P1", "P2")
    yield Drawn(
        "fig_05a", "Fig. 5a: helix of the end-effector", "The path in space: two turns upward from P1 to P2.", figure
    )
    figure = Figure(figsize=(2.0 * SIZE, SIZE))
    for place, name in enumerate(("caroca", "fast"), start=1):
        axes = _space(figure, 120 + place)
        _frame(axes, parameters.robots[name])
        _path(axes, records[f"{name}/logarithmic"], "P1", "P2", offset=0.02 * _size(parameters.robots[name]))
        axes.set_title(f"({'ab'[place - 1]}) {name.upper()}", loc="left", fontsize="medium")
    told = (
        "Cables from the exit points to the start, and the helix: CAROCA with three cables, FAST with six, as assumed."
    )
    yield Drawn("fig_09", "Fig. 9: CAROCA and FAST", told, figure)
    figure = Figure(figsize=(SIZE, SIZE))
    _path(_space(figure, 111), records["three/static"], "P1", "P3")
    yield Drawn("fig_12b", "Fig. 12b: path of the end-effector", "The path in space from P1 to P3.", figure)


def _space(figure: Figure, place: int) -> Any:
    axes: Any = figure.add_subplot(place, projection="3d")
    for axis in "xyz":
        getattr(axes, f"set_{axis}label")(f"{axis} (m)")
        getattr(axes, f"{axis}axis").pane.set_visible(False)
    axes.tick_params(labelsize=7.5)
    axes.locator_params(nbins=5)
    axes.set_box_aspect(None, zoom=ZOOM)
    # The constrained layout does not know how far labels of space reach.
    figure.subplots_adjust(left=0.02, right=0.94, bottom=0.05, top=0.97, wspace=0.12)
    return axes


def _path(axes: Any, run: Record, begin: str, end: str, offset: float = 0.0) -> None:
    axes.plot(run["x"], run["y"], run["z"], color=COLOURS[0], linewidth=1.6)
    for row, label in ((0, begin), (-1, end)):
        x, y, z = (run[axis][row] for axis in "xyz")
        axes.plot([x], [y], [z], "o", color=COLOURS[1], markersize=4.0)
        axes.text(x, y, z + offset, f"\u2002{label}", color=INK)


def _frame(axes: Any, robot: Robot) -> None:
    start = robot.platform.start
    for number, anchor in enumerate(robot.anchors, start=1):
        axes.plot(*zip(anchor, start, strict=True), color=RULE, linewidth=1.0)
        axes.plot(*([value] for value in anchor), "s", color=COLOURS[2], markersize=4.0)
        axes.text(*anchor, f"\u2002$B_{number}$", color=INK)


def _size(robot: Robot) -> float:
    return float(np.max(np.ptp(np.array(robot.anchors), axis=0)))
