"""First-order Sobol indices against functions of which they are known in closed form, and how often intervals hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import qmc

from tautwire.campaigns.campaign_plan import LOGNORMAL, NORMAL, TRIANGULAR, UNIFORM, Distribution
from tautwire.campaigns.polynomial_chaos import first_order_indices

Array = NDArray[np.float64]

SAMPLES, REPETITIONS = 256, 40
MIXED = (
    Distribution(NORMAL, (1.0e11, 2.0e9)),
    Distribution(UNIFORM, (280.0, 320.0)),
    Distribution(TRIANGULAR, (0.0, 1.0, 4.0)),
    Distribution(NORMAL, (5.0, 0.5)),
    Distribution(UNIFORM, (-1.0, 1.0)),
    Distribution(LOGNORMAL, (2.0, 0.2)),
)
# Standard deviations of these, and the weight of each in the linear function.
DEVIATIONS = np.array([2.0e9, 40.0 / 12**0.5, (13.0 / 18.0) ** 0.5, 0.5, 2.0 / 12**0.5, 0.4165])
WEIGHTS = np.array([4.0, 3.0, 1.0, 0.0, 0.0, 0.0])
G_COEFFICIENTS = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0])


def ishigami(values: Array) -> Array:
    first, second, third = values.T
    return np.asarray(np.sin(first) + 7.0 * np.sin(second) ** 2 + 0.1 * third**4 * np.sin(first))


def ishigami_indices() -> Array:
    first, second = 0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 49.0 / 8.0
    interaction = 0.01 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    return np.array([first, second, 0.0]) / (first + second + interaction)


def sobol_g(values: Array) -> Array:
    return np.asarray(np.prod((np.abs(4.0 * values - 2.0) + G_COEFFICIENTS) / (1.0 + G_COEFFICIENTS), axis=1))


def sobol_g_indices() -> Array:
    variances = 1.0 / (3.0 * (1.0 + G_COEFFICIENTS) ** 2)
    return np.asarray(variances / (np.prod(1.0 + variances) - 1.0))


@dataclass(frozen=True)
class Case:
    function: Callable[[Array], Array]
    distributions: tuple[Distribution, ...]
    indices: Array


CASES = {
    "linear": Case(lambda values: values @ (WEIGHTS / DEVIATIONS), MIXED, WEIGHTS**2 / np.sum(WEIGHTS**2)),
    "ishigami": Case(ishigami, (Distribution(UNIFORM, (-np.pi, np.pi)),) * 3, ishigami_indices()),
    "sobol g": Case(sobol_g, (Distribution(UNIFORM, (0.0, 1.0)),) * 6, sobol_g_indices()),
}
TOLERANCES = {"linear": 0.002, "ishigami": 0.04, "sobol g": 0.03}


def drawn(method: str, distributions: tuple[Distribution, ...], seed: int) -> Array:
    generator = np.random.default_rng(seed)
    cube = {
        "sobol": lambda count: qmc.Sobol(count, seed=generator).random(SAMPLES),
        "latin hypercube": lambda count: qmc.LatinHypercube(count, seed=generator).random(SAMPLES),
        "random": lambda count: generator.random((SAMPLES, count)),
    }[method](len(distributions))
    return np.column_stack([each.quantile(cube[:, i]) for i, each in enumerate(distributions)])


def estimates(case: Case, method: str) -> tuple[Array, Array]:
    """Errors of the indices, and half-widths of their intervals, each (repetitions, inputs)."""
    errors, widths = [], []
    for seed in range(REPETITIONS):
        values = drawn(method, case.distributions, seed)
        result = first_order_indices(case.distributions, values, case.function(values))
        errors.append(result.indices - case.indices)
        widths.append(result.half_widths)
    return np.array(errors), np.array(widths)


@pytest.mark.validate(but=["linear-random", "sobol g-sobol"])
@pytest.mark.parametrize("method", ["sobol", "random"])
@pytest.mark.parametrize("name", CASES)
def test_indices_are_those_in_closed_form_and_intervals_cover_them(name: str, method: str) -> None:
    errors, widths = estimates(CASES[name], method)
    assert np.abs(errors.mean(axis=0)).max() < 0.03
    assert np.sqrt(np.mean(errors**2, axis=0)).max() < TOLERANCES[name]
    if name != "linear":
        # 95 % nominal, over all inputs; and on average not much wider than errors need.
        assert np.mean(np.abs(errors) <= widths) >= 0.9
        assert np.mean(widths, axis=0).max() < 0.08


def test_a_linear_function_has_no_false_sensitivity() -> None:
    errors, _ = estimates(CASES["linear"], "latin hypercube")
    assert np.abs(errors[:, WEIGHTS == 0.0]).max() < 1e-12


def test_an_input_without_influence_is_rarely_told_from_zero_beside_noise() -> None:
    generator, told = np.random.default_rng(1), 0
    distributions = CASES["sobol g"].distributions
    for seed in range(REPETITIONS):
        values = drawn("random", distributions, seed)
        result = first_order_indices(distributions, values, values[:, 0] + generator.normal(0.0, 0.5, SAMPLES))
        told += int(np.sum(result.indices[1:] > result.half_widths[1:]))
    assert told / (5 * REPETITIONS) < 0.08
