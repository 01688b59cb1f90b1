"""Redos end with the tolerance, or with a share of what the polynomials of a step miss."""

import numpy as np
import pytest

from tautwire.cosimulation.convergence import MAX_TOLERANCE_GROWTH, ConvergenceCriterion, InterpolationErrorEstimate
from tautwire.cosimulation.hermite_interpolation import DerivativeChain

STEP, TOLERANCE, SHARE = 0.1, 1e-13, 0.1
MISSED = 720.0 * STEP**6 / 46080.0


class Looks(InterpolationErrorEstimate):
    """Bends that count how often they are looked at."""

    count = 0

    def max_error(self, begun: np.ndarray, shown: np.ndarray, step: float) -> float:
        self.count += 1
        return super().max_error(begun, shown, step)


@pytest.fixture
def bends() -> Looks:
    return Looks([DerivativeChain((0, 1, 2), (3, 4, 5))], np.array([1.0, 1e9, 1e9, 1.0, 1e9, 1e9]))


def sixth_power(time: float) -> np.ndarray:
    """Value and rates at a time, and at half of it."""
    return np.array([k for at in (time, 0.5 * time) for k in (at**6, 6.0 * at**5, 30.0 * at**4)])


def criterion(bends: InterpolationErrorEstimate, share: float = SHARE) -> ConvergenceCriterion:
    return ConvergenceCriterion(bends, TOLERANCE, share)


def lacking(agreement: ConvergenceCriterion, error: float, step: float = STEP) -> bool:
    return agreement.is_unconverged(error, sixth_power(0.0), sixth_power(step), step)


def test_without_a_share_the_tolerance_decides(bends: Looks) -> None:
    agreement = criterion(bends, share=0.0)
    assert lacking(agreement, 1.1 * TOLERANCE)
    assert not lacking(agreement, 0.9 * TOLERANCE)
    assert bends.count == 0


def test_a_share_of_what_the_polynomials_miss_is_enough(bends: Looks) -> None:
    agreement = criterion(bends)
    assert lacking(agreement, 1.01 * SHARE * MISSED)
    assert not lacking(agreement, 0.99 * SHARE * MISSED)


def test_what_is_far_off_is_not_looked_at_closely(bends: Looks) -> None:
    agreement = criterion(bends)
    lacking(agreement, SHARE * MISSED)
    assert lacking(agreement, 1.01 * MAX_TOLERANCE_GROWTH * SHARE * MISSED)
    assert bends.count == 1
    assert lacking(agreement, 0.99 * MAX_TOLERANCE_GROWTH * SHARE * MISSED)
    assert bends.count == 2


def test_a_step_of_another_length_is_looked_at_closely(bends: Looks) -> None:
    agreement = criterion(bends)
    lacking(agreement, SHARE * MISSED)
    assert not lacking(agreement, 20.0 * SHARE * MISSED, step=2.0 * STEP)


def test_an_error_that_is_no_number_ends_redos(bends: Looks) -> None:
    """It is refused where outputs are recorded, with the name of the FMU."""
    assert not lacking(criterion(bends), np.nan)


def test_what_is_far_off_is_looked_at_when_no_redo_is_left(bends: Looks) -> None:
    """Else a step at rest would hold those of a motion to what itself was allowed."""
    agreement = criterion(bends)
    agreement.is_unconverged(1e-6, np.zeros(6), np.zeros(6), STEP)
    few = 0.5 * SHARE * MISSED
    assert lacking(agreement, few)
    assert not agreement.is_unconverged(few, sixth_power(0.0), sixth_power(STEP), STEP, is_last_iteration=True)
    assert not lacking(agreement, few)


def test_behind_a_kink_what_was_allowed_does_not_count(bends: Looks) -> None:
    agreement = criterion(bends)
    agreement.is_unconverged(1e-6, np.zeros(6), np.zeros(6), STEP)
    agreement.reset()
    assert not lacking(agreement, 0.5 * SHARE * MISSED)


def test_steps_that_differ_by_rounding_are_of_one_length(bends: Looks) -> None:
    agreement = criterion(bends)
    lacking(agreement, SHARE * MISSED)
    assert lacking(agreement, 1.01 * MAX_TOLERANCE_GROWTH * SHARE * MISSED, step=STEP * (1.0 + 1e-12))
    assert bends.count == 1
