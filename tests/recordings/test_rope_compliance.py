"""The stiffness of the ropes is told by tensions and winch travel, within a few percent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.rope_compliance import RopeCompliance, is_other_rope, rope_compliance
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


@pytest.mark.parametrize("name", ["cogiro", "ipanema"])
def test_what_pulleys_do_to_lengths_is_no_stretch(name: str) -> None:
    robot, recording = shipped(name)
    span = np.array(robot.anchors) - recording.position[:, None]
    on_the_pulley = 0.2 * np.arctan2(np.hypot(span[..., 0], span[..., 1]), span[..., 2])
    speeds = recording.winch_speed + np.gradient(on_the_pulley, recording.time, axis=0)
    before, after = (rope_compliance(robot, each) for each in (recording, recording.with_winch_speed(speeds)))
    assert before is not None and after is not None
    assert after.explained_share < 0.2 < 0.7 < before.explained_share


@pytest.mark.parametrize(("explained_share", "is_told"), [(0.2, False), (0.7, True)])
def test_ropes_are_others_only_where_their_stretch_explains_what_lengths_miss(
    explained_share: float, is_told: bool
) -> None:
    assert is_other_rope(shipped("three")[0], RopeCompliance(5.0, 0.1, explained_share)) is is_told
