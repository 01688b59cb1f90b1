"""Cables that touch each other or the platform."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from tautwire.robot.cable_interference import cables_interfere, platform_interferes, segment_distance
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.rigid_robots import cable, octahedral_robot, suspended_robot

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
RADIUS = float(np.sqrt(1.2e-5 / np.pi))


@pytest.mark.parametrize("seed", range(8))
def test_the_distance_of_segments_is_the_least_over_both_parameters(seed: int) -> None:
    start, end, other_start, other_end = np.random.default_rng(seed).uniform(-1.0, 1.0, (4, 3))

    def squared(shares: np.ndarray) -> float:
        between = start + shares[0] * (end - start) - other_start - shares[1] * (other_end - other_start)
        return float(between @ between)

    least = minimize(squared, (0.5, 0.5), bounds=((0.0, 1.0), (0.0, 1.0)), options={"ftol": 1e-15}).fun
    assert segment_distance(start, end, other_start, other_end) == pytest.approx(np.sqrt(least), abs=1e-6)


def test_parallel_segments_are_as_far_apart_as_their_lines() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.3, 0.4], [5.0, 0.3, 0.4]])
    assert segment_distance(*corners) == pytest.approx(0.5)


def crossing(gap: float) -> Robot:
    """Two of four cables cross above the platform, with a gap between their axes in m."""
    robot = suspended_robot(4)
    ends = (
        ((3.0, 0.0, 5.0), (-0.4, 0.0, 0.2)),
        ((-3.0, gap, 5.0), (0.4, gap, 0.2)),
        ((0.0, 3.0, 5.0), (0.0, 0.4, 0.2)),
        ((0.0, -3.0, 5.0), (0.0, -0.4, 0.2)),
    )
    return replace(robot, cables=tuple(cable(*pair) for pair in ends))


def test_cables_interfere_where_they_are_nearer_than_their_radii() -> None:
    position = np.array([0.0, 0.0, 1.5])
    assert cables_interfere(crossing(1.9 * RADIUS), position, UPRIGHT)
    assert not cables_interfere(crossing(2.1 * RADIUS), position, UPRIGHT)


def test_cables_that_share_an_exit_point_or_an_attachment_do_not_interfere() -> None:
    assert not cables_interfere(octahedral_robot(), np.array([0.0, 0.0, 1.5]), UPRIGHT)


def boxed(far_side: bool) -> Robot:
    """A platform with attachments at the corners of a box; cables run outwards, or from the far side through it."""
    robot = suspended_robot(4)
    side = -1.0 if far_side else 1.0
    corners = [(x, y, z) for x in (-0.4, 0.4) for y in (-0.4, 0.4) for z in (-0.1, 0.1)]
    cables = tuple(cable((10.0 * side * x, 10.0 * side * y, 3.0 + z), (x, y, z)) for x, y, z in corners)
    return replace(robot, cables=cables)


def test_a_cable_from_the_far_side_runs_through_the_platform() -> None:
    position = np.array([0.0, 0.0, 2.9])
    assert platform_interferes(boxed(far_side=True), position, UPRIGHT)
    assert not platform_interferes(boxed(far_side=False), position, UPRIGHT)


def test_a_half_turn_winds_the_cables_through_the_platform() -> None:
    position = np.array([0.0, 0.0, 2.9])
    assert platform_interferes(boxed(far_side=False), position, (0.0, 0.0, 0.0, 1.0))


def test_pulleys_move_where_cables_leave() -> None:
    robot = boxed(far_side=False).with_effect(EffectSetting("pulley", {"radius": 0.05}, tuple(range(1, 9))))
    assert not platform_interferes(robot, np.array([0.0, 0.0, 2.9]), UPRIGHT)


def test_a_flat_platform_has_no_inside() -> None:
    assert not platform_interferes(suspended_robot(4), np.array([0.0, 0.0, 6.0]), UPRIGHT)
