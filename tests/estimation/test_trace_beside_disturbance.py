"""Traces of recordings whose sensors have a memory: sizes decide, beside the best disturbance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.estimation import Trace, trace
from tautwire.recordings.recording import Recording
from tautwire.reports.report_folder import trace_document
from tautwire.robot.schema import Robot
from tests.support.recordings import recorded
from tests.support.robots import example

BANDWIDTH, FACTOR = 3.0, 2.0


def with_memory(recording: Recording, seed: int) -> Recording:
    """The recording with noise of a bandwidth of 3 Hz beside the white one, twice as large."""
    generator, sensors = np.random.default_rng(seed), example("three").sensors
    decay = np.exp(-2.0 * np.pi * BANDWIDTH * float(np.median(np.diff(recording.time))))

    def coloured(shape: tuple[int, ...], rms: float | None) -> NDArray[np.float64]:
        values = generator.normal(size=shape)
        for k in range(1, shape[0]):
            values[k] = decay * values[k - 1] + np.sqrt(1.0 - decay**2) * values[k]
        scaled: NDArray[np.float64] = FACTOR * (rms or 0.0) * values
        return scaled

    return replace(
        recording,
        position=recording.position + coloured(recording.position.shape, sensors.position_noise),
        tension=recording.tension + coloured(recording.tension.shape, sensors.tension_noise),
    )


def declared() -> Robot:
    """The three-cable robot, its sensors declared with all of their noise."""
    robot, total = example("three"), (1.0 + FACTOR**2) ** 0.5
    noises = {name: total * (getattr(robot.sensors, name) or 0.0) for name in ("position_noise", "tension_noise")}
    return replace(robot, sensors=replace(robot.sensors, **noises))


def traced(effects: dict[str, Any], samples: int) -> Trace:
    fit, check = (with_memory(recorded("three", seed, effects), seed).first(samples) for seed in (3, 53))
    return trace(declared(), fit, check)


@pytest.fixture(scope="module")
def of_friction() -> Trace:
    return traced({"friction": {"coefficient": 0.05}}, 401)


@pytest.mark.validate
def test_a_listed_effect_is_named_with_its_share(of_friction: Trace) -> None:
    assert of_friction.verdict == "effects", of_friction.sentence
    (effect,) = of_friction.effects
    assert effect.name == "friction"
    coefficient = effect.parameters["coefficient"]
    assert coefficient.low < 0.05 < coefficient.high
    assert effect.share is not None and effect.share > 0.9
    assert of_friction.left_share is not None and of_friction.left_share < 0.05
    assert effect.share <= 1.0 - of_friction.left_share


@pytest.mark.validate
def test_the_report_tells_what_disturbance_was_assumed(of_friction: Trace) -> None:
    document = trace_document(of_friction)
    disturbance, sensors = document["disturbance"], example("three").sensors
    assert disturbance["tension_rms"] == pytest.approx(FACTOR * (sensors.tension_noise or 0.0), rel=0.35)
    assert disturbance["position_rms"] == pytest.approx(FACTOR * (sensors.position_noise or 0.0), rel=0.35)
    assert disturbance["tension_bandwidth_hz"] == pytest.approx(BANDWIDTH, rel=0.6)
    assert document["effects"][0]["share"] == of_friction.effects[0].share
    assert document["left_share"] == of_friction.left_share
    assert any("noise is coloured" in note for note in document["notes"])


@pytest.mark.validate
def test_noise_with_a_memory_alone_lacks_nothing() -> None:
    found = traced({}, 801)
    assert found.verdict == "none", found.sentence
    assert found.effects == ()


@pytest.mark.validate
def test_a_load_that_swings_gets_no_listed_name() -> None:
    found = traced({"unlisted_swing": {"mass": 20.0, "length": 2.0}}, 801)
    assert found.verdict in ("unexplained", "discovered"), found.sentence
    assert found.effects == ()
    assert found.robot_after == found.robot_before


@pytest.mark.validate
def test_ropes_that_stiffen_are_discovered_and_not_named_after_a_modulus() -> None:
    found = traced({"unlisted_stiffening": {"quadratic": 100.0}}, 801)
    assert found.verdict == "discovered", found.sentence
    assert found.formula is not None and found.formula.startswith("stiffening: quadratic = ")
    assert float(found.formula.split()[-1]) == pytest.approx(100.0, rel=0.05)
    assert found.effects == ()
