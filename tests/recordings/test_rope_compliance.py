"""The stiffness of the ropes is told by tensions and winch travel, within a few percent."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.rope_compliance import is_other_rope, rope_compliance
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import Robot
from tests.support.robots import EXAMPLES


def shipped(name: str) -> tuple[Robot, Recording]:
    robot = read_robot(EXAMPLES / name / "robot.toml")
    return robot, read_recording(EXAMPLES / name / "fit.csv", robot.cable_count)


@pytest.mark.parametrize("name", ["three", "eight", "cogiro", "ipanema"])
@pytest.mark.parametrize("factor", [0.1, 1.0, 10.0])
def test_the_factor_on_the_modulus_is_told(name: str, factor: float) -> None:
    robot, recording = shipped(name)
    cables = tuple(replace(cable, modulus=factor * cable.modulus) for cable in robot.cables)
    compliance = rope_compliance(replace(robot, cables=cables), recording)
    assert compliance is not None and compliance.ratio == pytest.approx(factor, rel=0.05)
    assert is_other_rope(robot, compliance) == (factor != 1.0)


def test_a_modulus_that_is_declared_as_uncertain_may_be_far_off() -> None:
    robot, recording = shipped("three")
    cables = tuple(replace(cable, modulus=1e12, modulus_uncertainty=4e11) for cable in robot.cables)
    compliance = rope_compliance(replace(robot, cables=cables), recording)
    assert compliance is not None and not is_other_rope(replace(robot, cables=cables), compliance)


def test_ropes_without_load_cells_tell_nothing() -> None:
    robot, recording = shipped("three")
    assert rope_compliance(robot, replace(recording, tension=recording.tension * float("nan"))) is None
