"""Steps between samples are as short as vibrations and decays need, under way too."""

from dataclasses import replace
from math import factorial

import numpy as np
import pytest

from tautwire.model.symbolic import FreeParameter
from tautwire.tracer.filter_step import Substeps
from tautwire.tracer.likelihood import Likelihood
from tautwire.tracer.preparation.noise import noise_of
from tautwire.tracer.substeps import covers, strain_rates, substeps_for
from tests.effect_cases import same
from tests.recordings import recorded
from tests.robots import example

ROBOT, RECORDING = example("three"), recorded("three", 1)
INTERVAL = 0.02
STRANDS = ROBOT.with_effect(same("hysteresis", force=1.0, yield_strain=3e-5).setting(ROBOT))


@pytest.mark.parametrize("angle", [0.01, 0.3, 0.45, 0.65, 0.99, 2.5, 6.3])
def test_the_series_of_the_derivatives_follows_a_vibration(angle: float) -> None:
    substeps = substeps_for(np.array([1j * angle, -0.1 * angle]))
    assert abs(series(1j * angle, substeps) - np.exp(1j * angle)) < 2.5e-5 * substeps.slope
    assert angle / substeps.state <= 0.05


@pytest.mark.parametrize("decay", [0.1, 0.9, 3.0, 10.0, 50.0])
def test_a_decay_within_a_sample_takes_few_steps(decay: float) -> None:
    substeps = substeps_for(np.array([0.1j, -decay]))
    assert abs(series(-decay, substeps) - np.exp(-decay)) < 1e-3
    assert substeps.slope <= 1 + decay / 2.0
    assert 2.0 * decay <= substeps.state <= 1.0 + max(2.0 * decay, 2.0)


def series(turn: complex, substeps: Substeps) -> complex:
    part = turn / substeps.slope
    return complex(sum(part**k / factorial(k) for k in range(substeps.order + 1)) ** substeps.slope)


def test_strain_rates_are_those_of_the_tensions() -> None:
    time = 0.02 * np.arange(2001)
    stiffness = ROBOT.cables[0].modulus * ROBOT.cables[0].area
    tension = 1000.0 + stiffness * 1e-3 * np.outer(np.sin(2.0 * time), [1.0, 2.0, np.nan])
    told = replace(RECORDING, time=time, tension=tension)
    assert strain_rates(STRANDS, told) == pytest.approx([2e-3, 4e-3, 4e-3], rel=1e-3)


def test_nothing_is_quicker_under_way_where_no_effect_remembers() -> None:
    damped = ROBOT.with_effect(same("damping", damping=1e9).setting(ROBOT))
    assert np.array_equal(strain_rates(damped, RECORDING), np.zeros(3))
    assert strain_rates(STRANDS, RECORDING).all()


def test_without_tensions_nothing_is_known_of_strain_rates() -> None:
    blind = replace(RECORDING, tension=np.full_like(RECORDING.tension, np.nan))
    assert np.array_equal(strain_rates(STRANDS, blind), np.zeros(3))


def test_strands_that_yield_within_a_sample_take_shorter_steps() -> None:
    """Friction between strands is quick only under way: at the start it has no memory that it could lose."""
    noise = noise_of(ROBOT, RECORDING)
    still = Likelihood(STRANDS, (), noise, INTERVAL)
    moved = Likelihood(STRANDS, (), noise, INTERVAL, np.full(3, 0.02))
    turns = 0.02 * INTERVAL / 3e-5
    assert moved.substeps.slope > still.substeps.slope
    assert turns / moved.substeps.state < 0.6
    assert turns / moved.substeps.slope < 2.1


def test_what_was_compiled_serves_values_that_are_no_quicker() -> None:
    free = [FreeParameter(0, "force"), FreeParameter(0, "yield_strain")]
    likelihood = Likelihood(STRANDS, free, noise_of(ROBOT, RECORDING), INTERVAL, np.full(3, 0.004))
    assert likelihood.serves([1.0, 3e-5], np.full(3, 0.004))
    assert likelihood.serves([1.0, 3e-4], np.full(3, 0.004))
    assert likelihood.serves([1.0, 3e-5], np.full(3, 0.002))
    assert not likelihood.serves([1.0, 1e-5], np.full(3, 0.004))
    assert not likelihood.serves([1.0, 3e-5], np.full(3, 0.012))


def test_what_is_over_at_once_is_not_followed() -> None:
    """No step would be short enough for strands that yield a thousand times in a sample."""
    likelihood = Likelihood(STRANDS, (), noise_of(ROBOT, RECORDING), INTERVAL, np.full(3, 1.0))
    assert likelihood.substeps == Substeps(40, 10, 9)


def test_a_decay_that_has_become_quicker_asks_for_a_longer_series() -> None:
    """Of as many steps."""
    substeps = substeps_for(np.array([0.1j, -0.5]))
    assert covers(substeps, np.array([0.1j, -0.5]))
    assert not covers(substeps, np.array([0.1j, -1.8]))
    assert covers(substeps_for(np.array([0.1j, -1.8])), np.array([0.1j, -0.5]))
