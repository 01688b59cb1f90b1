"""A factor on all exit points or attachments is told by winch travel; a robot that is as declared has none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tautwire.recordings.anchor_scale import anchor_scale
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Robot
from tests.support.robots import EXAMPLES


def scaled(robot: Robot, key: str, factor: float) -> Robot:
    points = [tuple(factor * coordinate for coordinate in getattr(cable, key)) for cable in robot.cables]
    changes: list[dict[str, Any]] = [{key: point} for point in points]
    return replace(robot, cables=tuple(replace(c, **change) for c, change in zip(robot.cables, changes, strict=True)))


@pytest.mark.parametrize(
    ("name", "key", "factor"),
    [("eight", "anchor", 1.5), ("three", "anchor", 0.6), ("cogiro", "anchor", 2.0), ("cogiro", "attachment", 1.5)],
)
def test_a_factor_on_all_points_is_told(name: str, key: str, factor: float) -> None:
    robot = read_robot(EXAMPLES / name / "robot.toml")
    recording = read_recording(EXAMPLES / name / "fit.csv", robot.cable_count)
    scale = anchor_scale(scaled(robot, key, factor), recording)
    assert scale is not None and scale.key == key
    assert scale.factor == pytest.approx(factor, rel=0.02) and scale.misfit_left < 0.25 * scale.misfit


@pytest.mark.parametrize("name", ["three", "eight", "caroca", "cogiro", "ipanema"])
def test_a_robot_as_it_is_has_no_factor(name: str) -> None:
    robot = read_robot(EXAMPLES / name / "robot.toml")
    recording = read_recording(EXAMPLES / name / "fit.csv", robot.cable_count)
    assert anchor_scale(robot, recording) is None
    assert anchor_scale(scaled(robot, "anchor", 1.01), recording) is None
