"""CAROCA and FAST with platforms that turn, beside the paper's point masses."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.linear.linear_plant import linearise
from tautwire.paper import helix_runs
from tautwire.paper.figure_style import figure_style
from tautwire.paper.paper_parameters import PaperParameters, read_parameters
from tautwire.paper.rigid_platforms import (
    cases,
    draw_platforms,
    largest_law_difference,
    platform_path,
    platforms_text,
    robot_with_platform,
)
from tautwire.paper.simulation_records import Records, SimulationRecord, max_abs, run_case
from tautwire.robot.static_equilibrium import static_tensions


@pytest.fixture(scope="module")
def parameters() -> PaperParameters:
    return read_parameters("corrected")


@pytest.fixture(scope="module")
def records(parameters: PaperParameters) -> Records:
    chosen = [(key, case) for key, case in helix_runs.cases(parameters) if not key.startswith("three")]
    return {key: run_case(case) for key, case in (*chosen, *cases(parameters))}


@pytest.mark.parametrize(
    ("name", "frequencies", "tensions"),
    [
        ("caroca", (12.1, 15.2, 20.0, 23.9, 28.3, 36.0), (284.0, 404.0)),
        ("fast", (0.49, 0.51, 0.51, 4.5, 4.5, 7.0), (121671.0, 121671.0)),
    ],
)
def test_modes_and_tensions_are_those_of_the_page(
    parameters: PaperParameters, name: str, frequencies: tuple[float, ...], tensions: tuple[float, float]
) -> None:
    robot = robot_with_platform(parameters, name)
    assert linearise(robot).modes.frequencies == pytest.approx(np.array(frequencies), rel=0.012)
    carried = static_tensions(robot)
    assert (carried.min(), carried.max()) == pytest.approx(tensions, abs=0.5)
    assert platform_path(parameters, name).position(np.zeros(1))[0] == pytest.approx(robot.platform.start)


def test_the_cable_that_differs_most_counts() -> None:
    time = np.array([0.0, 1.0])
    linear = SimulationRecord(time, {"tension_1": np.array([1.0, 5.0]), "tension_2": np.array([2.0, 2.0])})
    logarithmic = SimulationRecord(time, {"tension_1": np.array([1.0, 4.0]), "tension_2": np.array([2.5, 2.0])})
    records = {"crane/linear": linear, "crane/logarithmic": logarithmic}
    assert largest_law_difference(records, "crane", "tension").tolist() == [0.5, 1.0]


@pytest.mark.validate
@pytest.mark.parametrize(
    ("robot", "newtons", "millimetres"),
    [("caroca", 0.22, 0.075), ("caroca platform", 30.0, 0.050), ("fast", 66.0, 15.5), ("fast platform", 168.0, 3.4)],
)
def test_the_laws_differ_as_the_page_says(records: Records, robot: str, newtons: float, millimetres: float) -> None:
    assert max_abs(largest_law_difference(records, robot, "tension")) == pytest.approx(newtons, rel=0.03)
    assert 1e3 * max_abs(largest_law_difference(records, robot, "elongation")) == pytest.approx(millimetres, rel=0.03)


@pytest.mark.validate
def test_figure_and_text_have_both(parameters: PaperParameters, records: Records) -> None:
    with figure_style():
        panels = draw_platforms(records).figure.axes
    assert [len(panel.lines) for panel in panels] == [2, 2, 2, 2]
    text = platforms_text(parameters, records)
    assert "CAROCA has its modes at 12.09," in text and "FAST has its modes at 0.49," in text
