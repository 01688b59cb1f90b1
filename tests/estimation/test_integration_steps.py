"""Steps between samples are as short as vibrations and decays need."""

from math import factorial

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.estimation.integration_steps import (
    Substeps,
    eigenvalues_at_start,
    require_followable,
    substeps_of_eigenvalues,
    substeps_of_robot,
)
from tests.support.effect_cases import same
from tests.support.robots import example


@pytest.mark.parametrize("angle", [0.01, 0.3, 0.45, 0.65, 0.99, 2.5, 6.3])
def test_the_series_of_the_derivatives_follows_a_vibration(angle: float) -> None:
    substeps = substeps_of_eigenvalues(np.array([1j * angle, -0.1 * angle]))
    assert abs(series(1j * angle, substeps) - np.exp(1j * angle)) < 2.5e-5 * substeps.slope
    assert angle / substeps.state <= 0.05


@pytest.mark.parametrize("decay", [0.1, 0.9, 3.0, 10.0, 50.0])
def test_a_decay_within_a_sample_takes_few_steps(decay: float) -> None:
    substeps = substeps_of_eigenvalues(np.array([0.1j, -decay]))
    assert abs(series(-decay, substeps) - np.exp(-decay)) < 1e-3
    assert substeps.slope <= 1 + decay / 2.0
    fewest = max(2.0 * decay, min(20.0 * decay, 40.0))
    assert fewest <= substeps.state <= fewest + 1.0


@pytest.mark.parametrize("decay", [0.1, 0.9, 3.0, 10.0, 20.0])
def test_doublings_let_a_decay_die_that_has_become_quicker(decay: float) -> None:
    """Where effects remember: steps are chosen where a fit begins, and at rest."""
    substeps = substeps_of_eigenvalues(np.array([0.3j, -0.5]), doublings=4)
    assert substeps.slope == 1
    assert abs(series(-decay, substeps) - np.exp(-decay)) < 0.06
    assert abs(series(0.3j, substeps) - np.exp(0.3j)) < 2.5e-5


def series(turn: complex, substeps: Substeps) -> complex:
    """What the filter makes of a rate that stays."""
    parts = substeps.slope * 2**substeps.doublings
    carried = sum((turn / parts) ** (k - 1) / factorial(k) for k in range(1, substeps.order + 1)) / parts
    for _ in range(substeps.doublings):
        carried = 2.0 * carried + turn * carried * carried
    return complex((1.0 + turn * carried) ** substeps.slope)


def test_effects_that_remember_have_a_reserve() -> None:
    robot = example("three")
    strands = robot.with_effect(same("hysteresis", force=1.0, yield_strain=3e-5).setting(robot))
    assert substeps_of_robot(robot, 0.02, 9, has_effect_states=False).doublings == 0
    assert substeps_of_robot(strands, 0.02, 12, has_effect_states=True).doublings > 0


def test_modes_have_those_of_an_effect() -> None:
    """A rope that relaxes within a millisecond goes on by exp(-1000 t)."""
    robot = example("three")
    relaxing = robot.with_effect(same("relaxation", modulus=1e9, time=0.001).setting(robot))
    assert np.abs(eigenvalues_at_start(robot)).max() < 100.0
    assert np.abs(eigenvalues_at_start(relaxing)).max() == pytest.approx(1000.0, rel=0.05)


def test_an_effect_far_stiffer_than_its_rope_asks_for_no_more_than_three_times_the_steps() -> None:
    robot = example("three")
    stiff = robot.with_effect(same("hysteresis", force=1e5, yield_strain=1e-7).setting(robot))
    plain, capped = (substeps_of_robot(each, 0.02, 9, has_effect_states=False) for each in (robot, stiff))
    uncapped = substeps_of_eigenvalues(eigenvalues_at_start(stiff) * 0.02)
    assert plain.state < capped.state <= 3 * plain.state + 40
    assert uncapped.state > 3 * capped.state


def test_a_time_in_ms_is_refused_before_it_fills_the_memory() -> None:
    require_followable(example("caroca"), "fit.csv", 0.1)
    with pytest.raises(RecordingError, match=r"fit\.csv: samples are 20 s apart, .* at up to .* Hz; is the time in ms"):
        require_followable(example("caroca"), "fit.csv", 20.0)
