"""Profile-likelihood 95 % intervals, also where the sum of squares about a fit is not a parabola.

A value ``t`` of one parameter is inside while the others, at their best beside it, leave a sum of squares little above
that of the fit:

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

from .attempts import worker_fitter
from .data import DataSet
from .filter_step import Noise
from .fit import NORMAL_QUANTILE_95, Fit, Fitter, parameter_bounds
from .hypotheses import Hypothesis
from .surface import LowerMinimumError, ProfileLikelihood, TooManyRunsError
from .workers import WorkerPool

Array = NDArray[np.float64]

CHI_SQUARED_95 = NORMAL_QUANTILE_95**2
# Largest relative difference of the rise from that of a parabola at which an end by curvature is taken.
MAX_PARABOLA_DEVIATION = 0.1
# Relative to the distance from the fit to an end.
INTERVAL_END_TOLERANCE = 0.01
# Relative to the parameter's scale: first distance of the search where the curvature is unknown.
FIRST_RELATIVE_DISTANCE = 1e-3
# How often the distance is doubled in search of an end, and how often the fit may turn out not to be the best.
MAX_DISTANCE_DOUBLINGS, MAX_RECENTRINGS = 20, 3


def profile_intervals(
    fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], data: DataSet, workers: WorkerPool
) -> list[tuple[float, float]]:
    """Profile-likelihood interval of each free parameter of a fit, which was made with ``chosen`` on ``data``.

    An end is the parameter's bound if the profile does not rise before; infinite where there is none. It is by
    curvature where :class:`ProfileLikelihood` takes too many runs to find it.
    """
    count = len(fit.free)
    if workers.processes == 1:
        return [profile_interval(fitter, fit, chosen, data, index) for index in range(count)]
    calls = [(fitter.noise, fit, chosen, data, index) for index in range(count)]
    return [found for _, found in sorted(workers.map_unordered(_profile_interval_in_worker, calls))]


def profile_interval(
    fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], data: DataSet, index: int
) -> tuple[float, float]:
    """Profile-likelihood interval of one parameter; its value is inside."""
    likelihood, _ = fitter.likelihood(fit.robot, chosen, data)
    lower, upper = parameter_bounds(fit.robot, fit.free)
    minimum, maximum = float(lower[index]), float(upper[index])
    value, half_width = float(fit.values[index]), NORMAL_QUANTILE_95 * float(fit.standard_deviations[index])
    profile = ProfileLikelihood(likelihood, fit, data, lower, upper, fitter.poll_interrupts)
    try:
        low, high = _both_ends(profile, index, (minimum, maximum), MAX_RECENTRINGS)
    except (LowerMinimumError, TooManyRunsError):
        return (
            (max(value - half_width, minimum), min(value + half_width, maximum))
            if half_width > 0.0
            else (minimum, maximum)
        )
    return max(min(low, value), minimum), min(max(high, value), maximum)


def _profile_interval_in_worker(
    noise: Noise, fit: Fit, chosen: Sequence[Hypothesis], data: DataSet, index: int
) -> tuple[float, float]:
    return profile_interval(worker_fitter(noise), fit, chosen, data, index)


def _both_ends(
    profile: ProfileLikelihood, index: int, bounds: tuple[float, float], recentrings: int
) -> tuple[float, float]:
    """Both ends, recentred on better values where some turn up."""
    try:
        return _interval_end(profile, index, -1.0, bounds[0]), _interval_end(profile, index, 1.0, bounds[1])
    except LowerMinimumError as better:
        if not recentrings:
            raise
        return _both_ends(profile.recentred(better.values), index, bounds, recentrings - 1)


def _interval_end(profile: ProfileLikelihood, index: int, sign: float, bound: float) -> float:
    estimate, standard_deviation = float(profile.values[index]), float(profile.standard_deviations[index])
    inner = 0.0
    for distance in _search_distances(
        NORMAL_QUANTILE_95 * standard_deviation,
        FIRST_RELATIVE_DISTANCE * float(profile.scales[index]),
        abs(bound - estimate),
    ):
        excess_at_distance = profile.rise(index, estimate + sign * distance) - CHI_SQUARED_95
        if (
            inner == 0.0
            and distance == NORMAL_QUANTILE_95 * standard_deviation
            and abs(excess_at_distance) < MAX_PARABOLA_DEVIATION * CHI_SQUARED_95
        ):
            return estimate + sign * distance
        if excess_at_distance > 0.0:
            break
        inner = distance
    else:
        return bound

    def excess(length: float) -> float:
        return profile.rise(index, estimate + sign * length) - CHI_SQUARED_95 if length > 0.0 else -CHI_SQUARED_95

    return estimate + sign * float(
        brentq(excess, inner, distance, xtol=INTERVAL_END_TOLERANCE * distance, rtol=INTERVAL_END_TOLERANCE)
    )


def _search_distances(by_curvature: float, by_size: float, farthest: float) -> Iterator[float]:
    """Distances of the search, each twice the last, up to the farthest if that is not infinite."""
    distance = by_curvature if by_curvature > 0.0 else by_size
    for _ in range(MAX_DISTANCE_DOUBLINGS):
        if distance >= farthest:
            break
        yield distance
        distance = max(2.0 * distance, by_size)
    if 0.0 < farthest < np.inf:
        yield farthest
