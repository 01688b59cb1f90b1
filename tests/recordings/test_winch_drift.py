"""A rope that runs away from what its winch wound is told, and nothing else that ropes and sensors do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tautwire.recordings.recording_notes import drift_notes, recording_notes
from tautwire.recordings.winch_drift import winch_drifts
from tautwire.robot.schema import EffectSetting
from tests.support.recordings import recorded
from tests.support.robots import example


@pytest.mark.parametrize("offset", [1e-3, -2e-3])
def test_an_offset_of_a_winch_speed_is_the_rate_at_which_its_rope_runs_away(offset: float) -> None:
    robot, recording = example("three").as_modelled(), recorded("three", 1)
    shown = recording.with_winch_speed(recording.winch_speed + np.array([0.0, offset, 0.0]))
    (drift,) = winch_drifts(robot, shown)
    assert drift.cable == 2
    assert drift.rate == pytest.approx(offset, rel=0.1)
    (note,) = recording_notes(robot, shown)
    assert f"rope 2 {'lengthens' if offset > 0.0 else 'shortens'} steadily by" in note
    assert f"an offset of {drift.rate:.3g} m/s in winch_speed_2" in note
    assert drift_notes(robot, shown) == (note,)


@pytest.mark.parametrize("effects", [None, {"modulus": {"modulus": 6e10}}, {"drum": {"radius_ratio": 1.01}}], ids=str)
def test_without_such_an_offset_no_rope_drifts(effects: dict[str, Any] | None) -> None:
    assert winch_drifts(example("three").as_modelled(), recorded("three", 1, effects)) == ()


def test_a_recorded_rope_length_has_no_speed_that_is_off() -> None:
    robot, recording = example("three").as_modelled(), recorded("three", 1)
    shown = recording.with_winch_speed(recording.winch_speed + np.array([0.0, 2e-3, 0.0]))
    lengths = np.full_like(recording.winch_speed, np.nan)
    lengths[:, 1] = -shown.wound_lengths()[:, 1]
    assert winch_drifts(robot, replace(shown, rope_length=lengths)) == ()


def test_a_few_positions_far_off_hide_no_drift() -> None:
    robot, recording = example("three").as_modelled(), recorded("three", 1)
    position = recording.position.copy()
    position[::50] += 3.0
    shown = replace(recording, position=position).with_winch_speed(recording.winch_speed + np.array([2e-3, 0.0, 0.0]))
    assert [drift.cable for drift in winch_drifts(robot, shown)] == [1]


def test_drifts_are_not_told_of_robots_that_declare_what_moves_their_readings() -> None:
    robot, recording = example("three").as_modelled(), recorded("three", 1)
    shown = recording.with_winch_speed(recording.winch_speed + np.array([0.0, 2e-3, 0.0]))
    declared = replace(robot, effects=(EffectSetting("sensor_offset", {"position_offset_x": 0.01}),))
    assert drift_notes(declared, shown) == ()


def test_what_was_not_measured_has_no_drift() -> None:
    recording = recorded("three", 1)
    unmeasured = replace(recording, position=np.full_like(recording.position, np.nan))
    assert winch_drifts(example("three").as_modelled(), unmeasured) == ()
