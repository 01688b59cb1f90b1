"""Score test: the predicted gain of each hypothesis, which spares hopeless fits.

An effect too small to see moves the innovations in proportion to its parameters, ``e + J d``. One run of the filter,
linearised, gives ``J`` for all hypotheses at once; least squares on the estimation data gives ``d``, and its gain
there. Parameters that count only while others are not neutral (the time of a relaxation) have no slope there: the
others are tried at several values of theirs.

Source: Rao's score test, e.g. Cox and Hinkley (1974), Theoretical Statistics, sec. 9.3.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import Effect

from ..robot.schema import Robot
from .effect_sensitivities import EffectSensitivities, SensitivityColumn
from .estimation_data import DataSet
from .filter_linearisation import LinearisedSegment, linearise_filter
from .hypotheses import PLATFORM_SENSOR_FORMS, Hypothesis, free_parameters
from .identification_context import IdentificationContext
from .parameter_fit import Fitter

Array = NDArray[np.float64]

# Singular values of the scaled information matrix below this share of the largest count as zero.
SCORE_RANK_TOLERANCE = 1e-9


@dataclass(frozen=True)
class PredictedGain:
    """Predicted gain of a hypothesis: log-likelihood on estimation data, and the values that would gain it."""

    gain: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class ScoreRun:
    """Run of a filter that scores are taken along: with a fitter's noise, over some data.

    Far from noise the score misleads: an oscillation out of phase after a while asks for damping whatever it lacks.
    With ``acceleration_noise_density`` (m/s^2 per root hertz) the run follows the measurements, and the score is right.
    """

    fitter: Fitter
    data: DataSet
    acceleration_noise_density: float = 0.0


@dataclass(frozen=True)
class ScoreStatistics:
    """Score and Fisher information of the parameters, by the innovations ``e`` of all samples that count.

    ``columns`` (p) name the parameters, ``values`` (p) are where the Jacobian ``J`` was taken; ``fisher_information``
    is ``J' J`` (p, p), ``score`` is ``J' e`` (p).
    """

    columns: tuple[SensitivityColumn, ...]
    values: Array
    fisher_information: Array
    score: Array


def score_tests(
    robot: Robot, accepted: Sequence[Hypothesis], candidates: Sequence[Hypothesis], runs: Sequence[ScoreRun]
) -> list[dict[Hypothesis, PredictedGain]]:
    """Score test of each hypothesis beside the accepted ones, whose parameters are refitted with it, along each run."""
    return [
        {hypothesis: _best_gain(each, robot, accepted, hypothesis, candidates) for hypothesis in candidates}
        for each in _statistics_by_run(robot, accepted, candidates, runs)
    ]


def _best_gain(
    statistics: ScoreStatistics,
    robot: Robot,
    accepted: Sequence[Hypothesis],
    hypothesis: Hypothesis,
    candidates: Sequence[Hypothesis],
) -> PredictedGain:
    grid = starting_grid(hypothesis.effect, robot, cables_of(hypothesis.effect, candidates))
    trials = enumerate(grid[: grid_size(hypothesis)])
    predictions = [_predicted_gain(statistics, accepted, hypothesis, number, shapes) for number, shapes in trials]
    return max(predictions, key=lambda prospect: prospect.gain)


def score_tests_in_workers(
    context: IdentificationContext,
    robot: Robot,
    accepted: Sequence[Hypothesis],
    candidates: Sequence[Hypothesis],
    runs: Sequence[ScoreRun],
) -> list[dict[Hypothesis, PredictedGain]]:
    """As :func:`score_tests`, with the effects shared out to the worker processes."""
    count = context.workers.processes
    effects = list(dict.fromkeys(hypothesis.effect for hypothesis in candidates))
    shares = [[h for h in candidates if h.effect in effects[number::count]] for number in range(count)]
    calls = [(robot, accepted, own, runs) for own in shares if own]
    predictions: list[dict[Hypothesis, PredictedGain]] = [{} for _ in runs]
    for _, results in context.workers.map_unordered(score_tests, calls):
        for of_all, of_share in zip(predictions, results, strict=True):
            of_all.update(of_share)
    return [{hypothesis: each[hypothesis] for hypothesis in candidates} for each in predictions]


def score_statistics(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    hypotheses: Sequence[Hypothesis],
    fitter: Fitter,
    data: DataSet,
) -> ScoreStatistics:
    """Score statistics of the accepted hypotheses' parameters, and of the others' on each cable alone.

    Those begin as the robot file declares them, or neutral.
    """
    (statistics,) = _statistics_by_run(robot, accepted, hypotheses, [ScoreRun(fitter, data)])
    return statistics


def _statistics_by_run(
    robot: Robot, accepted: Sequence[Hypothesis], hypotheses: Sequence[Hypothesis], runs: Sequence[ScoreRun]
) -> Iterator[ScoreStatistics]:
    """Score statistics along each run; what is compiled for the effects, which takes longest, serves all."""
    free = free_parameters(robot, accepted)
    settings = [robot.effects[f.effect_index] for f in free]
    columns = [SensitivityColumn(s.name, s.cables, f.name, 0) for s, f in zip(settings, free, strict=True)]
    # A disturbance has states of its own, behind those of the model that effects act on.
    compiled: dict[Robot, tuple[EffectSensitivities, ...]] = {}
    for run in runs:
        likelihood, values = run.fitter.likelihood(robot, accepted, run.data)
        placed = run.data.placed(robot)
        if placed not in compiled:
            compiled[placed] = effect_sensitivities(placed, hypotheses, likelihood.model.state_names)
        segments = linearise_filter(likelihood, values, run.data.recording, run.acceleration_noise_density)
        yield statistics_of_runs(segments, compiled[placed], run.data.rows, columns, values)


def statistics_of_runs(
    runs: Iterable[LinearisedSegment],
    effects: Sequence[EffectSensitivities],
    rows: NDArray[np.bool_],
    own_columns: Sequence[SensitivityColumn] = (),
    own_values: Sequence[float] = (),
) -> ScoreStatistics:
    """Score statistics of a linearised filter's own parameters and of effects beside them, by some recorded rows."""
    columns = (*own_columns, *(column for effect in effects for column in effect.columns))
    nominal_values = np.concatenate([np.array(own_values), *(effect.values for effect in effects)])
    fisher_information, score = np.zeros((len(nominal_values), len(nominal_values))), np.zeros(len(nominal_values))
    state_sensitivities = np.hstack([effect.start_sensitivities for effect in effects])
    recorded_rows = 0
    for effect in effects:
        effect.restart()
    for run in runs:
        counting = np.zeros(len(run.is_recorded), dtype=bool)
        counting[run.is_recorded] = rows[recorded_rows : recorded_rows + int(np.sum(run.is_recorded))]
        recorded_rows += int(np.sum(run.is_recorded))
        by_effect = [effect.of_rates_and_outputs(run) for effect in effects]
        by_rates, by_outputs = (np.concatenate(part, axis=2) for part in zip(*by_effect, strict=True))
        state_sensitivities, innovation_sensitivities = run.propagate_sensitivities(
            state_sensitivities, run.integrated_forcing(by_rates), by_outputs
        )
        jacobian = np.concatenate([run.sensitivities, innovation_sensitivities], axis=2)[counting].reshape(
            -1, len(nominal_values)
        )
        fisher_information += jacobian.T @ jacobian
        score += jacobian.T @ run.values[counting].ravel()
    return _without_non_finite(ScoreStatistics(columns, nominal_values, fisher_information, score))


def _without_non_finite(statistics: ScoreStatistics) -> ScoreStatistics:
    """The statistics without non-finite columns: an effect too stiff for the filter's step has no valid score."""
    finite = np.isfinite(np.diag(statistics.fisher_information))
    fisher_information = np.where(np.outer(finite, finite), statistics.fisher_information, 0.0)
    return ScoreStatistics(
        statistics.columns, statistics.values, fisher_information, np.where(finite, statistics.score, 0.0)
    )


def effect_sensitivities(
    robot_at_start: Robot, hypotheses: Sequence[Hypothesis], state_names: Sequence[str]
) -> tuple[EffectSensitivities, ...]:
    """Sensitivities to each effect of some hypotheses, of a robot placed at its start with those states."""
    found = []
    for effect in dict.fromkeys(hypothesis.effect for hypothesis in hypotheses):
        of_effect = [hypothesis for hypothesis in hypotheses if hypothesis.effect is effect]
        groups = list(dict.fromkeys(hypothesis.cables for hypothesis in of_effect))
        # Columns of cables alone serve hypotheses on several, but are as many times as costly.
        if len(groups) > 1:
            groups = [(cable,) for cable in sorted({cable for group in groups for cable in group})]
        forms = list(dict.fromkeys(hypothesis.form for hypothesis in of_effect))
        grid = starting_grid(effect, robot_at_start, cables_of(effect, of_effect))
        found.append(EffectSensitivities(robot_at_start, effect, groups, forms, grid, state_names))
    return tuple(found)


def cables_of(effect: Effect, hypotheses: Sequence[Hypothesis]) -> set[int]:
    """Cables on which some of the hypotheses have an effect."""
    return {cable for hypothesis in hypotheses if hypothesis.effect is effect for cable in hypothesis.cables}


def starting_grid(effect: Effect, robot: Robot | None = None, cables: Collection[int] = ()) -> list[dict[str, float]]:
    """Grid of the values from which fits of an effect begin; one empty point where it has none.

    One point, the robot's own, where that has the effect on some of the cables already.
    """
    gridded = [p for p in effect.parameters if p.multistart_values]
    for setting in robot.effects if robot else ():
        if setting.name == effect.name and (not setting.cables or set(setting.cables) & set(cables)):
            return [{p.name: float(setting.values[p.name]) for p in gridded}]
    return [
        dict(zip([p.name for p in gridded], values, strict=True))
        for values in product(*(p.multistart_values for p in gridded))
    ]


def grid_size(hypothesis: Hypothesis) -> int:
    """Number of grid points for a hypothesis: one where its form has no gridded parameter."""
    gridded = [p for p in hypothesis.effect.parameters if p.multistart_values]
    is_gridded = any(p.name in hypothesis.form for p in gridded)
    return prod(len(p.multistart_values) for p in gridded) if is_gridded else 1


def _predicted_gain(
    statistics: ScoreStatistics,
    accepted: Sequence[Hypothesis],
    hypothesis: Hypothesis,
    trial: int,
    shapes: Mapping[str, float],
) -> PredictedGain:
    accepted_columns = _leading_columns(statistics, sum(len(a.form) for a in accepted))
    names, new_columns = parameter_columns(statistics, hypothesis, trial)
    accepted_gain, _ = _least_squares_gain(statistics, accepted_columns)
    gain, step = _least_squares_gain(statistics, np.hstack([accepted_columns, new_columns]))
    start_values = statistics.values @ new_columns / np.maximum(np.sum(new_columns, axis=0), 1.0)
    values = dict(zip(names, (start_values + step[accepted_columns.shape[1] :]).tolist(), strict=True))
    bounds = {p.name: (p.minimum, p.maximum) for p in hypothesis.parameters}
    if any(not bounds[name][0] <= value <= bounds[name][1] for name, value in values.items()):
        clipped = {name: float(np.clip(value, *bounds[name])) for name, value in values.items()}
        # A bound crossed by one parameter of several is left to the fit.
        if len(values) == 1:
            gain = accepted_gain + (gain - accepted_gain) * _gain_share_at_bound(
                start_values[0], values[names[0]], clipped[names[0]]
            )
        values = clipped
    shape_values = {name: value for name, value in shapes.items() if name in hypothesis.form}
    return PredictedGain(gain - accepted_gain, {**shape_values, **values})


def _gain_share_at_bound(start: float, best: float, bound: float) -> float:
    """Share of a parabola's gain, from ``start`` to its ``best``, that is reached at a bound between."""
    return 1.0 - ((best - bound) / (best - start)) ** 2


def parameter_columns(statistics: ScoreStatistics, hypothesis: Hypothesis, trial: int) -> tuple[list[str], Array]:
    """Parameters of a hypothesis that have a score, and the columns that each moves (columns, parameters)."""
    names, columns = [], []
    is_of_platform = hypothesis.form in PLATFORM_SENSOR_FORMS
    acting_cables = set(hypothesis.cables[:1] if is_of_platform else hypothesis.cables)
    own_columns = [
        (index, column)
        for index, column in enumerate(statistics.columns)
        if column.effect == hypothesis.effect.name
        and column.trial == trial
        and set(column.cables[:1] if is_of_platform else column.cables) <= acting_cables
    ]
    information = np.diag(statistics.fisher_information)
    for name in hypothesis.form:
        indices = [index for index, column in own_columns if column.parameter == name]
        if np.sum(information[indices]) > 0.0:
            names.append(name)
            weights = np.zeros(len(information))
            weights[indices] = 1.0
            columns.append(weights)
    return names, np.array(columns).reshape(len(names), len(statistics.columns)).T


def _leading_columns(statistics: ScoreStatistics, count: int) -> Array:
    selected: Array = np.eye(len(statistics.columns))[:, :count]
    return selected


def _least_squares_gain(statistics: ScoreStatistics, combinations: Array) -> tuple[float, Array]:
    """Half the decrease of the sum of squares by least squares over combinations of columns, and the step."""
    if not combinations.shape[1]:
        return 0.0, np.zeros(0)
    fisher_information = combinations.T @ statistics.fisher_information @ combinations
    scale = np.sqrt(np.maximum(np.diag(fisher_information), np.finfo(float).tiny))
    score = combinations.T @ statistics.score
    step = (
        np.linalg.lstsq(fisher_information / np.outer(scale, scale), -score / scale, rcond=SCORE_RANK_TOLERANCE)[0]
        / scale
    )
    return float(-0.5 * score @ step), step
