"""A few rows in the place of all: the same cost, gradient and curvature."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from tautwire.estimation.estimation_data import DataSet
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.normal_equations import NothingToGainError, StoppingRule, compressed_residuals
from tautwire.robot.schema import EffectSetting
from tautwire.robot.symbolic_model import FreeParameter
from tests.support.recordings import recorded
from tests.support.robots import example

RECORDING = recorded("three", 1, gap=(6.0, 6.8))
VALUES = np.array([9e8, 2.0, 0.05])
ROWS = np.arange(len(RECORDING.time)) % 3 > 0


def likelihood() -> Likelihood:
    robot = example("three")
    robot = robot.with_effect(EffectSetting("damping", {"damping": 9e8}, (1, 2, 3)))
    robot = robot.with_effect(EffectSetting("payload", {"mass": 2.0}))
    robot = robot.with_effect(EffectSetting("sensor_delay", {"tension_delay": 0.05, "position_delay": 0.0}, (1, 2, 3)))
    free = [FreeParameter(0, "damping"), FreeParameter(1, "mass"), FreeParameter(2, "tension_delay")]
    return Likelihood(robot, free, estimate_noise(robot, RECORDING), 0.02)


def test_few_rows_have_the_cost_gradient_and_curvature_of_all() -> None:
    position, tension = RECORDING.position.copy(), RECORDING.tension.copy()
    position[::7, 1], tension[::5, 2] = np.nan, np.nan
    recording = replace(RECORDING, position=position, tension=tension)
    whole = likelihood()
    residuals, slopes = compressed_residuals(whole, VALUES, DataSet(recording, (0.0, 0.0, 0.0), ROWS), 0.1)
    assert residuals.shape == (4,) and slopes.shape == (4, 3)
    all_of_them = whole.innovations(recording, VALUES, 0.1)
    chosen = all_of_them.observed & ROWS[:, None]
    e, jacobian = all_of_them.values[chosen], all_of_them.sensitivities[chosen]
    assert residuals @ residuals == pytest.approx(e @ e, rel=1e-10)
    assert slopes.T @ residuals == pytest.approx(jacobian.T @ e, rel=1e-6)
    assert slopes.T @ slopes == pytest.approx(jacobian.T @ jacobian, rel=1e-8)


def test_what_is_not_finite_stays_so() -> None:
    wild = np.array([9e8, np.nan, 0.05])
    residuals, _ = compressed_residuals(likelihood(), wild, DataSet(RECORDING, (0.0, 0.0, 0.0), ROWS), 0.0)
    assert np.isnan(residuals).all()


def parabola(biased_by: float) -> tuple[Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], list[float]]:
    """Residuals that are least at two, their slope off as if at another place; and the places where they are taken."""
    visited: list[float] = []

    def evaluate(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        visited.append(float(point[0]))
        miss = 100.0 * (float(point[0]) - 2.0)
        bias = 100.0 * biased_by
        # Gradient of half the sum of squares about a place that is off, by a slope that is exact elsewhere.
        others = np.sqrt(1e4 + miss**2 - (miss + bias) ** 2) if bias else 100.0
        return np.array([miss + bias, others]), np.array([[100.0], [0.0]])

    return evaluate, visited


def minimised(rule: StoppingRule, cost_tolerance: float) -> float:
    """Where least squares end by the rule."""
    with suppress(NothingToGainError):
        least_squares(
            rule.residuals, rule.best_point, jac=rule.jacobian, x_scale="jac", ftol=cost_tolerance, max_nfev=30
        )
    return float(rule.best_point[0])


def test_least_squares_with_exact_slopes_arrive_at_the_minimum() -> None:
    evaluate, visited = parabola(0.0)
    rule = StoppingRule(evaluate, np.array([1.0]), 1e-8)
    assert minimised(rule, 1e-8) == pytest.approx(2.0, abs=1e-9)
    assert rule.cost == pytest.approx(0.5e4)
    assert len(visited) < 6


def test_least_squares_end_where_slopes_that_are_not_exact_lead_up() -> None:
    """Steps lead on past the minimum, where the slopes would have it, and each of them is rejected."""
    evaluate, visited = parabola(-0.02)
    rule = StoppingRule(evaluate, np.array([2.001]), 1e-4)
    assert minimised(rule, 1e-4) == pytest.approx(2.001)
    assert rule.cost == pytest.approx(0.5e4, rel=1e-5)
    assert len(visited) < 8


@pytest.mark.parametrize("curvature", np.linspace(15.0, 17.0, 41))
def test_least_squares_go_on_where_a_step_was_merely_too_long(curvature: float) -> None:
    """The first step overshoots, and the second may end where the cost is about what it was before."""
    costs: list[float] = []

    def evaluate(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        place = float(point[0]) - 1.0
        residuals = np.array([30.0 * (1.0 - place), 200.0 + curvature * place**2])
        costs.append(0.5 * float(residuals @ residuals))
        return residuals, np.array([[-30.0], [2.0 * curvature * place]])

    rule = StoppingRule(evaluate, np.array([1.0]), 1e-4)
    minimised(rule, 1e-4)
    least = min(
        0.5 * ((30.0 * (1.0 - t)) ** 2 + (200.0 + curvature * t**2) ** 2) for t in np.linspace(0.0, 1.0, 10_001)
    )
    assert sum(cost > costs[0] for cost in costs) >= 1
    assert rule.cost < least + 1e-4 * least


def test_a_start_without_finite_residuals_is_told() -> None:
    rule = StoppingRule(lambda point: (np.full(2, np.nan), np.zeros((2, 1))), np.array([1.0]), 1e-4)
    assert not rule.has_finite_start
