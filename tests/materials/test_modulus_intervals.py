"""Intervals by profile likelihood against what is known in closed form or by counting."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.materials.modulus_fit import fit_structure
from tautwire.materials.modulus_intervals import confidence_intervals, profile_chi_squared
from tautwire.materials.viscoelastic_model import Material, MaxwellBranch, ModelStructure
from tests.support.materials import CONSTANT, observed

FREQUENCY = np.geomspace(0.1, 20.0, 8)


def test_a_linear_model_has_the_interval_of_its_standard_deviations() -> None:
    seen = observed(CONSTANT, FREQUENCY, 0.02)
    sigma_storage = 1.0 / np.sqrt(np.sum(1.0 / seen.storage_uncertainty**2))
    sigma_damping = 1.0 / np.sqrt(np.sum(1.0 / seen.damping_uncertainty**2))
    modulus, damping = confidence_intervals(fit_structure(seen, ModelStructure(damping=True)))
    assert (modulus.low, modulus.high) == pytest.approx(
        (131e9 - 1.959964 * sigma_storage, 131e9 + 1.959964 * sigma_storage), abs=1e-3 * sigma_storage
    )
    assert (damping.low, damping.high) == pytest.approx(
        (0.49e9 - 1.959964 * sigma_damping, 0.49e9 + 1.959964 * sigma_damping), abs=1e-3 * sigma_damping
    )


def test_a_model_that_leaves_more_than_noise_looks_less_sure() -> None:
    seen = observed(CONSTANT, FREQUENCY, 0.02, seed=3)
    calm = confidence_intervals(fit_structure(seen, ModelStructure(damping=True)))[0]
    loud = replace(seen, covariance=seen.covariance / 100.0)
    fit = fit_structure(loud, ModelStructure(damping=True))
    assert fit.chi_squared / fit.degrees_of_freedom > 30.0
    spread = confidence_intervals(fit)[0]
    ratio = np.sqrt(fit.chi_squared / fit.degrees_of_freedom / 100.0)
    calm_ratio = np.sqrt(max(1.0, fit.chi_squared / fit.degrees_of_freedom / 100.0))
    assert (spread.high - spread.low) * calm_ratio == pytest.approx((calm.high - calm.low) * ratio, rel=1e-3)


def test_a_side_that_only_a_bound_ends_is_open() -> None:
    damping = confidence_intervals(
        fit_structure(observed(replace(CONSTANT, damping=0.0), FREQUENCY, 0.02), ModelStructure(damping=True))
    )[1]
    assert damping.low_is_open
    assert damping.low == 0.0
    assert not damping.high_is_open


@pytest.mark.validate
def test_intervals_of_a_branch_hold_the_truth_as_often_as_they_say() -> None:
    true = Material(100e9, 0.3e9, (MaxwellBranch(30e9, 0.5),))
    terms = ModelStructure(damping=True, branches=1)
    held = np.zeros(4)
    for seed in range(30):
        fit = fit_structure(observed(true, FREQUENCY, 0.03, seed), terms)
        result = confidence_intervals(fit)
        held += [each.low <= value <= each.high for each, value in zip(result, (100e9, 0.3e9, 30e9, 0.5), strict=True)]
    assert np.all(held >= 24)


def test_holding_a_parameter_away_from_its_best_value_costs_as_much_as_its_interval_says() -> None:
    fit = fit_structure(observed(CONSTANT, FREQUENCY, 0.02, seed=5), ModelStructure(damping=True))
    assert profile_chi_squared(fit, 1, fit.values[1]) == pytest.approx(fit.chi_squared, rel=1e-6)
    high = confidence_intervals(fit)[1].high
    birge = max(1.0, fit.chi_squared / fit.degrees_of_freedom)
    assert profile_chi_squared(fit, 1, high) == pytest.approx(fit.chi_squared + 3.8415 * birge, rel=1e-3)
