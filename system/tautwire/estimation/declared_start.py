"""Tests whether recordings start as the robot file says, and the zero of the position sensor is wrong.

First positions away from the declared start mean a run from elsewhere, or an offset of the position sensor. Elsewhere
ropes have other directions, for which a small pulley or a shifted exit point makes up. What was selected along with a
measured start has its coordinates as parameters too: an offset that explains as much from the declared one has fewer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from math import inf

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import SENSOR_OFFSET

from ..errors import UnreachableError
from ..recordings.start_position import MAX_START_SAMPLES, START_SIGNIFICANCE
from ..robot.schema import AXES, EffectSetting, Robot
from .candidate_fits import maximised_validation_likelihood
from .candidate_scores import setting_of
from .hypotheses import Hypothesis
from .identification_context import IdentificationContext
from .parameter_fit import Fit, NoFitError
from .residual_analysis import residuals_are_white
from .selection_result import SelectionResult, with_disturbance_beside

OFFSET_FORM = tuple(f"position_offset_{axis}" for axis in AXES)
# Two recordings begin at the same place where they differ by less than this share of the distance to the declared one.
MAX_START_DIFFERENCE_SHARE = 0.1


def with_declared_start(
    context: IdentificationContext, selection: SelectionResult
) -> tuple[IdentificationContext, SelectionResult]:
    """A context whose data start as declared, and a selection with a sensor offset, where that explains as much.

    Both as they are where it does not, or where the recordings do not begin at one place away from the declared start.
    The offset is tried beside as few of the selected effects as possible, and judged on validation data.
    """
    distance = _distance_from_declared_start(context)
    is_adequate = _leaves_white_residuals(context, selection.fit.robot, selection.accepted)
    if distance is None or (is_adequate and not selection.accepted):
        return context, selection
    validation = context.split.validation
    log_likelihood = context.fitter.log_likelihood(selection.fit.robot, selection.accepted, validation)
    for kept in _parts(selection.accepted):
        alternative = _fit_from_declared_start(context, selection, kept, distance)
        if alternative is None or not (is_adequate or alternative.leaves_white_residuals):
            continue
        if alternative.log_likelihood - log_likelihood > _required_gain(context, selection, alternative.chosen, kept):
            return alternative.context, _selection_with(context, selection, alternative, kept)
    return context, selection


@dataclass(frozen=True)
class _Alternative:
    """A fit with a sensor offset to data that start as declared."""

    context: IdentificationContext
    chosen: tuple[Hypothesis, ...]
    fit: Fit

    @property
    def log_likelihood(self) -> float:
        return self.context.fitter.log_likelihood(self.fit.robot, self.chosen, self.context.split.validation)

    @property
    def leaves_white_residuals(self) -> bool:
        return _leaves_white_residuals(self.context, self.fit.robot, self.chosen)


def _distance_from_declared_start(context: IdentificationContext) -> NDArray[np.float64] | None:
    """By how much both recordings begin away from the declared start (3,), in m; None where one does not."""
    declared = context.robot.platform.start
    first, second = (np.subtract(data.start, declared) for data in (context.split.estimation, context.split.validation))
    noise = START_SIGNIFICANCE * (2.0 / MAX_START_SAMPLES) ** 0.5 * context.fitter.noise.position
    tolerance = noise + MAX_START_DIFFERENCE_SHARE * float(np.linalg.norm(first))
    if not np.any(first) or not np.any(second) or np.linalg.norm(first - second) > tolerance:
        return None
    return np.asarray(first, dtype=float)


def _leaves_white_residuals(context: IdentificationContext, robot: Robot, chosen: Sequence[Hypothesis]) -> bool:
    """Whether a model leaves white residuals, as any does beside a disturbance."""
    if context.fitter.has_disturbance:
        return True
    validation = context.split.validation
    innovations = context.fitter.judged(robot, chosen, validation)
    return residuals_are_white(innovations, validation.rows, context.policy.residual_analysis)


def _parts(accepted: Sequence[Hypothesis]) -> Iterator[tuple[Hypothesis, ...]]:
    """All parts of the accepted hypotheses, the smallest first."""
    return chain.from_iterable(combinations(accepted, size) for size in range(len(accepted) + 1))


def _fit_from_declared_start(
    context: IdentificationContext,
    selection: SelectionResult,
    kept: Sequence[Hypothesis],
    distance: NDArray[np.float64],
) -> _Alternative | None:
    """Fit of the kept hypotheses and an offset, which begins at the distance; None where there is none."""
    own = next((h for h in kept if h.effect is SENSOR_OFFSET), None)
    cables, form = (own.cables, own.form) if own else (context.robot.cable_numbers, ())
    offset = Hypothesis(SENSOR_OFFSET, cables, tuple(dict.fromkeys((*form, *OFFSET_FORM))))
    others = [h for h in kept if h is not own]
    start = context.robot
    for hypothesis in others:
        start = start.with_effect(setting_of(selection.fit.robot, hypothesis))
    values = dict(setting_of(selection.fit.robot, own).values) if own else {}
    values |= dict(zip(OFFSET_FORM, distance.tolist(), strict=True))
    start = start.with_effect(EffectSetting(offset.effect.name, offset.effect.completed_values(values), cables))
    declared, split = context.robot.platform.start, context.split
    data = (replace(split.estimation, start=declared), replace(split.validation, start=declared))
    context = replace(context, split=replace(split, estimation=data[0], validation=data[1]))
    chosen = (*others, offset)
    try:
        fit = context.fitter.fit_from([start], chosen, context.split.estimation, -inf)
        context, fit = with_disturbance_beside(context, chosen, fit)
    except (UnreachableError, NoFitError):
        return None
    return _Alternative(context, chosen, fit)


def _required_gain(
    context: IdentificationContext,
    selection: SelectionResult,
    chosen: Sequence[Hypothesis],
    kept: Sequence[Hypothesis],
) -> float:
    """Nats on validation data that an alternative has to gain, by its parameters without the start's coordinates."""
    sizes = [sum(len(h.form) for h in hypotheses) for hypotheses in (chosen, selection.accepted)]
    extra_parameters = sizes[0] - len(OFFSET_FORM) - sizes[1]
    dropped = [e for h, e in zip(selection.accepted, selection.evidence, strict=True) if h not in kept]
    tie = context.policy.selection.tie(max(dropped, default=0.0), context.fitter.has_disturbance)
    if extra_parameters > 0:
        return context.evidence_threshold()
    return tie if extra_parameters == 0 else -tie


def _selection_with(
    context: IdentificationContext, selection: SelectionResult, alternative: _Alternative, kept: Sequence[Hypothesis]
) -> SelectionResult:
    """The selection replaced by an alternative; what was dropped for the offset explains as much from elsewhere."""
    start = context.robot
    for hypothesis in kept:
        start = start.with_effect(setting_of(selection.fit.robot, hypothesis))
    without = maximised_validation_likelihood(context, start, kept, -inf)
    evidences = dict(zip(selection.accepted, selection.evidence, strict=True))
    dropped = tuple(h.effect.name for h in selection.accepted if h not in kept and h.effect is not SENSOR_OFFSET)
    names = {h.effect.name for h in kept}
    return replace(
        selection,
        accepted=alternative.chosen,
        evidence=tuple(evidences.get(h, alternative.log_likelihood - without) for h in alternative.chosen),
        fit=alternative.fit,
        confusable=(
            *(pair for pair in selection.confusable if pair[0] in names),
            *([(SENSOR_OFFSET.name, *dropped)] if dropped else []),
        ),
        disturbance=alternative.context.fitter.noise.disturbance,
    )
