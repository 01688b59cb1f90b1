"""Reference paths: ends, rates, and the winch speeds that follow them."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

from tautwire.robot.schema import Cable, Platform, Robot, Sensors
from tautwire.robot.trajectory import CAROCA_HELIX, PAPER_HELIX, Helix, Line, Trajectory
from tautwire.robot.winch_speeds import ideal_winch_speeds

LINE = Line((1.0, 2.0, 3.0), (2.0, 0.0, 3.5), 4.0)
PATHS = [LINE, PAPER_HELIX, CAROCA_HELIX, Helix((1.0, 2.0, 3.0), 0.5, -2.0, -pi, 3.0)]


def paper_robot() -> Robot:
    anchors = ((0.0, 50.0, 50.0), (0.0, -50.0, 50.0), (86.6, 0.0, 50.0))
    cables = tuple(Cable(anchor, 1.022e11, 4e-6 * pi, 0.0, "logarithmic") for anchor in anchors)
    return Robot("paper", 9.8, Platform(300.0, (28.86, 0.0, 5.0)), None, Sensors(), cables)


@pytest.mark.parametrize("path", PATHS)
def test_velocity_and_acceleration_are_the_rates_of_position(path: Trajectory) -> None:
    times = np.linspace(0.02, 0.98, 60) * path.duration
    h = 1e-4 * path.duration
    velocity = (path.position(times + h) - path.position(times - h)) / (2 * h)
    acceleration = (path.velocity(times + h) - path.velocity(times - h)) / (2 * h)
    assert np.allclose(path.velocity(times), velocity, atol=1e-6 * np.abs(velocity).max())
    assert np.allclose(path.acceleration(times), acceleration, atol=1e-6 * np.abs(acceleration).max())


@pytest.mark.parametrize("path", PATHS)
def test_paths_rest_before_and_after(path: Trajectory) -> None:
    outside = np.array([-1.0, 0.0, path.duration, path.duration + 5.0])
    assert np.array_equal(path.position(outside)[0], path.position(outside)[1])
    assert np.array_equal(path.position(outside)[2], path.position(outside)[3])
    assert np.abs(path.velocity(outside)).max() == 0.0
    assert np.abs(path.acceleration(outside)).max() == 0.0


def test_line_ends_where_it_should_and_is_halfway_at_half_time() -> None:
    assert LINE.position(np.array([0.0, 2.0, 4.0])) == pytest.approx(np.array([[1, 2, 3], [1.5, 1, 3.25], [2, 0, 3.5]]))
    # The largest speed of the fifth-order law is 15/8 of the mean.
    assert LINE.velocity(np.array([2.0]))[0] == pytest.approx(np.array([1.0, -2.0, 0.5]) * 1.875 / 4.0)


def test_helices_of_the_paper_meet_its_points() -> None:
    assert PAPER_HELIX.position(np.array([0.0, 50.0])) == pytest.approx(np.array([[28.86, 0, 5], [28.86, 0, 20]]))
    ends = CAROCA_HELIX.position(np.array([0.0, 4.0]))
    assert ends[0] == pytest.approx([1.0, 0.0, 1.0])
    assert ends[1] == pytest.approx([cos(0.6 * pi), sin(0.6 * pi), 1.0 + 0.2 * 0.6 * pi])
    # Printed as [-0.4, 1, 1.37].
    assert ends[1] == pytest.approx([-0.4, 1.0, 1.37], abs=0.1)


def test_helix_keeps_to_its_cylinder_and_the_papers_speed() -> None:
    times = np.linspace(0.0, 50.0, 501)
    radius = np.linalg.norm(PAPER_HELIX.position(times)[:, :2] - [23.86, 0.0], axis=1)
    assert radius == pytest.approx(np.full(501, 5.0))
    fastest = np.abs(PAPER_HELIX.velocity(times)).max(axis=0)
    assert fastest[:2].min() > 2.0 and fastest.max() < 2.5  # the axis of Fig. 5b


def test_ideal_speeds_wind_up_the_change_of_length() -> None:
    robot = paper_robot()
    times = np.linspace(0.0, 50.0, 5001)
    speeds = ideal_winch_speeds(robot, PAPER_HELIX, times)
    wound = np.sum(0.5 * (speeds[1:] + speeds[:-1]), axis=0) * 0.01
    ends = PAPER_HELIX.position(times[[0, -1]])
    lengths = np.linalg.norm(np.array(robot.anchors)[None] - ends[:, None], axis=2)
    assert wound == pytest.approx(lengths[0] - lengths[1], abs=1e-6)
    assert 2.0 < np.abs(speeds).max() < 2.5  # the axis of Fig. 6


def test_moving_toward_an_anchor_reels_in_at_that_speed() -> None:
    robot = replace(paper_robot(), platform=Platform(300.0, (0.0, 0.0, 0.0)))
    toward = Line((0.0, 0.0, 0.0), (0.0, 5.0, 5.0), 2.0)
    speeds = ideal_winch_speeds(robot, toward, np.array([0.3, 1.0, 1.5]))
    assert speeds[:, 0] == pytest.approx(np.linalg.norm(toward.velocity(np.array([0.3, 1.0, 1.5])), axis=1))
    assert np.all(speeds[:, 0] > 0.0)
