"""Results of functions of a robot are kept."""

from __future__ import annotations

from dataclasses import replace

from tautwire.memoisation import memoised
from tautwire.robot.schema import Robot
from tests.support.robots import example


def test_a_robot_that_is_equal_is_computed_with_once_and_one_of_lists_each_time() -> None:
    computed = []

    @memoised(max_results=2)
    def mass(robot: Robot, factor: float) -> float:
        computed.append(factor)
        return factor * robot.platform.mass

    robot = example("three")
    of_lists = replace(robot, cables=list(robot.cables))  # type: ignore[arg-type]
    for each in (robot, example("three"), of_lists, of_lists):
        assert mass(each, 2.0) == 2.0 * robot.platform.mass
    assert computed == [2.0] * 3
    assert mass(robot, 3.0) == 3.0 * robot.platform.mass
    assert mass(robot, 4.0) == 4.0 * robot.platform.mass
    assert mass(robot, 2.0) == 2.0 * robot.platform.mass and computed == [2.0] * 3 + [3.0, 4.0, 2.0]
