"""The test rig against the figures that Baklouti et al. (2017) print for their three-cable robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.rig import RampProgram, Robot, paper_robot, robot_of, simulate, with_law

RAMP = RampProgram(np.array([0.3, 0.25, -0.25]), 1.0)


@dataclass(frozen=True)
class Helix:
    """Two turns of 5 m radius from z = 5 m to 20 m in 50 s, by a fifth-order law."""

    robot: Robot
    kinks: Sequence[float] = ()

    def path(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        share = time / 50.0
        angle = np.pi * (24 * share**5 - 60 * share**4 + 40 * share**3)
        rate = np.pi * (120 * share**4 - 240 * share**3 + 120 * share**2) / 50.0
        pitch = 15.0 / (4 * np.pi)
        position = np.array([5 * np.cos(angle) + 23.86, 5 * np.sin(angle), pitch * angle + 5])
        return position, rate * np.array([-5 * np.sin(angle), 5 * np.cos(angle), pitch])

    def speed(self, time: float) -> np.ndarray:
        position, velocity = self.path(time)
        span = self.robot.anchors - position
        return (span @ velocity) / np.linalg.norm(span, axis=1)

    def travel(self, time: float) -> np.ndarray:
        start = np.linalg.norm(self.robot.anchors - self.robot.start, axis=1)
        return start - np.linalg.norm(self.robot.anchors - self.path(time)[0], axis=1)


@pytest.mark.validate
def test_elongations_of_both_laws_differ_on_the_helix_as_the_paper_says() -> None:
    robot = paper_robot(1.022e11)
    helix = Helix(robot)
    times = [27.5, 39.0]
    fed = np.array([helix.travel(time) for time in times])
    logarithmic = simulate(robot, {}, helix, times)
    linear = simulate(with_law(robot, "linear"), {}, helix, times)
    elongation = logarithmic.length - logarithmic.rig.start_length + fed
    gap = np.abs(elongation - (linear.length - linear.rig.start_length + fed))
    assert gap[1, 1] == pytest.approx(2.86e-3, abs=1e-5), "2.9 mm in the paper"
    assert gap[0, 0] / abs(elongation[0, 0]) == pytest.approx(0.120, abs=1e-3), "12 % in the paper"


def test_ramp_of_the_paper_ends_where_the_paper_says() -> None:
    run = simulate(paper_robot(), {}, RAMP, [0.0, 7.0])
    assert run.position[-1] == pytest.approx([20.305, 0.2267, 8.554], abs=5e-4)
    assert np.abs(run.position[-1] - [20.30, 0.23, 8.5]).max() < 0.06, "P3 as printed"


def test_ramp_on_nearly_rigid_ropes_ends_at_the_geometric_point() -> None:
    robot = replace(paper_robot(1e15), damping=np.full(3, 3e13))
    run = simulate(robot, {}, RAMP, [0.0, 7.0], method="Radau", rtol=1e-8)
    assert run.position[-1] == pytest.approx([20.28, 0.227, 8.56], abs=0.005)


def test_ramp_of_the_small_robot_ends_where_the_paper_says() -> None:
    robot = robot_of([[3.5, -2, 3.5], [0, 2, 3.5], [-3.5, -2, 3.5]], [1, 0, 0.1], 100.0, 1.301e11)
    run = simulate(robot, {}, RampProgram(np.full(3, 0.2), 0.5), [0.0, 4.0])
    assert run.position[-1] == pytest.approx([0.742, -0.432, 2.609], abs=0.012)
