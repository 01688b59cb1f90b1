"""The picture of a traced run: the robot with its path, and what the model missed before and after."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from tautwire.estimation import Trace
from tautwire.estimation.trace_result import Comparison
from tautwire.robot.schema import Robot

Array = NDArray[np.float64]

BEFORE, AFTER, NOISE = "#c0392b", "#1f5fa8", "#8a8a8a"
CABLES = ("#1f5fa8", "#2a8c5a", "#b8860b")
SETTINGS = {"font.size": 9.0}
DOTS_PER_INCH = 140
LEGEND: dict[str, Any] = {"loc": "upper right", "ncols": 3, "framealpha": 0.85, "edgecolor": "none"}


def draw(trace: Trace, path: Path) -> None:
    """The check recording's run as PNG: the robot in space, the tensions, and their residual before and after."""
    (comparison,) = [each for each in trace.comparisons if each.role == "check"]
    with matplotlib.rc_context(SETTINGS):
        figure = Figure(figsize=(10.0, 4.4), layout="constrained")
        left, right = figure.subfigures(1, 2, width_ratios=(1.0, 1.45))
        _robot(left.add_subplot(projection="3d"), trace.robot_before, comparison.after.position)
        upper, lower = right.subplots(2, 1, sharex=True)
        _tensions(upper, comparison)
        _residual(lower, comparison, trace)
        figure.savefig(path, dpi=DOTS_PER_INCH, metadata={"Software": None})


def _robot(axes: Any, robot: Robot, position: Array) -> None:
    end = position[len(position) // 2]
    for anchor, colour in zip(robot.anchors, CABLES, strict=True):
        axes.plot(*zip(anchor, end, strict=True), color=colour, lw=1.5)
        axes.plot(*zip(anchor, (anchor[0], anchor[1], 0.0), strict=True), color="#cccccc", lw=3.0)
    axes.plot(*position.T, color="#222222", lw=1.0)
    axes.plot(*end[:, None], "o", color="#222222", ms=7)
    axes.set_box_aspect((1.0, 1.0, 0.7), zoom=1.05)
    axes.view_init(elev=22.0, azim=-62.0)
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", strict=True):
        axis.set_label_text(f"{name}, m")
        axis.set_major_locator(matplotlib.ticker.MaxNLocator(4))
    axes.set_title(f"{robot.platform.mass:g} kg on three cables", y=1.0)


def _tensions(axes: Axes, comparison: Comparison) -> None:
    for number, colour in enumerate(CABLES):
        axes.plot(comparison.recording.time, comparison.recording.tension[:, number] / 1e3, color=colour, lw=0.8)
    axes.margins(x=0.01, y=0.2)
    axes.set_title("Tensions as recorded on CHECK")
    axes.set_ylabel("kN")
    axes.legend(
        [f"cable {number}" for number in (1, 2, 3)], loc="upper right", ncols=3, framealpha=0.85, edgecolor="none"
    )


def _residual(axes: Axes, comparison: Comparison, trace: Trace) -> None:
    time, measured = comparison.recording.time, comparison.recording.tension[:, 0]
    for motion, colour in ((comparison.before, BEFORE), (comparison.after, AFTER)):
        axes.plot(time, measured - motion.tension[:, 0], color=colour, lw=0.6)
    axes.margins(x=0.01, y=0.2)
    floor = trace.noise_floor.cables[0]
    axes.axhspan(-2.0 * floor, 2.0 * floor, color=NOISE, alpha=0.25, lw=0)
    names = ", ".join(effect.name for effect in trace.effects) or trace.verdict
    axes.set_title(f"What the model misses at cable 1, before and after finding: {names}")
    axes.set(xlabel="time, s", ylabel="N")
    lines = [Line2D([], [], color=colour) for colour in (BEFORE, AFTER)] + [
        Line2D([], [], color=NOISE, lw=6, alpha=0.3)
    ]
    axes.legend(
        lines,
        ["before", "after", "noise, two deviations"],
        loc="upper right",
        ncols=3,
        framealpha=0.85,
        edgecolor="none",
    )
