"""Redos end with the tolerance, or with a share of what the polynomials of a step miss."""

import numpy as np
import pytest

from tautwire.cosimulation.convergence import MAX_TOLERANCE_GROWTH, ConvergenceCriterion, InterpolationErrorEstimate
from tautwire.cosimulation.hermite_interpolation import DerivativeChain

STEP, TOLERANCE, SHARE = 0.1, 1e-13, 0.1
MISSED = 720.0 * STEP**6 / 46080.0


class CountedEstimate(InterpolationErrorEstimate):
    """An estimate that counts how often it is asked for."""

    count = 0

    def max_error(self, outputs_at_start: np.ndarray, outputs: np.ndarray, step: float) -> float:
        self.count += 1
        return super().max_error(outputs_at_start, outputs, step)


@pytest.fixture
def estimate() -> CountedEstimate:
    return CountedEstimate([DerivativeChain((0, 1, 2), (3, 4, 5))], np.array([1.0, 1e9, 1e9, 1.0, 1e9, 1e9]))


def sixth_power(time: float) -> np.ndarray:
    """Value and rates at a time, and at half of it."""
    return np.array([k for at in (time, 0.5 * time) for k in (at**6, 6.0 * at**5, 30.0 * at**4)])


def criterion(estimate: InterpolationErrorEstimate, share: float = SHARE) -> ConvergenceCriterion:
    return ConvergenceCriterion(estimate, TOLERANCE, share)


def is_unconverged(convergence: ConvergenceCriterion, error: float, step: float = STEP) -> bool:
    return convergence.is_unconverged(error, sixth_power(0.0), sixth_power(step), step)


def test_without_a_share_the_tolerance_decides(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate, share=0.0)
    assert is_unconverged(convergence, 1.1 * TOLERANCE)
    assert not is_unconverged(convergence, 0.9 * TOLERANCE)
    assert estimate.count == 0


def test_a_share_of_what_the_polynomials_miss_is_enough(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    assert is_unconverged(convergence, 1.01 * SHARE * MISSED)
    assert not is_unconverged(convergence, 0.99 * SHARE * MISSED)


def test_what_is_far_off_is_not_evaluated(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    is_unconverged(convergence, SHARE * MISSED)
    assert is_unconverged(convergence, 1.01 * MAX_TOLERANCE_GROWTH * SHARE * MISSED)
    assert estimate.count == 1
    assert is_unconverged(convergence, 0.99 * MAX_TOLERANCE_GROWTH * SHARE * MISSED)
    assert estimate.count == 2


def test_a_step_of_another_size_is_evaluated(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    is_unconverged(convergence, SHARE * MISSED)
    assert not is_unconverged(convergence, 20.0 * SHARE * MISSED, step=2.0 * STEP)


def test_an_error_that_is_no_number_ends_the_iteration(estimate: CountedEstimate) -> None:
    """It is refused where outputs are recorded, with the name of the FMU."""
    assert not is_unconverged(criterion(estimate), np.nan)


def test_what_is_far_off_is_evaluated_in_the_last_iteration(estimate: CountedEstimate) -> None:
    """Else a step at rest would hold those of a motion to what itself was allowed."""
    convergence = criterion(estimate)
    convergence.is_unconverged(1e-6, np.zeros(6), np.zeros(6), STEP)
    few = 0.5 * SHARE * MISSED
    assert is_unconverged(convergence, few)
    assert not convergence.is_unconverged(few, sixth_power(0.0), sixth_power(STEP), STEP, is_last_iteration=True)
    assert not is_unconverged(convergence, few)


def test_behind_an_event_the_allowed_error_is_reset(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    convergence.is_unconverged(1e-6, np.zeros(6), np.zeros(6), STEP)
    convergence.reset()
    assert not is_unconverged(convergence, 0.5 * SHARE * MISSED)


def test_steps_that_differ_by_rounding_are_of_one_length(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    is_unconverged(convergence, SHARE * MISSED)
    assert is_unconverged(convergence, 1.01 * MAX_TOLERANCE_GROWTH * SHARE * MISSED, step=STEP * (1.0 + 1e-12))
    assert estimate.count == 1
