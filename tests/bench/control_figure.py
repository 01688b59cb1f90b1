"""The figure of the controllers' bench."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tautwire.control import Design, margins_of, robot_with
from tautwire.linear import linearise
from tautwire.robot.schema import Robot

Array = NDArray[np.float64]
Curves = Mapping[str, tuple[Array, Array]]

COLOURS = {
    "open loop": "#7f7f7f",
    "feedforward": "#d4a017",
    "ZV shaped": "#2ca02c",
    "EI shaped": "#98c379",
    "LQG": "#1f77b4",
    "LQG, scheduled": "#17becf",
    "robust": "#c0392b",
    "robust, scheduled": "#e67e22",
}
PAYLOADS = {0.8: ":", 1.0: "-", 1.2: "--"}
WINDOW = 50
MODULI = np.linspace(102e9, 135e9, 7)


def draw(helix: Curves, ramp: Curves, push: Curves, robot: Robot, feedback: Mapping[str, Design], path: Path) -> None:
    """Distance from the helix, swing on the ramp, answer to the force, and margins over the range, as SVG.

    Each curve is time in s and length in m.
    """
    figure = Figure(figsize=(11.0, 7.5), layout="constrained")
    (upper_left, upper_right), (lower_left, lower_right) = figure.subplots(2, 2)
    _distances(upper_left, helix, "Distance from the helix, smoothed over 0.5 s")
    _curves(upper_right, ramp, "Ramp: swing in height that is left")
    _curves(lower_left, push, "Force of 5 % of the weight: distance from the place")
    _margins(lower_right, robot, feedback)
    with matplotlib.rc_context({"svg.hashsalt": "tautwire", "svg.fonttype": "none"}):
        figure.savefig(path, metadata={"Date": None})


def _distances(axes: Axes, curves: Curves, title: str) -> None:
    for name, (times, values) in curves.items():
        smooth = np.sqrt(np.convolve(values**2, np.ones(WINDOW) / WINDOW, mode="valid"))
        middles = times[WINDOW // 2 :][: len(smooth)]
        axes.semilogy(middles[::10], 1e3 * smooth[::10] + 1e-6, color=COLOURS[name], label=name, lw=1.2)
    axes.set(title=title, xlabel="time, s", ylabel="mm")
    axes.set_ylim(1e-3, 1e2)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, ncols=3, loc=(0.3, 0.56))


def _curves(axes: Axes, curves: Curves, title: str) -> None:
    for name, (times, values) in curves.items():
        axes.plot(times[::2], 1e3 * values[::2], color=COLOURS[name], label=name, lw=1.0)
    axes.set(title=title, xlabel="time, s", ylabel="mm")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, ncols=2)


def _margins(axes: Axes, robot: Robot, feedback: Mapping[str, Design]) -> None:
    for name in ("LQG", "robust"):
        knot = feedback[name].knots()[0]
        for payload, style in PAYLOADS.items():
            margins = [margins_of(linearise(robot_with(robot, float(E), payload)), knot).winch_disk for E in MODULI]
            label = f"{name}, payload {payload:g}"
            axes.plot(1e-9 * MODULI, margins, style, color=COLOURS[name], label=label)
    axes.axhline(2.0 / 3.0, color="k", lw=0.7)
    axes.set(title="Disk margin of all winches at once", xlabel="modulus, GPa")
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, ncols=2)
