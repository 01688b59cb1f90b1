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
    ends = [(index, side) for index in range(len(fit.free)) for side in (-1.0, 1.0)]
    if workers.processes == 1:
        found = [end(fitter, fit, chosen, sample, *each) for each in ends]
    else:
        calls = [(fitter.noise, fit, chosen, sample, *each) for each in ends]
        found = [value for _, value in sorted(workers.each(_end_apart, calls))]
    return list(zip(found[0::2], found[1::2], strict=True))


def end(fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample, index: int, side: float) -> float:
    """Where the interval of one parameter ends, below (-1) or above (1) its value; never on the other side of it."""
    likelihood, _ = fitter.likelihood(fit.robot, chosen, sample)
    lower, upper = bounds_of(fit.robot, fit.free)
    value, deviation = float(fit.values[index]), float(fit.deviations[index])
    bound = float((lower if side < 0.0 else upper)[index])
    by_curvature = value + side * min(NORMAL_95 * deviation, abs(bound - value)) if deviation > 0.0 else bound
    surface = Surface(likelihood, fit, sample, lower, upper, fitter.between)
    try:
        found = _best_searched(surface, index, side, bound, MOST_LOWER)
    except (LowerError, TooManyRunsError):
        return by_curvature
    return side * max(side * found, side * value)


def _end_apart(noise: Noise, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample, index: int, side: float) -> float:
    return end(fitter_apart(noise), fit, chosen, sample, index, side)


def _best_searched(surface: Surface, index: int, side: float, bound: float, left: int) -> float:
    """As :func:`_searched`, about better values where some turn up."""
    try:
        return _searched(surface, index, side, bound)
    except LowerError as lower:
        if not left:
            raise
        return _best_searched(surface.about(lower.values), index, side, bound, left - 1)


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
