"""A figure of a workspace: slices through the robot's start, or through the orientation at a position."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from ..errors import InputError
from ..robot.schema import Robot
from ..robot.workspace import Workspace

Array = NDArray[np.float64]

SLICE_AXES = ((0, 1), (0, 2), (1, 2))
INFEASIBLE_COLOUR = "0.85"
INTERFERENCE_HATCH = "xxx"
TITLES = {
    "wrench-feasible": "Wrench-feasible workspace",
    "wrench-closure": "Wrench-closure workspace",
    "static": "Static workspace",
}


def workspace_figure(robot: Robot, workspace: Workspace) -> Figure:
    """Draws three slices through the grid point nearest to the start, coloured by the margin where feasible.

    Grey is infeasible; exit points are squares, the start is a cross. Where a cable touches another or the platform,
    the slice is hatched. Of orientations, the slices are through no rotation.
    """
    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    panels = figure.subplots(1, 3)
    feasible_margins = workspace.margin[workspace.feasible]
    max_margin = float(np.max(feasible_margins, initial=0.0)) or 1.0
    slices = [
        _draw_slice(axes, robot, workspace, *pair, max_margin) for axes, pair in zip(panels, SLICE_AXES, strict=True)
    ]
    figure.colorbar(slices[0], ax=list(panels), label="margin, N")
    title = f"{TITLES[workspace.criterion]} of {robot.name}"
    if workspace.interference is not None and np.any(workspace.interference):
        title += " (hatched: a cable touches another, or runs through the platform)"
    figure.suptitle(title)
    return figure


def require_figure_format(path: Path) -> None:
    """Raises InputError if matplotlib cannot write the format of this suffix."""
    formats = Figure().canvas.get_supported_filetypes()
    if path.suffix.removeprefix(".").lower() not in formats:
        raise InputError(
            str(path), "has no suffix of a figure", f"end it with .png, .pdf or .svg, or {', '.join(formats)}"
        )


def _draw_slice(axes: Axes, robot: Robot, workspace: Workspace, first: int, second: int, max_margin: float) -> Any:
    third = 3 - first - second
    index = int(np.argmin(np.abs(workspace.axes[third] - workspace.centre[third])))
    margin = np.take(np.where(workspace.feasible, workspace.margin, np.nan), index, axis=third)
    axes.set_facecolor(INFEASIBLE_COLOUR)
    edges = [_cell_edges(workspace.axes[axis]) for axis in (first, second)]
    mesh = axes.pcolormesh(*edges, margin.T, vmin=0.0, vmax=max_margin, cmap="viridis")
    if workspace.interference is not None:
        touching = np.take(np.logical_or(*workspace.interference), index, axis=third)
        for column, row in np.argwhere(touching):
            corner = (edges[0][column], edges[1][row])
            width, height = edges[0][column + 1] - corner[0], edges[1][row + 1] - corner[1]
            axes.add_patch(Rectangle(corner, width, height, fill=False, linewidth=0.0, hatch=INTERFERENCE_HATCH))
    if workspace.axis_names == ("x", "y", "z"):
        anchors = np.array(robot.anchors)
        axes.plot(anchors[:, first], anchors[:, second], "s", color="black", markersize=5, clip_on=False)
    axes.plot(workspace.centre[first], workspace.centre[second], "x", color="red", markersize=8)
    axes.set_xlabel(_axis_label(workspace, first))
    axes.set_ylabel(_axis_label(workspace, second))
    name, unit = _axis_label(workspace, third).split(", ")
    axes.set_title(f"{name} = {workspace.axes[third][index]:.4g} {unit}")
    axes.set_aspect("equal")
    return mesh


def _axis_label(workspace: Workspace, axis: int) -> str:
    name = workspace.axis_names[axis]
    return f"{name}, m" if name in "xyz" else f"{name.replace('_', ' about ')}, rad"


def _cell_edges(points: Array) -> Array:
    """Cell edges around equidistant points."""
    step = points[1] - points[0] if len(points) > 1 else 1.0
    edges: Array = np.append(points, points[-1] + step) - 0.5 * step
    return edges
