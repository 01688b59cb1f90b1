"""A figure of the wrench-feasible workspace: slices through the robot's start."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..errors import InputError
from ..robots.robot import Robot
from .workspace import Workspace

Array = NDArray[np.float64]

NAMES = "xyz"
SLICES = ((0, 1), (0, 2), (1, 2))
MISSING = "0.85"


def workspace_figure(robot: Robot, workspace: Workspace) -> Figure:
    """Three slices through the grid point nearest to the start, coloured by the margin in N where it is feasible.

    Grey is out of reach; exit points are squares, the start is a cross.
    """
    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    panels = figure.subplots(1, 3)
    within = workspace.margin[workspace.feasible]
    highest = float(np.max(within, initial=0.0)) or 1.0
    slices = [_slice(axes, robot, workspace, *pair, highest) for axes, pair in zip(panels, SLICES, strict=True)]
    figure.colorbar(slices[0], ax=list(panels), label="margin, N")
    figure.suptitle(f"Wrench-feasible workspace of {robot.name}")
    return figure


def checked_format(path: Path) -> None:
    """Raises InputError where no figure can be written in a format of this suffix."""
    known = Figure().canvas.get_supported_filetypes()
    if path.suffix.removeprefix(".").lower() not in known:
        raise InputError(
            str(path), "has no suffix of a figure", f"end it with .png, .pdf or .svg, or {', '.join(known)}"
        )


def _slice(axes: Axes, robot: Robot, workspace: Workspace, first: int, second: int, highest: float) -> Any:
    third = 3 - first - second
    place = int(np.argmin(np.abs(workspace.axes[third] - robot.platform.start[third])))
    margin = np.take(np.where(workspace.feasible, workspace.margin, np.nan), place, axis=third)
    axes.set_facecolor(MISSING)
    shown = axes.pcolormesh(
        _edges(workspace.axes[first]), _edges(workspace.axes[second]), margin.T, vmin=0.0, vmax=highest, cmap="viridis"
    )
    anchors = np.array(robot.anchors)
    axes.plot(anchors[:, first], anchors[:, second], "s", color="black", markersize=5, clip_on=False)
    axes.plot(robot.platform.start[first], robot.platform.start[second], "x", color="red", markersize=8)
    axes.set_xlabel(f"{NAMES[first]}, m")
    axes.set_ylabel(f"{NAMES[second]}, m")
    axes.set_title(f"{NAMES[third]} = {workspace.axes[third][place]:.4g} m")
    axes.set_aspect("equal")
    return shown


def _edges(points: Array) -> Array:
    """Edges of cells about points that are equally far from each other."""
    step = points[1] - points[0] if len(points) > 1 else 1.0
    edges: Array = np.append(points, points[-1] + step) - 0.5 * step
    return edges
