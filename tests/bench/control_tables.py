"""The tables of the controllers' bench, in markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import control
import numpy as np
from numpy.typing import NDArray

from tautwire.control import (
    Design,
    Knot,
    Margins,
    Range,
    ScheduledController,
    margins_over,
    ramp_plant,
    speed_controller,
)
from tautwire.linear import LinearPlant, linearise
from tautwire.robot.schema import Robot
from tautwire.robot.trajectory import Trajectory
from tests.bench.control_runs import Measured

Array = NDArray[np.float64]
Places = tuple[Sequence[Knot], Array]

PLACES = 5
OSCILLATING = 2.0


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def run_table(results: Mapping[str, tuple[Measured, Measured]]) -> str:
    """What was measured of each controller, on the robot as declared and the worst over the others."""
    heads = ["controller", "robot", "rms", "peak", "settling", "swing left", "tension", "effort"]
    has_angles = any(found.angle > 0.0 for pair in results.values() for found in pair)
    heads += ["peak angle"] * has_angles
    rows = []
    for name, pair in results.items():
        for robot, found in zip(("declared", "worst of range"), pair, strict=True):
            angle = [f"{length(found.angle)} mrad"] * has_angles
            rows.append([name if robot == "declared" else "", robot, *_cells(found), *angle])
    return table(heads, rows)


def _cells(found: Measured) -> list[str]:
    lengths = [f"{length(value)} mm" for value in (found.rms, found.peak)]
    settling = "never" if np.isinf(found.settling) else f"{found.settling:.2f} s"
    tensions = f"{found.lowest:.0f} ... {found.highest:.0f} N"
    return [*lengths, settling, f"{length(found.swing)} mm", tensions, f"{found.effort:.2f} m/s²"]


def length(metres: float) -> str:
    """In mm, or of an angle in mrad, to two digits or to a micrometre."""
    if metres < 1e-6:
        return "<0.001"
    return f"{round(1e3 * metres, 3):.2g}" if metres < 1e-2 else f"{1e3 * metres:.1f}"


def margin_table(robot: Robot, path: Trajectory, feedback: Mapping[str, Design]) -> str:
    """Margins of each design: on the robot as declared, over the range, over the range along the path."""
    heads = ["controller", "robot", "all winches at once", "one winch", "one sensor", "least damping of a swing"]
    rows = []
    for name, design in feedback.items():
        for label, places, uncertain in cases(robot, path, design):
            margins = margins_over(robot, *places, uncertain)
            rows.append([name if label == "declared" else "", label, *_margin_cells(margins)])
        rows[-3].append(f"{100.0 * damping(design, linearise(robot)):.0f} %")
        rows[-2].append("")
        rows[-1].append("")
    return table(heads, rows)


def cases(robot: Robot, path: Trajectory, design: Design) -> list[tuple[str, Places, Range | None]]:
    """Where margins are looked at: knots with their positions, and which robots."""
    knots = design.knots()
    start = (knots[:1], np.array([robot.platform.start]))
    if isinstance(design, ScheduledController):
        along = (knots, path.position(np.array(design.times)))
    else:
        along = (knots * PLACES, path.position(np.linspace(0.0, path.duration, PLACES)))
    return [("declared", start, None), ("range", start, Range()), ("range, along the path", along, Range())]


def _margin_cells(found: Margins) -> list[str]:
    if found.spectral_radius >= 1.0:
        return ["unstable"] * 3
    return [
        f"{_decibel(found.disk_gain)} dB, {found.disk_phase:.0f}°",
        f"{_decibel(found.gain_margin)} dB, {found.phase_margin:.0f}°",
        f"disk {found.sensor_disk:.2f}",
    ]


def _decibel(factor: float) -> str:
    return f"{20.0 * np.log10(factor):.1f}"


def damping(design: Design, linear: LinearPlant) -> float:
    """Least damping ratio of the closed loop's poles around the modes."""
    loop = control.feedback(ramp_plant(linear, design.aim.period), speed_controller(design.knots()[0].regulator), 1)
    frequencies, ratios, _ = control.damp(loop, doprint=False)
    highest = 2.0 * np.pi * float(linear.modes.frequencies[-1])
    near = (frequencies < OSCILLATING * highest) & (frequencies > highest / OSCILLATING**2)
    return float(np.min(ratios[near]))
