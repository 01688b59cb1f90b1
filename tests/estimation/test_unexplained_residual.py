"""A trace of what is on no list: a formula that runs in the FMUs, or the frequency of what swings along."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.estimation import Trace, trace
from tautwire.fmus.packaging import build_fmus
from tautwire.reports.report_folder import trace_document
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_writer import write_robot
from tests.support.recordings import recorded
from tests.support.robots import example


def traced(effects: dict[str, Any], samples: int) -> Trace:
    fit, check = (recorded("three", seed, effects).first(samples) for seed in (3, 53))
    return trace(example("three"), fit, check, lambda what, done: None)


@pytest.mark.validate
def test_a_formula_that_is_discovered_runs_in_the_fmus(tmp_path: Path) -> None:
    found = traced({"unlisted_sideways": {"constant": 30.0}}, 201)
    assert found.verdict == "discovered"
    assert found.effects == ()
    assert found.formula is not None
    assert found.formula in found.sentence
    assert [formula.target for formula in found.robot_after.formulas] == ["force_x", "force_y"]
    assert all(c.errors_after.tension_rms < 1.2 * found.noise_floor.tension_rms for c in found.comparisons)
    assert all(c.errors_before.tension_rms > 5.0 * found.noise_floor.tension_rms for c in found.comparisons)
    assert json.loads(json.dumps(trace_document(found)))["formula"] == found.formula
    write_robot(found.robot_after, tmp_path / "robot.toml")
    fmus = build_fmus(read_robot(tmp_path / "robot.toml"), tmp_path)
    recording = found.comparisons[0].recording.first(101)
    again = cosimulate(fmus, recording.time, recording.winch_speed)
    assert np.allclose(again.position, found.comparisons[0].after.position[:101], atol=1e-9)


@pytest.mark.validate
def test_what_swings_is_not_explained_but_said() -> None:
    found = traced({"unlisted_swing": {"mass": 20.0, "length": 0.5}}, 401)
    assert found.verdict == "unexplained"
    assert found.formula is None
    assert found.robot_after == found.robot_before
    (line,) = trace_document(found)["resonance"]
    assert line["frequency_hz"] == pytest.approx(0.705, rel=0.1)
    assert line["outputs"] == ["x", "y"]
    assert line["on"] == ["fit", "check"]
    assert any(f"an oscillation at {line['frequency_hz']:.2g}" in note for note in found.notes)
