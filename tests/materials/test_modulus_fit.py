"""Fits against tables whose material is known, and against what must hold of any fit."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.stats import chi2

from tautwire.materials.material_table import PAPER_TABLE, read_material_table
from tautwire.materials.modulus_fit import (
    MIN_RELATIVE_MODULUS,
    LeastSquaresProblem,
    fit_structure,
    relaxation_floor,
    whitened_residuals,
)
from tautwire.materials.modulus_observations import ModulusObservations, observations_from_table
from tautwire.materials.viscoelastic_model import Material, MaxwellBranch, ModelStructure
from tests.support.materials import CONSTANT, RELAXING, observed

FREQUENCY = np.geomspace(0.05, 50.0, 16)
AMPLITUDE = np.geomspace(6e-4, 1e-4, 16)
TABLE = read_material_table(PAPER_TABLE)
SEEN = observations_from_table(TABLE, TABLE.modulus_pairs()[0])

KNOWN = [
    (ModelStructure(damping=True), CONSTANT),
    (ModelStructure(damping=True, branches=1), Material(100e9, 0.3e9, (MaxwellBranch(30e9, 0.5),))),
    (ModelStructure(damping=True, branches=2), RELAXING),
    (ModelStructure(damping=True, hysteresis="modulus"), Material(100e9, 0.3e9, loss_modulus=8e9)),
    (
        ModelStructure(damping=True, branches=1, hysteresis="stress"),
        Material(90e9, 0.1e9, (MaxwellBranch(20e9, 0.4),), friction_stress=5e6),
    ),
    (
        ModelStructure(branches=1, hysteresis="modulus", delay=True),
        Material(90e9, 0.0, (MaxwellBranch(20e9, 0.4),), 6e9, delay=1e-3),
    ),
    (ModelStructure(damping=True, delay=True), Material(100e9, 0.2e9, delay=-8e-4)),
]


@pytest.mark.parametrize(("terms", "material"), KNOWN, ids=[terms.label for terms, _ in KNOWN])
def test_exact_rows_give_their_material_back(terms: ModelStructure, material: Material) -> None:
    fit = fit_structure(observed(material, FREQUENCY, amplitude=AMPLITUDE), terms)
    assert fit.chi_squared < 1e-8
    found, true = fit.material, material
    assert (found.modulus, found.damping) == pytest.approx((true.modulus, true.damping), rel=1e-4, abs=1e3)
    assert (found.loss_modulus, found.friction_stress) == pytest.approx(
        (true.loss_modulus, true.friction_stress), rel=1e-4, abs=1e3
    )
    assert found.delay == pytest.approx(true.delay, rel=1e-4, abs=1e-8)
    assert np.ravel(found.branches) == pytest.approx(np.ravel(true.branches), rel=1e-4)


def test_noisy_rows_give_their_branches_back_within_errors() -> None:
    lefts = []
    for seed in range(12):
        fit = fit_structure(observed(RELAXING, FREQUENCY, 0.01, seed), ModelStructure(damping=True, branches=2))
        lefts.append(fit.chi_squared)
        assert fit.material.modulus == pytest.approx(RELAXING.modulus, rel=0.03)
        assert np.ravel(fit.material.branches) == pytest.approx(np.ravel(RELAXING.branches), rel=0.25)
    freedom = 12 * (32 - 6)
    assert chi2.ppf(0.001, freedom) < sum(lefts) < chi2.ppf(0.999, freedom)


def test_slopes_are_the_derivatives_of_the_residual() -> None:
    for terms, _ in KNOWN:
        problem = LeastSquaresProblem(SEEN.with_static_rows(TABLE), terms)
        scaled = np.full(len(terms.parameters), 0.3)
        differences = approx_fprime(scaled, problem.residual, 1e-7)
        assert problem.jacobian(scaled) == pytest.approx(differences, rel=1e-4, abs=1e-4)


def test_residuals_of_a_material_are_those_of_its_fit() -> None:
    for terms, _ in KNOWN:
        fit = fit_structure(SEEN, terms)
        assert np.sum(whitened_residuals(SEEN, fit.material) ** 2) == pytest.approx(fit.chi_squared, rel=1e-6)


def test_units_and_scale_undo_each_other() -> None:
    for terms, _ in KNOWN:
        problem = LeastSquaresProblem(SEEN, terms)
        scaled = np.linspace(0.1, 0.9, len(terms.parameters))
        assert problem.to_scaled(problem.to_si(scaled)) == pytest.approx(scaled)


def test_no_branches_beat_the_floor_and_a_few_reach_it() -> None:
    floor = relaxation_floor(SEEN)
    lefts = [fit_structure(SEEN, ModelStructure(damping=True, branches=branches)).chi_squared for branches in range(4)]
    assert lefts == sorted(lefts, reverse=True)
    assert floor <= lefts[-1] + 1e-3
    assert lefts[-1] == pytest.approx(floor, abs=0.01)


def test_moduli_stay_positive_and_something_carries_in_the_long_term() -> None:
    # Storage falls with frequency here: only branches of negative modulus would follow it.
    falling = ModulusObservations(
        FREQUENCY, np.linspace(140e9, 100e9, 16), np.full(16, 2e9), np.diag(np.full(32, 1e18)), np.full(16, np.inf)
    )
    fit = fit_structure(falling, ModelStructure(damping=True, branches=2))
    assert all(branch.modulus >= 0.0 for branch in fit.material.branches)
    assert fit.material.modulus >= 0.99 * MIN_RELATIVE_MODULUS * 100e9


def test_a_static_row_pulls_the_long_term_modulus() -> None:
    terms = ModelStructure(damping=True, branches=1)
    free, held = fit_structure(SEEN, terms), fit_structure(SEEN.with_static_rows(TABLE), terms)
    assert abs(held.material.modulus - 102.2e9) < min(2.2e9, abs(free.material.modulus - 102.2e9))
    assert held.degrees_of_freedom == free.degrees_of_freedom + 1
