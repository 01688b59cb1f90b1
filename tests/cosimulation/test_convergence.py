"""The iteration ends below the convergence tolerance, or below a share of the interpolation error."""

import numpy as np
import pytest

from tautwire.cosimulation.convergence import MAX_TOLERANCE_GROWTH, ConvergenceCriterion, InterpolationErrorEstimate
from tautwire.cosimulation.hermite_interpolation import DerivativeChain

STEP, TOLERANCE, SHARE = 0.1, 1e-13, 0.1
INTERPOLATION_ERROR = 720.0 * STEP**6 / 46080.0


class CountedEstimate(InterpolationErrorEstimate):
    """An estimate that counts its evaluations."""

    count = 0

    def max_error(self, outputs_at_start: np.ndarray, outputs: np.ndarray, step: float) -> float:
        self.count += 1
        return super().max_error(outputs_at_start, outputs, step)


@pytest.fixture
def estimate() -> CountedEstimate:
    return CountedEstimate([DerivativeChain((0, 1, 2), (3, 4, 5))], np.array([1.0, 1e9, 1e9, 1.0, 1e9, 1e9]))


def sixth_power(time: float) -> np.ndarray:
    """Value and derivatives at a time and at half of it."""
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


def test_a_share_of_the_interpolation_error_is_enough(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    assert is_unconverged(convergence, 1.01 * SHARE * INTERPOLATION_ERROR)
    assert not is_unconverged(convergence, 0.99 * SHARE * INTERPOLATION_ERROR)


def test_the_interpolation_error_is_not_evaluated_far_from_convergence(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    is_unconverged(convergence, SHARE * INTERPOLATION_ERROR)
    assert is_unconverged(convergence, 1.01 * MAX_TOLERANCE_GROWTH * SHARE * INTERPOLATION_ERROR)
    assert estimate.count == 1
    assert is_unconverged(convergence, 0.99 * MAX_TOLERANCE_GROWTH * SHARE * INTERPOLATION_ERROR)
    assert estimate.count == 2


def test_the_interpolation_error_is_evaluated_for_a_step_of_another_size(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    is_unconverged(convergence, SHARE * INTERPOLATION_ERROR)
    assert not is_unconverged(convergence, 20.0 * SHARE * INTERPOLATION_ERROR, step=2.0 * STEP)


def test_an_error_that_is_no_number_ends_the_iteration(estimate: CountedEstimate) -> None:
    """The recorder raises the error, with the name of the FMU."""
    assert not is_unconverged(criterion(estimate), np.nan)


def test_the_interpolation_error_is_evaluated_in_the_last_iteration(estimate: CountedEstimate) -> None:
    """Otherwise steps of a motion would have to meet the error that a step at rest was allowed."""
    convergence = criterion(estimate)
    convergence.is_unconverged(1e-6, np.zeros(6), np.zeros(6), STEP)
    small_error = 0.5 * SHARE * INTERPOLATION_ERROR
    assert is_unconverged(convergence, small_error)
    assert not convergence.is_unconverged(
        small_error, sixth_power(0.0), sixth_power(STEP), STEP, is_last_iteration=True
    )
    assert not is_unconverged(convergence, small_error)


def test_behind_an_event_the_allowed_error_is_reset(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    convergence.is_unconverged(1e-6, np.zeros(6), np.zeros(6), STEP)
    convergence.reset()
    assert not is_unconverged(convergence, 0.5 * SHARE * INTERPOLATION_ERROR)


def test_steps_that_differ_by_rounding_are_of_one_length(estimate: CountedEstimate) -> None:
    convergence = criterion(estimate)
    is_unconverged(convergence, SHARE * INTERPOLATION_ERROR)
    assert is_unconverged(
        convergence, 1.01 * MAX_TOLERANCE_GROWTH * SHARE * INTERPOLATION_ERROR, step=STEP * (1.0 + 1e-12)
    )
    assert estimate.count == 1
