"""CAROCA and FAST with platforms that turn, on the paper's helices: what the paper's point masses leave out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..linear.linear_plant import linearise
from ..robot.robot_file_reader import read_robot
from ..robot.schema import Robot
from ..robot.static_equilibrium import static_tensions
from ..robot.trajectory import Helix
from .figure_style import LINE_COLOURS, PaperFigure, label_panel, legend_above, panel_grid
from .helix_runs import SAMPLE_COUNTS, TENSION_LAWS, law_difference
from .paper_parameters import PaperParameters, with_law
from .simulation_records import Records, SimulationCase, max_abs, path_case

Array = NDArray[np.float64]

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
# Name of the paper's robot, of the shipped one with its platform, and where that starts on the helix, m.
PLATFORMS = {"caroca": ("caroca8", (1.0, 0.0, 1.0)), "fast": ("fast", (0.0, 0.0, 140.0))}
FIGURE_FLOORS = {"tension": 1e-3, "elongation": 1e-7}  # N and m
TITLES = {"caroca": "CAROCA", "fast": "FAST"}


def robot_with_platform(parameters: PaperParameters, name: str) -> Robot:
    """The shipped robot with a platform that turns, at the start of the paper's helix, undamped as in the paper.

    It has the paper's gravity, and CAROCA the paper's rope: FAST's would break under its cabin, which keeps its own.
    """
    paper_robot = parameters.robots[name]
    example, start = PLATFORMS[name]
    robot = read_robot(EXAMPLES / example / "robot.toml")
    rope = paper_robot.cables[0]
    cables = tuple(
        replace(each, damping=0.0)
        if name == "fast"
        else replace(each, modulus=rope.modulus, area=rope.area, damping=0.0)
        for each in robot.cables
    )
    return replace(robot, gravity=paper_robot.gravity, platform=replace(robot.platform, start=start), cables=cables)


def platform_path(parameters: PaperParameters, name: str) -> Helix:
    """The paper's helix, from where the robot with its platform starts."""
    path, (_, start) = parameters.helices[name], PLATFORMS[name]
    return replace(path, centre=(path.centre[0], path.centre[1], start[2]))


def cases(parameters: PaperParameters) -> Iterator[tuple[str, SimulationCase]]:
    """Runs of both laws with platforms that turn, kept level by the winches of inelastic ropes."""
    for name in PLATFORMS:
        robot, path = robot_with_platform(parameters, name), platform_path(parameters, name)
        for law in TENSION_LAWS:
            yield f"{name} platform/{law}", path_case(with_law(robot, law), path, SAMPLE_COUNTS[name])


def largest_law_difference(records: Records, robot: str, quantity: str) -> Array:
    """The laws' difference of a quantity of the cable that differs most, (N,) over time in SI units."""
    numbers = range(1, cable_count(records, robot) + 1)
    differences = [np.abs(law_difference(records, robot, f"{quantity}_{number}")) for number in numbers]
    return np.asarray(np.max(differences, axis=0))


def cable_count(records: Records, robot: str) -> int:
    """How many cables a robot's runs have."""
    return sum(name.startswith("tension_") for name in records[f"{robot}/linear"].values)


def draw_platforms(records: Records) -> PaperFigure:
    """Draw the laws' differences of tension and elongation over time, of point masses and platforms."""
    figure, axes = panel_grid(4, 2)
    for column, (name, title) in enumerate(TITLES.items()):
        for row, (quantity, factor, label) in enumerate((("tension", 1.0, "N"), ("elongation", 1e3, "mm"))):
            panel = axes[2 * row + column]
            for robot, text, line, colour in (
                (name, "point mass", "-.", LINE_COLOURS[1]),
                (f"{name} platform", "platform", "-", LINE_COLOURS[0]),
            ):
                time = records[f"{robot}/linear"].time
                difference = factor * largest_law_difference(records, robot, quantity)
                panel.semilogy(time[1:], difference[1:], line, color=colour, label=text)
            panel.set_ylim(factor * FIGURE_FLOORS[quantity], None)
            label_panel(panel, f"{quantity.capitalize()} ({label})", title)
    legend_above(figure, axes[0])
    description = (
        "Difference between the laws, of the cable that differs most: tensions and elongations of CAROCA and FAST as "
        "point masses, as in the paper, and with platforms that turn."
    )
    return PaperFigure("beyond_platforms", "Platforms that turn", description, figure)


def platforms_text(parameters: PaperParameters, records: Records) -> str:
    """The paragraph beside the figure, with the numbers of these runs."""
    sentences = [
        "The paper computes CAROCA and FAST as point masses. Here they have platforms that turn: CAROCA its eight "
        "cables, FAST its six, as the examples caroca8 and fast have them with their sources, along the same helix."
    ]
    for name, title in TITLES.items():
        point, rigid = parameters.robots[name], robot_with_platform(parameters, name)
        sentences.append(
            f"{title} has its modes at {_listed(linearise(rigid, swing=0.0).modes.frequencies, 2)} Hz "
            f"({_listed(linearise(point, swing=0.0).modes.frequencies, 2)} Hz as a point mass), start tensions of "
            f"{_range(static_tensions(rigid))} N ({_range(static_tensions(point))} N), and the laws differ by "
            f"{_gaps(records, f'{name} platform')} ({_gaps(records, name)})."
        )
    sentences.append(
        "More than six cables strain against each other, so that small differences of length between the laws become "
        "large ones of tension."
    )
    return " ".join(sentences)


def _gaps(records: Records, robot: str) -> str:
    tension, elongation = (max_abs(largest_law_difference(records, robot, each)) for each in ("tension", "elongation"))
    return f"{tension:.3g} N and {1e3 * elongation:.3g} mm at most"


def _listed(values: Array, decimals: int) -> str:
    return ", ".join(f"{value:.{decimals}f}" for value in values)


def _range(tensions: Array) -> str:
    low, high = f"{np.min(tensions):.0f}", f"{np.max(tensions):.0f}"
    return low if low == high else f"{low} to {high}"
