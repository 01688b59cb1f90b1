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
    result = cross_validate(seen, TERMS)
    assert result.storage == pytest.approx(seen.storage, rel=1e-9)
    assert result.damping == pytest.approx(seen.damping, rel=1e-9)
    assert result.total_chi_squared < 1e-9


def test_a_row_has_no_part_in_its_own_prediction() -> None:
    seen = observed(CONSTANT, FREQUENCY)
    storage = seen.storage.copy()
    storage[3] *= 1.5
    result = cross_validate(replace(seen, storage=storage), TERMS)
    assert result.storage[3] == pytest.approx(131e9, rel=1e-9)
    assert result.storage[4] > 132e9
    assert result.chi_squared[3] == pytest.approx((0.5 * 131e9 / seen.storage_uncertainty[3]) ** 2, rel=1e-6)


def test_the_ends_are_extrapolated_and_count_apart() -> None:
    relaxing = Material(100e9, 0.3e9, (MaxwellBranch(30e9, 0.5),))
    result = cross_validate(observed(relaxing, FREQUENCY), TERMS)
    assert list(result.is_interpolated) == [False, *[True] * 6, False]
    assert result.interpolated_chi_squared == pytest.approx(
        result.total_chi_squared - result.chi_squared[0] - result.chi_squared[-1]
    )


def test_long_tables_are_left_out_in_parts() -> None:
    seen = observed(CONSTANT, np.geomspace(0.1, 20.0, 30))
    result = cross_validate(seen, TERMS)
    assert len(result.fits) == MAX_FOLDS
    assert sorted(row for rows in result.held_out_rows for row in rows) == list(range(30))
    assert np.all(np.isfinite(result.storage))
