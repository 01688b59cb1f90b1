"""95 % intervals of fitted parameters by profile likelihood.

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

from .fit import MaterialFit, Problem, solve

CONFIDENCE = 0.95
FIRST_STEP, GROWTH, STEPS = 0.02, 2.0, 40
PRECISION = 1e-4


@dataclass(frozen=True)
class Interval:
    """From ``low`` to ``high``, in the parameter's unit; a side is open where only the parameter's bound ends it."""

    low: float
    high: float
    low_is_open: bool
    high_is_open: bool


def intervals(fit: MaterialFit) -> tuple[Interval, ...]:
    """The 95 % interval of every parameter of a fit, in the order of its values."""
    return tuple(_interval(fit, index) for index in range(len(fit.values)))


def chi_squared_at(fit: MaterialFit, index: int, value: float) -> float:
    """The least chi-squared with one parameter held at a value, in its unit."""
    problem = Problem(fit.seen, fit.terms)
    best = problem.in_scale(np.array(fit.values))
    held = problem.in_scale(np.where(np.arange(len(best)) == index, value, fit.values))[index]
    return solve(problem, [best], {index: float(held)})[1]


def _interval(fit: MaterialFit, index: int) -> Interval:
    problem = Problem(fit.seen, fit.terms)
    best = problem.in_scale(np.array(fit.values))
    allowed = float(chi2.ppf(CONFIDENCE, 1)) * max(1.0, fit.chi_squared / max(fit.freedom, 1))
    lower, upper = problem.bounds
    near = best.copy()

    def excess(value: float) -> float:
        # The last solution is where the next one is near; the best one keeps it from a wrong valley.
        nonlocal near
        near, left = solve(problem, [near, best], {index: value})
        return left - fit.chi_squared - allowed

    ends, is_open = [], []
    for direction, bound in ((-1.0, lower[index]), (1.0, upper[index])):
        near = best.copy()
        end = _crossing(excess, float(best[index]), direction, float(bound))
        at = best.copy()
        at[index] = bound if end is None else end
        ends.append(float(problem.in_units(at)[index]))
        is_open.append(end is None)
    return Interval(ends[0], ends[1], is_open[0], is_open[1])


def _crossing(excess: Callable[[float], float], start: float, direction: float, bound: float) -> float | None:
    """Where the excess turns positive on the way from ``start`` to ``bound``; None where it does not."""
    inside, step = start, FIRST_STEP * max(1.0, abs(start))
    for _ in range(STEPS):
        outside = inside + direction * step
        if direction * (outside - bound) >= 0.0:
            outside = bound
        if not np.isfinite(outside) or inside == outside:
            return None
        if excess(outside) > 0.0:
            return float(brentq(excess, inside, outside, xtol=PRECISION * abs(outside - start)))
        inside, step = outside, step * GROWTH
    return None
