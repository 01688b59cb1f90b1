"""Grid search over starting values, for hypotheses whose score test misleads.

A rope softens near slackness by ``s ln(1 + exp(T / s))``: at ``s = 0`` all derivatives vanish, so linearisations
predict no gain however much it would explain. A friction force far above the first slope's reach ends a fit in the
wrong valley. The model itself is run at some values instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from math import exp, inf, isfinite, log
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tautwire_fmu.laws.effects import Parameter

from ..errors import UnreachableError
from ..robot.schema import EffectSetting, Robot
from .estimation_data import DataSet
from .hypotheses import Hypothesis, with_hypothesis
from .kalman_filter import Noise
from .parameter_fit import Fitter, worker_fitter
from .score_test import PredictedGain
from .worker_pool import WorkerPool

# Nats: where gains are this small, smaller values of the parameter have no effect either.
NEGLIGIBLE_GAIN = 0.01
# Of the natural log of the value.
LOG_VALUE_TOLERANCE = 0.01


def zero_slope_predictions(predictions: Mapping[Hypothesis, PredictedGain]) -> dict[Hypothesis, PredictedGain]:
    """Predictions of hypotheses with a parameter that has grid values and no slope."""
    return {h: p for h, p in predictions.items() if any(q.grid_values and q.name not in p.values for q in h.parameters)}


def grid_search(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    data: DataSet,
    predictions: Mapping[Hypothesis, PredictedGain],
    workers: WorkerPool,
) -> dict[Hypothesis, PredictedGain]:
    """Grid search of the hypotheses that have grid values: the best grid point, or the prediction if it gains more.

    ``robot`` has the accepted hypotheses, whose parameters stay as they are.
    """
    candidates = [hypothesis for hypothesis in predictions if any(p.grid_values for p in hypothesis.parameters)]
    if not candidates:
        return {}
    baseline = fitter.judged(robot, accepted, data).log_likelihood(data.rows)
    tasks = [(robot, with_hypothesis(accepted, h), data, predictions[h], baseline) for h in candidates]
    if workers.processes == 1:
        results = workers.map_unordered(partial(best_grid_point, fitter), tasks)
    else:
        results = workers.map_unordered(best_grid_point_in_worker, [(fitter.noise, *task) for task in tasks])
    return {candidates[number]: prospect for number, prospect in results}


def best_grid_point(
    fitter: Fitter,
    robot: Robot,
    chosen: Sequence[Hypothesis],
    data: DataSet,
    prediction: PredictedGain,
    baseline: float,
) -> PredictedGain:
    """Best grid point of the last of the chosen hypotheses, or its predicted values where they gain more.

    ``baseline`` is the log-likelihood of the data without it.
    """
    gains = []
    if prediction.values and isfinite(
        simulated_gain := _log_likelihood_at(robot, chosen, fitter, data, prediction.values) - baseline
    ):
        gains.append((simulated_gain, prediction))
    for shapes in grid_points(chosen[-1]):
        points = [{**prediction.values, **values} for values in shapes]
        point_gains = [_log_likelihood_at(robot, chosen, fitter, data, values) - baseline for values in points]
        gains += [(g, PredictedGain(g, values)) for g, values in zip(point_gains, points, strict=True) if isfinite(g)]
        if all(abs(gain) < NEGLIGIBLE_GAIN for gain in point_gains):
            break
    return max(gains, key=lambda each: each[0], default=(0.0, prediction))[1]


def best_grid_point_in_worker(noise: Noise, *arguments: Any) -> PredictedGain:
    """As :func:`best_grid_point`, in a worker process with its own fitter."""
    return best_grid_point(worker_fitter(noise), *arguments)


def detectable_value(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    data: DataSet,
    hypothesis: Hypothesis,
    parameter: Parameter,
    required_norm: float,
) -> float:
    """Detectable value of a gridded parameter: it moves the whitened innovations by ``required_norm``.

    That is the root of the sum of squares; infinite where the largest grid value does not reach it. The other
    parameters are where fits begin.
    """
    chosen = with_hypothesis(accepted, hypothesis)
    baseline = fitter.judged(robot, accepted, data).values[data.rows]

    def excess(log_value: float) -> float:
        start = hypothesis.setting(robot)
        setting = EffectSetting(start.name, {**start.values, parameter.name: exp(log_value)}, start.cables)
        try:
            change = fitter.judged(robot.with_effect(setting), chosen, data).values[data.rows] - baseline
        except UnreachableError:
            return required_norm
        norm = float(np.sqrt(np.nansum(change**2)))
        return min(norm, 2.0 * required_norm) - required_norm if isfinite(norm) else required_norm

    log_minimum, log_maximum = log(min(parameter.grid_values)), log(max(parameter.grid_values))
    if excess(log_maximum) < 0.0:
        return inf
    return exp(
        log_minimum if excess(log_minimum) > 0.0 else brentq(excess, log_minimum, log_maximum, xtol=LOG_VALUE_TOLERANCE)
    )


def grid_points(hypothesis: Hypothesis) -> Iterator[list[dict[str, float]]]:
    """Grid points, the largest values first, each with all grid values of the parameters that shape the effect."""
    scales = [p for p in hypothesis.parameters if p.grid_values]
    shapes = [p for p in hypothesis.parameters if p.multistart_values]
    if not scales:
        return
    names = [p.name for p in (*scales, *shapes)]
    for scale_values in product(*(sorted(p.grid_values, reverse=True) for p in scales)):
        shaped = product(*(p.multistart_values for p in shapes))
        yield [dict(zip(names, (*scale_values, *values), strict=True)) for values in shaped]


def _log_likelihood_at(
    robot: Robot, chosen: Sequence[Hypothesis], fitter: Fitter, data: DataSet, values: Mapping[str, float]
) -> float:
    """Log-likelihood with the last of the chosen at some values; NaN where the cables cannot hold them."""
    start = chosen[-1].setting(robot)
    setting = EffectSetting(start.name, {**start.values, **values}, start.cables)
    try:
        return fitter.judged(robot.with_effect(setting), chosen, data).log_likelihood(data.rows)
    except UnreachableError:
        return float("nan")
