"""Identifiability and detectability: the smallest effects that a recording would have shown, and which are confusable.

The Jacobian ``J`` of the whitened innovations by all parameters, with those of the accepted hypotheses projected out,
gives both. An effect of one parameter moved by ``d`` is expected to gain ``d^2 |J|^2 / 2`` nats; the share of an effect
that another could mimic is the squared cosine of the angle between its signature and what the other's span.

Source: Kay (1998), Fundamentals of Statistical Signal Processing II, sec. 4.4; Ljung (1999), sec. 13.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import BY_NAME

from ..robot.schema import Robot
from .grid_search import detectable_value
from .hypotheses import SINGLE_CABLE_EFFECTS, Hypothesis, hypotheses
from .identification_context import IdentificationContext
from .policy import IdentifiabilityPolicy
from .score_test import ScoreStatistics, cables_of, grid_size, parameter_columns, score_statistics, starting_grid
from .trace_result import ConfusableEffect, Detectable, Identifiability

Array = NDArray[np.float64]

INFORMATION_RANK_TOLERANCE = 1e-9


def analyse_identifiability(
    context: IdentificationContext, robot: Robot, accepted: Sequence[Hypothesis]
) -> Identifiability:
    """Identifiability of all hypotheses beside the accepted ones, which ``robot`` has, on validation data."""
    declared, policy = context.robot, context.policy.identifiability
    candidates = hypotheses(declared)
    others = [h for h in candidates if not any(a.overlaps(h) for a in accepted)]
    statistics = score_statistics(robot, accepted, others, context.fitter, context.split.validation)
    required_norm = _required_norm(context.evidence_threshold(), policy)
    reported = [h for h in others if h.cables in ((), declared.cable_numbers) or h.effect in SINGLE_CABLE_EFFECTS]
    accepted_columns = [column for group in column_indices(statistics, accepted) for column in group]
    grids = {h.effect: starting_grid(h.effect, robot, cables_of(h.effect, others)) for h in reported}
    detectable = [
        size
        for h in reported
        for size in _detectable_sizes(statistics, h, grids[h.effect], accepted_columns, required_norm)
    ]
    detectable = [_detectable_by_simulation(context, robot, accepted, size, required_norm) for size in detectable]
    confusable = [
        likeness
        for tested in _tested_effects(statistics, robot, declared, accepted)
        for other in others
        if (likeness := _confusable_effect(statistics, tested, other, policy.min_confusable_cosine)) is not None
    ]
    return Identifiability(tuple(detectable), tuple(sorted(confusable, key=lambda pair: pair.nats)))


def separation_nats(statistics: ScoreStatistics, steps: Array, other: Hypothesis) -> Array:
    """Separations in nats (k,) of parameter steps (columns, k) from the best that another hypothesis can do instead."""
    information = np.diag(_projected_information(statistics.fisher_information, steps, []))
    separations: Array = 0.5 * information * (1.0 - _explained_shares(statistics, steps, other, []))
    return separations


def start_steps(statistics: ScoreStatistics, robot: Robot, hypothesis: Hypothesis) -> Array:
    """Parameter step (columns, 1) from where an effect is absent to where fits of it begin, at its first grid point."""
    names, columns = parameter_columns(statistics, hypothesis, 0)
    neutral_values = hypothesis.neutral(robot, hypothesis.cables).values
    start_values = hypothesis.setting(robot).values
    steps = np.array([float(start_values[name]) - float(neutral_values[name]) for name in names])
    combined: Array = (columns @ steps)[:, None]
    return combined


def _explained_shares(statistics: ScoreStatistics, steps: Array, other: Hypothesis, nuisance: list[int]) -> Array:
    """Share of each step's squared length (k,) that another hypothesis can explain, at its best grid point."""
    count = steps.shape[1]
    largest_shares = np.zeros(count)
    for number in range(grid_size(other)):
        _, columns = parameter_columns(statistics, other, number)
        if columns.shape[1]:
            projected = _projected_information(statistics.fisher_information, np.hstack([steps, columns]), nuisance)
            cross_information, information = projected[count:, :count], np.diag(projected)[:count]
            explained = np.sum(
                cross_information * _scaled_least_squares(projected[count:, count:], cross_information), axis=0
            )
            shares = np.divide(explained, information, out=np.zeros(count), where=information > 0.0)
            largest_shares = np.maximum(largest_shares, shares)
    return np.minimum(largest_shares, 1.0)


def column_indices(statistics: ScoreStatistics, accepted: Sequence[Hypothesis]) -> list[list[int]]:
    """Column indices of each accepted hypothesis, whose columns come first, in the order of the robot's effects."""
    leading = statistics.columns[: sum(len(hypothesis.form) for hypothesis in accepted)]
    return [
        [i for i, column in enumerate(leading) if (column.effect, column.cables) == (each.effect.name, each.cables)]
        for each in accepted
    ]


def _detectable_sizes(
    statistics: ScoreStatistics,
    hypothesis: Hypothesis,
    grid: Sequence[Mapping[str, float]],
    nuisance: list[int],
    required_norm: float,
) -> list[Detectable]:
    smallest = {
        p.name: Detectable(hypothesis.effect.name, hypothesis.cables, p.name, inf, p.unit, {})
        for p in hypothesis.parameters
        if p.name not in grid[0]
    }
    for number, shapes in enumerate(grid[: grid_size(hypothesis)]):
        names, columns = parameter_columns(statistics, hypothesis, number)
        projected = _projected_information(statistics.fisher_information, columns, nuisance)
        for index, name in enumerate(names):
            parameter = next(p for p in hypothesis.parameters if p.name == name)
            strength = sqrt(max(projected[index, index], 0.0))
            nominal = float(statistics.values @ columns[:, index] / np.sum(columns[:, index]))
            size = required_norm / strength if strength > 0.0 else inf
            if size > max(parameter.maximum - nominal, nominal - parameter.minimum):
                size = inf
            other_values = {key: value for key, value in shapes.items() if key in hypothesis.form}
            detectable = Detectable(hypothesis.effect.name, hypothesis.cables, name, size, parameter.unit, other_values)
            if size < smallest[name].size:
                smallest[name] = detectable
    return list(smallest.values())


def _required_norm(threshold: float, policy: IdentifiabilityPolicy) -> float:
    """Norm by which an effect has to move the whitened innovations to be detected."""
    return policy.power_quantile + sqrt(policy.power_quantile**2 + 2.0 * (threshold + policy.fit_cost_nats))


def _detectable_by_simulation(
    context: IdentificationContext,
    robot: Robot,
    accepted: Sequence[Hypothesis],
    detectable: Detectable,
    required_norm: float,
) -> Detectable:
    """Detectable size by runs of the model where the Jacobian vanishes."""
    effect = BY_NAME[detectable.name]
    parameter = next(p for p in effect.parameters if p.name == detectable.parameter)
    if not parameter.grid_values or detectable.size < inf:
        return detectable
    form = next(form for form in effect.forms if parameter.name in form)
    hypothesis = Hypothesis(effect, detectable.cables, form)
    return replace(detectable, size=detectable_value(context, robot, accepted, hypothesis, parameter, required_norm))


def _projected_information(fisher_information: Array, columns: Array, nuisance: list[int]) -> Array:
    """Information matrix of combinations of columns, with the nuisance columns projected out."""
    projected = columns.T @ fisher_information @ columns
    if nuisance:
        cross_information = fisher_information[nuisance] @ columns
        projected = projected - cross_information.T @ _scaled_least_squares(
            fisher_information[np.ix_(nuisance, nuisance)], cross_information
        )
    reduced: Array = projected
    return reduced


def _scaled_least_squares(matrix: Array, right_side: Array) -> Array:
    """Least squares with columns scaled to the same size."""
    scale = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    scaled: Array = np.linalg.lstsq(
        matrix / np.outer(scale, scale), right_side / scale[:, None], rcond=INFORMATION_RANK_TOLERANCE
    )[0]
    solution: Array = scaled / scale[:, None]
    return solution


@dataclass(frozen=True)
class _TestedEffect:
    """An accepted effect with its parameter step (columns, 1); nuisance columns are those of the other ones."""

    hypothesis: Hypothesis
    step: Array
    nuisance: list[int]


def _tested_effects(
    statistics: ScoreStatistics, robot: Robot, declared: Robot, accepted: Sequence[Hypothesis]
) -> Iterator[_TestedEffect]:
    column_groups = column_indices(statistics, accepted)
    for own_columns, hypothesis in zip(column_groups, accepted, strict=True):
        nuisance = [column for group in column_groups if group is not own_columns for column in group]
        step = np.zeros((len(statistics.columns), 1))
        step[own_columns, 0] = _parameter_steps(robot, declared, hypothesis)
        yield _TestedEffect(hypothesis, step, nuisance)


def _confusable_effect(
    statistics: ScoreStatistics, tested: _TestedEffect, other: Hypothesis, min_cosine: float
) -> ConfusableEffect | None:
    """The other effect as confusable with a tested one, at its best grid point; None where the cosine is small."""
    information = float(_projected_information(statistics.fisher_information, tested.step, tested.nuisance)[0, 0])
    if information <= 0.0:
        return None
    cosine = sqrt(_explained_shares(statistics, tested.step, other, tested.nuisance)[0])
    if cosine < min_cosine:
        return None
    own, nats = tested.hypothesis, 0.5 * information * (1.0 - cosine**2)
    return ConfusableEffect(own.effect.name, own.cables, other.effect.name, other.cables, cosine, nats)


def _parameter_steps(robot: Robot, declared: Robot, hypothesis: Hypothesis) -> list[float]:
    """Parameter step from where the effect is absent to its values; zero for parameters that only shape it."""
    setting = next(s for s in robot.effects if (s.name, s.cables) == (hypothesis.effect.name, hypothesis.cables))
    neutral = hypothesis.neutral(declared, hypothesis.cables)
    shape_values = starting_grid(hypothesis.effect)[0]
    return [
        0.0 if p.name in shape_values else float(setting.values[p.name]) - float(neutral.values[p.name])
        for p in hypothesis.parameters
    ]
