"""95 % intervals by profile likelihood, where the surface about a fit is not round.

A value ``t`` of one parameter is inside while the others, at their best beside it, leave little more than the fit does:

    min over the others of S(t, others) - S(fit) <= 1.96^2

with ``S`` the sum of squares of the whitened innovations. Where ``S`` is a parabola the ends are 1.96 standard
deviations away. It is not where a parameter ends, and where it hardly shows: a relaxation's time, a drum's radius.

Source: Venzon and Moolgavkar (1988), A method for computing profile-likelihood-based confidence intervals, Applied
Statistics 37(1), 87-94.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from .attempts import fitter_apart
from .data import Sample
from .filter_step import Noise
from .fit import NORMAL_95, Fit, Fitter, bounds_of
from .hypotheses import Hypothesis
from .surface import LowerError, Surface, TooManyRunsError
from .workers import Workers

Array = NDArray[np.float64]

WITHIN = NORMAL_95**2
# Relative difference of the rise at both ends from that of a parabola, up to which the surface counts as round.
ROUND = 0.1
# Of the distance from the fit to an end.
PRECISION = 0.01
# Of its size: how far from the fit an end is looked for first where curvature tells nothing.
FIRST_REACH = 1e-3
# How often the distance is doubled in search of an end, and how often the fit may turn out not to be the best.
MOST_DOUBLINGS, MOST_LOWER = 20, 3


def intervals(
    fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample, workers: Workers
) -> list[tuple[float, float]]:
    """Low and high end for each free parameter of the fit, which was made with ``chosen`` on the sample.

    An end is where the parameter's range ends if nothing tells before; infinite where neither does. It is by curvature
    where :class:`Surface` takes too many runs to find it.
    """
    count = len(fit.free)
    if workers.processes == 1:
        return [ends(fitter, fit, chosen, sample, index) for index in range(count)]
    calls = [(fitter.noise, fit, chosen, sample, index) for index in range(count)]
    return [found for _, found in sorted(workers.each(_ends_apart, calls))]


def ends(fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample, index: int) -> tuple[float, float]:
    """Where the interval of one parameter ends; its value is inside."""
    likelihood, _ = fitter.likelihood(fit.robot, chosen, sample)
    lower, upper = bounds_of(fit.robot, fit.free)
    least, most = float(lower[index]), float(upper[index])
    value, reach = float(fit.values[index]), NORMAL_95 * float(fit.deviations[index])
    surface = Surface(likelihood, fit, sample, lower, upper, fitter.between)
    try:
        low, high = _both(surface, index, (least, most), MOST_LOWER)
    except (LowerError, TooManyRunsError):
        return (max(value - reach, least), min(value + reach, most)) if reach > 0.0 else (least, most)
    return max(min(low, value), least), min(max(high, value), most)


def _ends_apart(
    noise: Noise, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample, index: int
) -> tuple[float, float]:
    return ends(fitter_apart(noise), fit, chosen, sample, index)


def _both(surface: Surface, index: int, bounds: tuple[float, float], left: int) -> tuple[float, float]:
    """Both ends, about better values where some turn up."""
    try:
        return _searched(surface, index, -1.0, bounds[0]), _searched(surface, index, 1.0, bounds[1])
    except LowerError as lower:
        if not left:
            raise
        return _both(surface.about(lower.values), index, bounds, left - 1)


def _searched(surface: Surface, index: int, side: float, bound: float) -> float:
    middle, deviation = float(surface.values[index]), float(surface.deviations[index])
    inside = 0.0
    for reach in _reaches(NORMAL_95 * deviation, FIRST_REACH * float(surface.sizes[index]), abs(bound - middle)):
        rise = surface.rise(index, middle + side * reach) - WITHIN
        if inside == 0.0 and reach == NORMAL_95 * deviation and abs(rise) < ROUND * WITHIN:
            return middle + side * reach
        if rise > 0.0:
            break
        inside = reach
    else:
        return bound

    def excess(distance: float) -> float:
        return surface.rise(index, middle + side * distance) - WITHIN if distance > 0.0 else -WITHIN

    return middle + side * float(brentq(excess, inside, reach, xtol=PRECISION * reach, rtol=PRECISION))


def _reaches(by_curvature: float, by_size: float, farthest: float) -> Iterator[float]:
    """Distances at which to look, each twice the last, up to the farthest if that is not infinite."""
    reach = by_curvature if by_curvature > 0.0 else by_size
    for _ in range(MOST_DOUBLINGS):
        if reach >= farthest:
            break
        yield reach
        reach = max(2.0 * reach, by_size)
    if 0.0 < farthest < np.inf:
        yield farthest
