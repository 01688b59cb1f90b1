"""Recordings that have not enough to show what is there: the answer is none, and what would have been visible."""

from dataclasses import replace
from math import inf, isfinite
from typing import Any

import numpy as np
import pytest

from tautwire.estimation import Trace, trace
from tautwire.recordings.recording import Recording
from tautwire.reports.trace_texts import detectable_texts, undetectable_effects
from tests.rig import StillProgram, load_robot, make_recording
from tests.support.recordings import recorded
from tests.support.robots import EXAMPLES, example

pytestmark = pytest.mark.validate


def without_tensions(recording: Recording) -> Recording:
    return replace(recording, tension=np.full_like(recording.tension, np.nan))


def standing(seed: int, hidden: dict[str, Any]) -> Recording:
    """Positions while all winches stand."""
    robot = load_robot(EXAMPLES / "three" / "robot.toml")
    frame = make_recording(robot, hidden, StillProgram(3), duration=16.0, rate=50.0, seed=seed)
    speed, position = (frame[names].to_numpy() for names in ([f"winch_speed_{i}" for i in (1, 2, 3)], list("xyz")))
    return Recording(f"still-{seed}.csv", frame["time"].to_numpy(), speed, np.full_like(speed, np.nan), position)


def traced(fit: Recording, check: Recording) -> Trace:
    return trace(example("three"), fit, check, lambda what, done: None)


def test_below_what_positions_show_nothing_is_visible_and_sizes_are_told() -> None:
    hidden = {"payload": {"mass": 0.03}, "drum": {"radius_ratio": 1.000003}}
    found = traced(*(without_tensions(recorded("three", seed, hidden)) for seed in (3, 53)))
    assert found.verdict == "none"
    assert "visible" in found.sentence
    sizes = {(d.name, d.parameter): d.size for d in found.identifiability.detectable}
    assert 0.03 < sizes["payload", "mass"] < 3.0
    assert 3e-6 < sizes["drum", "radius_ratio"] < 3e-4
    assert any(text.startswith("payload: mass ") for text in detectable_texts(found))


def test_standing_winches_show_no_drum_and_no_payload() -> None:
    hidden = {"payload": {"mass": 5.0}}
    found = traced(standing(1, hidden), standing(2, hidden))
    assert found.verdict == "none"
    assert "drum" in undetectable_effects(found)
    assert max(d.size for d in found.identifiability.detectable if d.name == "friction") == inf
    assert isfinite(min(d.size for d in found.identifiability.detectable if d.name == "thermal"))
