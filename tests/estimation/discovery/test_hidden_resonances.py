"""Hidden degrees of freedom are told with frequency and place; what moves with the motion is none."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tautwire.estimation.discovery.hidden_resonances import find_resonances
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.trace_result import Resonance
from tautwire.recordings.recording import Recording
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")


def without_outputs_after(recording: Recording, row: int) -> Recording:
    outputs = {name: getattr(recording, name).copy() for name in ("position", "tension")}
    for values in outputs.values():
        values[row:] = np.nan
    return replace(recording, **outputs)


def seen(effects: dict[str, Any]) -> tuple[Resonance, ...]:
    fit, check = recorded("three", 3, effects), recorded("three", 53, effects)
    noise = estimate_noise(ROBOT, fit)
    return find_resonances(ROBOT, Fitter(noise), split_data(ROBOT, noise, fit, check))


@pytest.mark.validate
@pytest.mark.parametrize(("mass", "length"), [(20.0, 2.0), (5.0, 1.0)])
def test_a_load_that_swings(mass: float, length: float) -> None:
    (found,) = seen({"unlisted_swing": {"mass": mass, "length": length}})
    # Of a string from a platform that is held: the platform's own modes are far above.
    assert found.frequency == pytest.approx(np.sqrt(ROBOT.gravity / length) / (2.0 * np.pi), rel=0.06)
    assert set(found.outputs) <= {"x", "y"}
    assert found.on == ("fit", "check")
    assert "an oscillation at" in found.sentence


@pytest.mark.validate(but=["nothing"])
@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"unlisted_sideways": {"constant": 30.0}},
        {"unlisted_bungee": {"stiffness_constant": 10.0, "point": [30.0, -2.0, 1.0], "rest": 3.0}},
        {"damping": {"damping": 9e8}},
    ],
    ids=["nothing", "sideways", "bungee", "damping"],
)
def test_nothing_swings_where_nothing_does(effects: dict[str, Any]) -> None:
    assert seen(effects) == ()


@pytest.mark.validate
def test_sensors_that_fall_silent_for_good_are_no_matter() -> None:
    effects = {"unlisted_swing": {"mass": 20.0, "length": 2.0}}
    noise = estimate_noise(ROBOT, recorded("three", 3, effects))
    pair = [without_outputs_after(recorded("three", seed, effects), 400) for seed in (3, 53)]
    (found,) = find_resonances(ROBOT, Fitter(noise), split_data(ROBOT, noise, *pair))
    # Over the half that is left it swings less than three times.
    assert found.frequency == pytest.approx(np.sqrt(ROBOT.gravity / 2.0) / (2.0 * np.pi), rel=0.1)
    assert set(found.outputs) == {"x", "y"}
    assert found.on == ("fit", "check")


@pytest.mark.validate
def test_without_check_a_resonance_is_seen_in_fit_alone() -> None:
    fit = recorded("three", 3, {"unlisted_swing": {"mass": 20.0, "length": 0.5}})
    noise = estimate_noise(ROBOT, fit)
    (resonance,) = find_resonances(ROBOT, Fitter(noise), split_data(ROBOT, noise, fit, None))
    assert resonance.frequency == pytest.approx(0.705, rel=0.1)
    assert resonance.on == ("fit",)
