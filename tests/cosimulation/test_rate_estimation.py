"""Rates that nobody shows."""

import numpy as np
import pytest

from tautwire.cosimulation.extrapolation import DerivativeEstimator, derivative_weights


@pytest.mark.parametrize("times", [[0.0, 0.1], [0.0, 0.1, 0.2], [0.0, 0.03, 0.1, 0.11, 0.3]])
def test_the_rate_of_a_polynomial_through_all_points_is_exact(times: list[float]) -> None:
    polynomial = np.polynomial.Polynomial(np.arange(1.0, len(times) + 1.0))
    assert derivative_weights(times) @ polynomial(np.array(times)) == pytest.approx(
        polynomial.deriv()(times[-1]), rel=1e-12
    )


def test_a_constant_has_none() -> None:
    assert np.sum(derivative_weights([0.0, 0.1, 0.25, 0.3])) == pytest.approx(0.0, abs=1e-13)


def filled(step: float, points: int) -> tuple[float, float]:
    """Error and doubt of the rate of a sine, from ``points`` values before the present one."""
    rates = DerivativeEstimator(np.array([1]), np.array([2]))
    times = 1.0 + step * np.arange(-points, 1)
    rates.begin_step([(t, np.array([0.0, np.sin(3.0 * t), 0.0])) for t in times[:-1]], times[-1])
    shown = np.array([5.0, np.sin(3.0), 0.0])
    rates.fill(shown)
    assert shown[:2].tolist() == [5.0, np.sin(3.0)]
    return abs(shown[2] - 3.0 * np.cos(3.0)), float(rates.error_estimates(shown)[0])


@pytest.mark.parametrize("points", [1, 2, 3, 4])
def test_the_error_shrinks_with_one_order_a_point(points: int) -> None:
    coarse, fine = filled(0.02, points)[0], filled(0.01, points)[0]
    assert coarse / fine == pytest.approx(2.0**points, rel=0.2)


@pytest.mark.parametrize("points", [2, 3, 4])
def test_the_doubt_bounds_the_error_and_is_about_that_of_one_point_fewer(points: int) -> None:
    error, doubt = filled(0.02, points)
    assert error < doubt < 2.0 * filled(0.02, points - 1)[0]


def test_with_one_point_there_is_no_other_estimate() -> None:
    assert filled(0.02, 1)[1] == 0.0
