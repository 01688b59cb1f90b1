"""Grid search over starting values, for hypotheses whose score test misleads.

A rope softens near slackness by ``s ln(1 + exp(T / s))``: at ``s = 0`` all derivatives vanish, so linearisations
predict no gain however much it would explain. A friction force far above the first slope's reach ends a fit in the
wrong valley. The model itself is run at some values instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import exp, inf, isfinite, log

import numpy as np
from scipy.optimize import brentq

from tautwire_fmu.laws.effects import Parameter

from ..errors import UnreachableError
from ..robot.schema import EffectSetting, Robot
from .estimation_data import DataSet
from .hypotheses import Hypothesis, with_hypothesis
from .identification_context import IdentificationContext
from .parameter_fit import Fitter
from .policy import GridSearchPolicy
from .score_test import PredictedGain


def misleading_predictions(
    predictions: Mapping[Hypothesis, PredictedGain], cables: tuple[int, ...]
) -> dict[Hypothesis, PredictedGain]:
    """Predictions of hypotheses with grid values that are on all ``cables``, or have no slope at all.

    A delay of half a period of a mode explains less than none: a slope asks for some milliseconds where a tenth of a
    second is hidden. On single cables that would take a search for each.
    """

    def is_misleading(hypothesis: Hypothesis, prediction: PredictedGain) -> bool:
        gridded = [parameter.name for parameter in hypothesis.parameters if parameter.grid_values]
        return bool(gridded) and (hypothesis.cables == cables or not prediction.values.keys() >= set(gridded))

    return {h: prediction for h, prediction in predictions.items() if is_misleading(h, prediction)}


def grid_search(
    context: IdentificationContext,
    robot: Robot,
    accepted: Sequence[Hypothesis],
    data: DataSet,
    predictions: Mapping[Hypothesis, PredictedGain],
) -> dict[Hypothesis, PredictedGain]:
    """Grid search of the hypotheses that have grid values: the best grid point, or the prediction if it gains more.

    ``robot`` has the accepted hypotheses, whose parameters stay as they are. Beside a disturbance, with a slow filter,
    the first samples rank the grid points, unless no effect is felt there, and all tell the gain of the best one.
    """
    candidates = [hypothesis for hypothesis in predictions if any(p.grid_values for p in hypothesis.parameters)]
    if not candidates:
        return {}
    fitter, policy = context.fitter, context.policy.grid_search
    whole = Baseline(data, fitter.judged(robot, accepted, data).log_likelihood(data.rows))
    ranking = whole
    if fitter.has_disturbance:
        head = data.head(context.policy.fit)
        ranking = Baseline(head, fitter.judged(robot, accepted, head).log_likelihood(head.rows))
    tasks = [GridTask(robot, tuple(with_hypothesis(accepted, h)), predictions[h], ranking, whole) for h in candidates]
    results = context.workers.map_unordered(best_grid_point, [(fitter, task, policy) for task in tasks])
    return {candidates[number]: prospect for number, prospect in results}


@dataclass(frozen=True)
class Baseline:
    """Samples by which grid points are judged, and their log-likelihood without the hypothesis that is tried."""

    data: DataSet
    log_likelihood: float


@dataclass(frozen=True)
class GridTask:
    """Grid search of the last of the chosen hypotheses: what ranks its points, and what the best one's gain is on."""

    robot: Robot
    chosen: tuple[Hypothesis, ...]
    prediction: PredictedGain
    ranking: Baseline
    whole: Baseline


def best_grid_point(fitter: Fitter, task: GridTask, policy: GridSearchPolicy) -> PredictedGain:
    """Best grid point of a task, or its predicted values where they gain more."""
    ranked = _ranked_points(fitter, task, task.ranking, policy)
    if all(abs(gain) < policy.negligible_gain for gain, _ in ranked) and task.ranking is not task.whole:
        ranked = _ranked_points(fitter, task, task.whole, policy)
    _, best = max(ranked, key=lambda each: each[0], default=(0.0, task.prediction))
    if task.ranking is task.whole or best is task.prediction:
        return best
    gain = _gain_at(fitter, task, task.whole, best.values)
    return PredictedGain(gain, best.values) if isfinite(gain) else task.prediction


def _ranked_points(
    fitter: Fitter, task: GridTask, baseline: Baseline, policy: GridSearchPolicy
) -> list[tuple[float, PredictedGain]]:
    """The prediction, and the grid points down to the first that is not felt, each after its gain."""
    prediction, ranked = task.prediction, []
    if prediction.values and isfinite(simulated_gain := _gain_at(fitter, task, baseline, prediction.values)):
        ranked.append((simulated_gain, prediction))
    for shapes in grid_points(task.chosen[-1]):
        points = [{**prediction.values, **values} for values in shapes]
        gains = [_gain_at(fitter, task, baseline, values) for values in points]
        ranked += [(g, PredictedGain(g, values)) for g, values in zip(gains, points, strict=True) if isfinite(g)]
        if all(abs(gain) < policy.negligible_gain for gain in gains):
            break
    return ranked


def detectable_value(
    context: IdentificationContext,
    robot: Robot,
    accepted: Sequence[Hypothesis],
    hypothesis: Hypothesis,
    parameter: Parameter,
    required_norm: float,
) -> float:
    """Detectable value of a gridded parameter: it moves the innovations of validation data by ``required_norm``.

    That is the root of the sum of squares; infinite where the largest grid value does not reach it. The other
    parameters are where fits begin.
    """
    fitter, data = context.fitter, context.split.validation
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
    tolerance = context.policy.grid_search.log_value_tolerance
    return exp(log_minimum if excess(log_minimum) > 0.0 else brentq(excess, log_minimum, log_maximum, xtol=tolerance))


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


def starts_by_shape(robot: Robot, hypothesis: Hypothesis) -> list[list[Robot]]:
    """The robot with a hypothesis at each grid point, by the values that shape the effect; empty where it has none."""
    start = hypothesis.setting(robot)
    return [
        [robot.with_effect(EffectSetting(start.name, {**start.values, **values}, start.cables)) for values in of_shape]
        for of_shape in zip(*grid_points(hypothesis), strict=True)
    ]


def _gain_at(fitter: Fitter, task: GridTask, baseline: Baseline, values: Mapping[str, float]) -> float:
    """Gain of log-likelihood with the last of the chosen at some values; NaN where the cables cannot hold them."""
    start = task.chosen[-1].setting(task.robot)
    setting = EffectSetting(start.name, {**start.values, **values}, start.cables)
    try:
        innovations = fitter.judged(task.robot.with_effect(setting), task.chosen, baseline.data)
        return innovations.log_likelihood(baseline.data.rows) - baseline.log_likelihood
    except UnreachableError:
        return float("nan")
