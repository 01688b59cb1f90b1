"""A robot file whose z is not upwards is refused with the axis that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.errors import UnreachableError
from tautwire.robot.mistaken_vertical import COORDINATES, require_held_at_start
from tautwire.robot.schema import Robot
from tests.support.robots import example


def written_with(axis: str, robot: Robot) -> Robot:
    """The robot as a file has it in which this axis points upwards."""
    back = COORDINATES[axis][1].T
    w, *vector = robot.platform.start_orientation
    x, y, z, scalar = (Rotation.from_matrix(back) * Rotation.from_quat([*vector, w])).as_quat()
    start = tuple((back @ np.array(robot.platform.start)).tolist())
    platform = replace(robot.platform, start=start, start_orientation=(scalar, x, y, z))
    cables = tuple(replace(cable, anchor=tuple((back @ np.array(cable.anchor)).tolist())) for cable in robot.cables)
    return replace(robot, platform=platform, cables=cables)


@pytest.mark.parametrize("name", ["three", "cogiro"])
@pytest.mark.parametrize("axis", COORDINATES)
def test_the_axis_that_points_upwards_is_told_with_what_to_write(name: str, axis: str) -> None:
    with pytest.raises(UnreachableError) as refused:
        require_held_at_start(written_with(axis, example(name)))
    assert f"with {axis} upwards the cables hold it" in refused.value.hint
    assert f"write {COORDINATES[axis][0]} in place of x, y, z" in refused.value.hint


@pytest.mark.parametrize("axis", COORDINATES)
def test_what_is_to_be_written_are_the_turned_coordinates(axis: str) -> None:
    text, turn = COORDINATES[axis]
    numbers = {"x": 1.0, "y": 2.0, "z": 3.0}
    signs = [-1.0 if name.startswith("-") else 1.0 for name in text.split(", ")]
    written = [sign * numbers[name.removeprefix("-")] for sign, name in zip(signs, text.split(", "), strict=True)]
    assert (turn @ np.array([1.0, 2.0, 3.0])).tolist() == written
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_a_start_above_the_anchors_may_be_wrong_itself() -> None:
    robot = example("three")
    above = replace(robot, platform=replace(robot.platform, start=(28.86, 0.0, 60.0)))
    with pytest.raises(UnreachableError) as refused:
        require_held_at_start(above)
    assert "below and between the anchors; gravity acts along -z, and with -z upwards" in refused.value.hint


def test_a_start_that_no_vertical_explains_is_refused_as_it_is() -> None:
    robot = example("three")
    outside = replace(robot, platform=replace(robot.platform, start=(300.0, 200.0, 5.0)))
    with pytest.raises(UnreachableError) as refused:
        require_held_at_start(outside)
    assert "upwards" not in refused.value.hint


def test_no_vertical_is_told_where_two_would_do() -> None:
    robot, start = example("three"), np.array([1.0, 2.0, 3.0])
    ropes = ((5.0, -1.0, 1.0), (-1.0, 5.0, 1.0), (1.0, 1.0, -5.0))
    cables = tuple(
        replace(cable, anchor=tuple((start + rope).tolist())) for cable, rope in zip(robot.cables, ropes, strict=True)
    )
    ambiguous = replace(robot, platform=replace(robot.platform, start=tuple(start.tolist())), cables=cables)
    with pytest.raises(UnreachableError) as refused:
        require_held_at_start(ambiguous)
    assert "upwards" not in refused.value.hint


def test_what_the_cables_hold_is_not_refused() -> None:
    require_held_at_start(example("three"))
