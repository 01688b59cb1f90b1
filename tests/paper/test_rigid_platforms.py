"""CAROCA and FAST with platforms that turn; test_paper_reproduction.py looks at their runs beside point masses."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.linear.linear_plant import linearise
from tautwire.paper.paper_parameters import PaperParameters, read_parameters
from tautwire.paper.rigid_platforms import largest_law_difference, platform_path, robot_with_platform
from tautwire.paper.simulation_records import SimulationRecord
from tautwire.robot.static_equilibrium import static_tensions


@pytest.fixture(scope="module")
def parameters() -> PaperParameters:
    return read_parameters("corrected")


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
