"""Predictions of rows that a fit has not seen."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.materials.leave_out import MOST_PARTS, leave_out
from tautwire.materials.modulus import Branch, Material
from tautwire.materials.terms import Terms
from tests.materials import CONSTANT, observed

FREQUENCY = np.geomspace(0.1, 20.0, 8)
TERMS = Terms(damping=True)


def test_a_right_model_predicts_exact_rows() -> None:
    seen = observed(CONSTANT, FREQUENCY)
    found = leave_out(seen, TERMS)
    assert found.storage == pytest.approx(seen.storage, rel=1e-9)
    assert found.damping == pytest.approx(seen.damping, rel=1e-9)
    assert found.total < 1e-9


def test_a_row_has_no_part_in_its_own_prediction() -> None:
    seen = observed(CONSTANT, FREQUENCY)
    storage = seen.storage.copy()
    storage[3] *= 1.5
    found = leave_out(replace(seen, storage=storage), TERMS)
    assert found.storage[3] == pytest.approx(131e9, rel=1e-9)
    assert found.storage[4] > 132e9
    assert found.chi_squared[3] == pytest.approx((0.5 * 131e9 / seen.storage_uncertainty[3]) ** 2, rel=1e-6)


def test_the_ends_are_extrapolated_and_count_apart() -> None:
    relaxing = Material(100e9, 0.3e9, (Branch(30e9, 0.5),))
    found = leave_out(observed(relaxing, FREQUENCY), TERMS)
    assert list(found.inside) == [False, *[True] * 6, False]
    assert found.total_inside == pytest.approx(found.total - found.chi_squared[0] - found.chi_squared[-1])


def test_long_tables_are_left_out_in_parts() -> None:
    seen = observed(CONSTANT, np.geomspace(0.1, 20.0, 30))
    found = leave_out(seen, TERMS)
    assert len(found.rest) == MOST_PARTS
    assert sorted(row for rows in found.rows for row in rows) == list(range(30))
    assert np.all(np.isfinite(found.storage))
