"""Tests confusable alternatives to the selected effects.

They are known effects that are not on the list, and larger forms of fewer effects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations
from math import inf, log

from tautwire_fmu.laws.effects import UNLISTED

from ..errors import UnreachableError
from ..robot.schema import EffectSetting, Robot
from .candidate_scores import TIE_NATS, setting_of
from .estimation_data import DataSet, DataSplit
from .hypotheses import Hypothesis, hypotheses, with_hypothesis, with_larger_forms
from .parameter_fit import FINE_COST_TOLERANCE, Fit, Fitter, NoFitError
from .residual_analysis import residuals_are_white
from .stepwise_selection import COARSE_COST_TOLERANCE, COARSE_TIE_NATS, COARSE_TIE_SHARE, SelectionResult

Progress = Callable[[str, float], None]


def replace_by_confusable_models(
    robot: Robot, selection: SelectionResult, fitter: Fitter, split: DataSplit, alpha: float, progress: Progress
) -> SelectionResult:
    """The selection, or one with a confusable model instead: an unlisted effect or a larger form of one effect.

    The alternative has to explain more with no more parameters, or as much with fewer. Where the selection leaves more
    than noise, an unlisted effect is tried beside it too, and has to leave noise. Judged on validation data.
    """
    validation = split.validation
    is_adequate = residuals_are_white(
        fitter.judged(selection.fit.robot, selection.accepted, validation), validation.rows
    )
    if is_adequate and not selection.accepted:
        return selection
    threshold = log((len(hypotheses(robot)) + 1) / alpha)
    best, log_likelihood = selection, _log_likelihood(fitter, selection.fit, selection.accepted, validation)
    alternatives = [*_unlisted_alternatives(robot, selection.accepted, is_adequate), *_larger_forms(selection.accepted)]
    for number, chosen in enumerate(alternatives):
        progress(f"rivals: {chosen[-1].label(robot)}", number / len(alternatives))
        fit = _fit_alternative(robot, selection, chosen, fitter, split)
        if fit is None or not (
            is_adequate or residuals_are_white(fitter.judged(fit.robot, chosen, validation), validation.rows)
        ):
            continue
        gain = _log_likelihood(fitter, fit, chosen, validation) - log_likelihood
        extra_parameters = _parameter_count(chosen) - _parameter_count(best.accepted)
        if gain > (-TIE_NATS if extra_parameters < 0 else TIE_NATS if extra_parameters == 0 else threshold):
            log_likelihood += gain
            best = _with_alternative(
                selection,
                chosen,
                fit,
                log_likelihood - _log_likelihood_without_last(robot, fit, chosen, fitter, validation),
            )
    return best


def _larger_forms(accepted: Sequence[Hypothesis]) -> Iterator[tuple[Hypothesis, ...]]:
    """One more form of each accepted effect beside parts of the others."""
    for old in accepted:
        others = [hypothesis for hypothesis in accepted if hypothesis is not old]
        for size in range(len(others)):
            for part in combinations(others, size):
                for larger in with_larger_forms([old]):
                    yield (*part, larger)


def _unlisted_alternatives(
    robot: Robot, accepted: Sequence[Hypothesis], is_adequate: bool
) -> Iterator[tuple[Hypothesis, ...]]:
    """Each unlisted effect beside parts of the accepted ones; beside all only where these leave more than noise."""
    max_size = len(accepted) - 1 if is_adequate else len(accepted)
    parts = list(chain.from_iterable(combinations(accepted, size) for size in range(max_size + 1)))
    cable_groups = dict.fromkeys(
        [robot.cable_numbers, *(hypothesis.cables for hypothesis in accepted if hypothesis.cables)]
    )
    for effect in UNLISTED:
        for cables in cable_groups:
            for part in parts:
                yield tuple(with_hypothesis(part, Hypothesis(effect, cables)))


def _fit_alternative(
    robot: Robot, selection: SelectionResult, chosen: Sequence[Hypothesis], fitter: Fitter, split: DataSplit
) -> Fit | None:
    """Fit of an alternative to all samples; None where a fit to a part of them stays far below the selection."""
    head = split.estimation.head
    start = robot
    for hypothesis in chosen:
        start = start.with_effect(_start_setting(robot, selection, hypothesis))
    reference = _log_likelihood(fitter, selection.fit, selection.accepted, head)
    try:
        coarse_fit = fitter.fit_from([start], chosen, head, -inf, COARSE_COST_TOLERANCE)
        if _log_likelihood(fitter, coarse_fit, chosen, head) < reference - COARSE_TIE_NATS - COARSE_TIE_SHARE * abs(
            reference
        ):
            return None
        return fitter.fit_from([coarse_fit.robot], chosen, split.estimation, -inf, FINE_COST_TOLERANCE)
    except (UnreachableError, NoFitError):
        return None


def _start_setting(robot: Robot, selection: SelectionResult, hypothesis: Hypothesis) -> EffectSetting:
    """Start of a fit: values that the selection has for the same effect are used."""
    start = hypothesis.setting(robot)
    for old in selection.accepted:
        if (old.effect, old.cables) == (hypothesis.effect, hypothesis.cables):
            fitted_values = setting_of(selection.fit.robot, old).values
            return replace(start, values={**start.values, **{name: fitted_values[name] for name in old.form}})
    return start


def _log_likelihood(fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], data: DataSet) -> float:
    return fitter.judged(fit.robot, chosen, data).log_likelihood(data.rows)


def _parameter_count(chosen: Sequence[Hypothesis]) -> int:
    return sum(len(hypothesis.form) for hypothesis in chosen)


def _log_likelihood_without_last(
    robot: Robot, fit: Fit, chosen: Sequence[Hypothesis], fitter: Fitter, validation: DataSet
) -> float:
    """Log-likelihood of the validation data under the others at their best there; -inf where they cannot be run."""
    others = chosen[:-1]
    for hypothesis in others:
        robot = robot.with_effect(setting_of(fit.robot, hypothesis))
    try:
        best = fitter.fit_from([robot], others, validation, -inf) if others else replace(fit, robot=robot)
        return _log_likelihood(fitter, best, others, validation)
    except (UnreachableError, NoFitError):
        return -inf


def _with_alternative(
    selection: SelectionResult, chosen: Sequence[Hypothesis], fit: Fit, evidence: float
) -> SelectionResult:
    """The selection replaced by the chosen hypotheses, with the evidence of the last of them."""
    evidences = [
        selection.evidence[selection.accepted.index(h)] if h in selection.accepted else evidence for h in chosen
    ]
    names = {hypothesis.effect.name for hypothesis in chosen}
    confusable = tuple(pair for pair in selection.confusable if pair[0] in names)
    return replace(selection, accepted=tuple(chosen), evidence=tuple(evidences), fit=fit, confusable=confusable)
