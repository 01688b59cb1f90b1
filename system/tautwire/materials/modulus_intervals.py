"""Confidence intervals of 95 % for fitted parameters by profile likelihood.

The interval of a parameter holds the values at which the others, fitted anew, let chi-squared rise by less than the
95 % point of one degree of freedom, 3.84. Where the best fit leaves more than noise, the rise allowed grows in
proportion to its chi-squared over its degrees of freedom (Birge 1932), so that a poor model does not look sure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from .modulus_fit import LeastSquaresProblem, MaterialFit, minimise

CONFIDENCE_LEVEL = 0.95
INITIAL_STEP, STEP_GROWTH, MAX_STEPS = 0.02, 2.0, 40
RELATIVE_PRECISION = 1e-4


@dataclass(frozen=True)
class ConfidenceInterval:
    """A confidence interval in the parameter's unit; a side is open where only the parameter's bound ends it."""

    low: float
    high: float
    low_is_open: bool
    high_is_open: bool


def confidence_intervals(fit: MaterialFit) -> tuple[ConfidenceInterval, ...]:
    """Confidence intervals (95 %) of all parameters of a fit, in the order of its values."""
    return tuple(_confidence_interval(fit, index) for index in range(len(fit.values)))


def profile_chi_squared(fit: MaterialFit, index: int, value: float) -> float:
    """Profile chi-squared: its minimum with one parameter fixed at a value, in its unit."""
    problem = LeastSquaresProblem(fit.observations, fit.structure)
    best = problem.to_scaled(np.array(fit.values))
    fixed_value = problem.to_scaled(np.where(np.arange(len(best)) == index, value, fit.values))[index]
    return minimise(problem, [best], {index: float(fixed_value)})[1]


def _confidence_interval(fit: MaterialFit, index: int) -> ConfidenceInterval:
    problem = LeastSquaresProblem(fit.observations, fit.structure)
    best = problem.to_scaled(np.array(fit.values))
    allowed_rise = float(chi2.ppf(CONFIDENCE_LEVEL, 1)) * max(1.0, fit.chi_squared / max(fit.degrees_of_freedom, 1))
    lower, upper = problem.bounds
    warm_start = best.copy()

    def excess(value: float) -> float:
        # The last solution is a warm start; starting from the best fit too avoids another local minimum.
        nonlocal warm_start
        warm_start, chi_squared = minimise(problem, [warm_start, best], {index: value})
        return chi_squared - fit.chi_squared - allowed_rise

    ends, open_sides = [], []
    for direction, bound in ((-1.0, lower[index]), (1.0, upper[index])):
        warm_start = best.copy()
        end = _find_crossing(excess, float(best[index]), direction, float(bound))
        scaled_end = best.copy()
        scaled_end[index] = bound if end is None else end
        ends.append(float(problem.to_si(scaled_end)[index]))
        open_sides.append(end is None)
    return ConfidenceInterval(ends[0], ends[1], open_sides[0], open_sides[1])


def _find_crossing(excess: Callable[[float], float], start: float, direction: float, bound: float) -> float | None:
    """Where the excess turns positive on the way from ``start`` to ``bound``; None where it does not."""
    inside, step = start, INITIAL_STEP * max(1.0, abs(start))
    for _ in range(MAX_STEPS):
        outside = inside + direction * step
        if direction * (outside - bound) >= 0.0:
            outside = bound
        if not np.isfinite(outside) or inside == outside:
            return None
        if excess(outside) > 0.0:
            return float(brentq(excess, inside, outside, xtol=RELATIVE_PRECISION * abs(outside - start)))
        inside, step = outside, step * STEP_GROWTH
    return None
