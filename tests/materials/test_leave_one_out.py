"""Predictions of rows that a fit has not seen."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.materials.model_selection import MAX_FOLDS, cross_validate
from tautwire.materials.viscoelastic_model import Material, MaxwellBranch, ModelStructure
from tests.support.materials import CONSTANT, observed

FREQUENCY = np.geomspace(0.1, 20.0, 8)
TERMS = ModelStructure(damping=True)


def test_a_right_model_predicts_exact_rows() -> None:
    seen = observed(CONSTANT, FREQUENCY)
    found = cross_validate(seen, TERMS)
    assert found.storage == pytest.approx(seen.storage, rel=1e-9)
    assert found.damping == pytest.approx(seen.damping, rel=1e-9)
    assert found.total_chi_squared < 1e-9


def test_a_row_has_no_part_in_its_own_prediction() -> None:
    seen = observed(CONSTANT, FREQUENCY)
    storage = seen.storage.copy()
    storage[3] *= 1.5
    found = cross_validate(replace(seen, storage=storage), TERMS)
    assert found.storage[3] == pytest.approx(131e9, rel=1e-9)
    assert found.storage[4] > 132e9
    assert found.chi_squared[3] == pytest.approx((0.5 * 131e9 / seen.storage_uncertainty[3]) ** 2, rel=1e-6)


def test_the_ends_are_extrapolated_and_count_apart() -> None:
    relaxing = Material(100e9, 0.3e9, (MaxwellBranch(30e9, 0.5),))
    found = cross_validate(observed(relaxing, FREQUENCY), TERMS)
    assert list(found.is_interpolated) == [False, *[True] * 6, False]
    assert found.interpolated_chi_squared == pytest.approx(
        found.total_chi_squared - found.chi_squared[0] - found.chi_squared[-1]
    )


def test_long_tables_are_left_out_in_parts() -> None:
    seen = observed(CONSTANT, np.geomspace(0.1, 20.0, 30))
    found = cross_validate(seen, TERMS)
    assert len(found.fits) == MAX_FOLDS
    assert sorted(row for rows in found.held_out_rows for row in rows) == list(range(30))
    assert np.all(np.isfinite(found.storage))
