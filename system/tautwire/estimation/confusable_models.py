"""Tests confusable alternatives to the selected effects.

They are known effects that are not on the list, and larger forms of fewer effects.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations
from math import inf

from tautwire_fmu.laws.effects import UNLISTED

from ..errors import UnreachableError
from ..robot.schema import EffectSetting, Robot
from .candidate_fits import maximised_validation_likelihood
from .candidate_scores import CandidateScore, setting_of
from .hypotheses import Hypothesis, hypotheses, with_hypothesis, with_larger_forms
from .identification_context import IdentificationContext
from .parameter_fit import Fit, NoFitError
from .residual_analysis import residuals_are_white
from .selection_result import SelectionResult, with_disturbance_beside


def replace_by_confusable_models(
    context: IdentificationContext, selection: SelectionResult
) -> tuple[IdentificationContext, SelectionResult]:
    """The selection, or one with a confusable model instead: an unlisted effect or a larger form of one effect.

    The alternative has to explain more with no more parameters, or as much with fewer. Where the selection leaves more
    than noise, an unlisted effect is tried beside it too, and has to leave noise. Judged on validation data.

    Beside a disturbance, which would make up for the form of any of them, only unlisted effects in place of accepted
    ones, each beside a disturbance of its own. One has to be as much better as any effect has to be than none.
    """
    robot, validation = context.robot, context.split.validation
    has_disturbance = context.fitter.has_disturbance
    is_adequate = has_disturbance or _leaves_white_residuals(context, selection.fit.robot, selection.accepted)
    if is_adequate and not selection.accepted:
        return context, selection
    best_context, best = context, selection
    log_likelihood = context.fitter.log_likelihood(selection.fit.robot, selection.accepted, validation)
    searched = hypotheses(robot, has_disturbance)
    unlisted = _unlisted_alternatives(robot, selection.accepted, searched, is_adequate)
    larger_forms = [] if has_disturbance else _larger_forms(selection.accepted, robot)
    alternatives = [*unlisted, *larger_forms]
    for number, chosen in enumerate(alternatives):
        context.progress(f"alternatives: {chosen[-1].label(robot)}", number / len(alternatives))
        fit = _fit_alternative(context, selection, chosen)
        if fit is None or not (is_adequate or _leaves_white_residuals(context, fit.robot, chosen)):
            continue
        beside, fit = with_disturbance_beside(context, chosen, fit)
        gain = beside.fitter.log_likelihood(fit.robot, chosen, validation) - log_likelihood
        if gain > _required_gain(context, _parameter_count(chosen) - _parameter_count(best.accepted)):
            log_likelihood += gain
            evidence = log_likelihood - _log_likelihood_without_last(beside, fit, chosen)
            best_context, best = beside, _with_alternative(beside, selection, chosen, fit, evidence)
    return best_context, best


def _required_gain(context: IdentificationContext, extra_parameters: int) -> float:
    """Gain of log-likelihood for which an alternative with some more parameters is taken."""
    if context.fitter.has_disturbance or extra_parameters > 0:
        return context.evidence_threshold(others=1)
    tie_nats = context.policy.selection.tie_nats
    return tie_nats if extra_parameters == 0 else -tie_nats


def _leaves_white_residuals(context: IdentificationContext, robot: Robot, chosen: Sequence[Hypothesis]) -> bool:
    validation = context.split.validation
    innovations = context.fitter.judged(robot, chosen, validation)
    return residuals_are_white(innovations, validation.rows, context.policy.residual_analysis)


def _larger_forms(accepted: Sequence[Hypothesis], robot: Robot) -> Iterator[tuple[Hypothesis, ...]]:
    """One more form of each accepted effect beside parts of the others."""
    for old in accepted:
        others = [hypothesis for hypothesis in accepted if hypothesis is not old]
        for size in range(len(others)):
            for part in combinations(others, size):
                for larger in with_larger_forms([old], robot):
                    yield (*part, larger)


def _unlisted_alternatives(
    robot: Robot, accepted: Sequence[Hypothesis], searched: Collection[Hypothesis], is_adequate: bool
) -> Iterator[tuple[Hypothesis, ...]]:
    """Each unlisted effect that was not searched for, beside parts of the accepted ones.

    Beside all of them only where these leave more than noise.
    """
    max_size = len(accepted) - 1 if is_adequate else len(accepted)
    parts = list(chain.from_iterable(combinations(accepted, size) for size in range(max_size + 1)))
    cable_groups = dict.fromkeys(
        [robot.cable_numbers, *(hypothesis.cables for hypothesis in accepted if hypothesis.cables)]
    )
    for effect in UNLISTED:
        for cables in cable_groups if effect.component == "cable" else [()]:
            if (hypothesis := Hypothesis(effect, cables)) not in searched:
                yield from (tuple(with_hypothesis(part, hypothesis)) for part in parts)


def _fit_alternative(
    context: IdentificationContext, selection: SelectionResult, chosen: Sequence[Hypothesis]
) -> Fit | None:
    """Fit of an alternative to all samples; None where a fit to a part of them stays far below the selection."""
    fitter, head, start = context.fitter, context.head, context.robot
    for hypothesis in chosen:
        start = start.with_effect(_start_setting(context.robot, selection, hypothesis))
    reference = fitter.log_likelihood(selection.fit.robot, selection.accepted, head)
    min_log_likelihood = reference - context.policy.selection.coarse_tie(reference)
    try:
        coarse_fit = fitter.fit_from([start], chosen, head, -inf, context.policy.fit.coarse_cost_tolerance)
        if fitter.log_likelihood(coarse_fit.robot, chosen, head) < min_log_likelihood:
            return None
        return fitter.fit_from([coarse_fit.robot], chosen, context.split.estimation, -inf)
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


def _parameter_count(chosen: Sequence[Hypothesis]) -> int:
    return sum(len(hypothesis.form) for hypothesis in chosen)


def _log_likelihood_without_last(context: IdentificationContext, fit: Fit, chosen: Sequence[Hypothesis]) -> float:
    """Log-likelihood of the validation data under the others at their best there; -inf where they cannot be run."""
    others, robot = chosen[:-1], context.robot
    for hypothesis in others:
        robot = robot.with_effect(setting_of(fit.robot, hypothesis))
    try:
        return maximised_validation_likelihood(context, robot, others, -inf)
    except (UnreachableError, NoFitError):
        return -inf


def _with_alternative(
    context: IdentificationContext, selection: SelectionResult, chosen: Sequence[Hypothesis], fit: Fit, evidence: float
) -> SelectionResult:
    """The selection replaced by the chosen hypotheses, the last of which has the evidence, as in a round of its own."""
    evidences = [
        selection.evidence[selection.accepted.index(h)] if h in selection.accepted else evidence for h in chosen
    ]
    names = {hypothesis.effect.name for hypothesis in chosen}
    validation = context.split.validation
    mean_square = context.fitter.judged(fit.robot, chosen, validation).overall_mean_square(validation.rows)
    number = 1 + max((candidate.round for candidate in selection.candidates), default=0)
    replacement = CandidateScore(chosen[-1], fit, evidence, mean_square).candidate(number, accepted=True)
    return replace(
        selection,
        accepted=tuple(chosen),
        evidence=tuple(evidences),
        fit=fit,
        candidates=(*selection.candidates, replacement),
        confusable=tuple(pair for pair in selection.confusable if pair[0] in names),
        disturbance=context.fitter.noise.disturbance,
    )
