"""Sparse regression of a formula for what no known effect explains, found on some samples and judged on others.

Each round linearises the filter's run with the formula so far, selects the few candidate terms that explain most of the
residual without it, and fits their coefficients and shape parameters to the exact model.

Source: Brunton, Proctor and Kutz (2016), Discovering governing equations from data by sparse identification of
nonlinear dynamical systems, PNAS 113(15), 3932-3937; here on innovations, since measured positions are noisy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, log

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ...errors import UnreachableError
from ...robot.schema import Formula, Robot
from ..estimation_data import DataSet, DataSplit
from ..hypotheses import Hypothesis
from ..innovations import Innovations
from ..parameter_fit import Fit, Fitter, NoFitError
from ..policy import DEFAULT_POLICY
from ..residual_analysis import residuals_are_white
from ..residual_spectrum import spectral_lines
from .candidate_terms import Term, candidate_terms, numeric_formulas, parametrised_formulas, shape_names
from .policy import DiscoveryPolicy, FormulaPolicy
from .term_selection import run_signal_ranges, select_terms, term_normal_equations

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

# Errors of infeasible formulas: a force that the ropes cannot hold, a slope that is not finite.
INFEASIBLE_MODEL_ERRORS = (UnreachableError, NoFitError, np.linalg.LinAlgError)


@dataclass(frozen=True)
class Discovery:
    """A robot with the ``formulas`` that it lacked, validated on the data that did not find them.

    ``log_likelihood_gain`` is the log-likelihood on the judging samples over that of the model without formulas fitted
    there, ``novel_gain`` over that with those terms alone that resemble known effects. ``residuals_are_white`` holds on
    both sets of samples.
    """

    robot: Robot
    formulas: tuple[Formula, ...]
    log_likelihood_gain: float
    novel_gain: float
    residuals_are_white: bool

    def is_accepted(self, threshold: float, policy: FormulaPolicy = DEFAULT_POLICY.discovery.formulas) -> bool:
        """Whether the formula is significant, and more than known effects by another name."""
        return self.log_likelihood_gain > threshold and self.novel_gain > max(
            threshold, policy.min_novel_gain_ratio * self.log_likelihood_gain
        )


@dataclass(frozen=True)
class _FormulaFit:
    """Terms with coefficients, the fitted robot, and the information criterion on the fitting samples."""

    terms: dict[Term, float]
    fit: Fit
    criterion: float


@dataclass(frozen=True)
class _Search:
    """A search for a formula beside the accepted hypotheses."""

    accepted: Sequence[Hypothesis]
    fitter: Fitter
    policy: DiscoveryPolicy

    def innovations(self, robot: Robot, data: DataSet) -> Innovations:
        """Innovations of a robot on a data set, with its effects and formulas as they are."""
        return self.fitter.judged(robot, self.accepted, data)

    def is_white(self, robot: Robot, data: DataSet) -> bool:
        """Whether a robot leaves white residuals on a data set."""
        return residuals_are_white(self.innovations(robot, data), data.rows)

    def log_likelihood(self, robot: Robot, data: DataSet) -> float:
        """Log-likelihood of the samples of a data set that count."""
        return self.innovations(robot, data).log_likelihood(data.rows)


@threadpool_limits.wrap(limits=1)
def discover_formula(
    base: Robot,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    split: DataSplit,
    progress: Progress,
    policy: DiscoveryPolicy = DEFAULT_POLICY.discovery,
) -> Discovery | None:
    """Discover a formula beside the accepted hypotheses; None where no term explains anything."""
    search, data, max_rounds = _Search(accepted, fitter, policy), split.estimation, policy.formulas.max_rounds
    without_terms = _FormulaFit({}, Fit(base, (), np.zeros(0), np.zeros((0, 0))), -inf)
    best = _with_criterion(search, without_terms, data)
    for number in range(1, max_rounds + 1):
        progress(f"searching for a formula, round {number}", (number - 1) / max_rounds)
        previous = best
        try:
            candidate = _select_and_fit(search, previous, data)
        except INFEASIBLE_MODEL_ERRORS:
            break
        if candidate is None or candidate.criterion <= previous.criterion:
            break
        best = candidate
        if search.is_white(best.fit.robot, data):
            break
    progress("searching for a formula", 1.0)
    return _validate(search, base, best, split) if best.terms else None


def _with_criterion(search: _Search, formula: _FormulaFit, data: DataSet) -> _FormulaFit:
    """With its information criterion: log-likelihood less ``log(N) / 2`` for each parameter."""
    innovations = search.innovations(formula.fit.robot, data)
    count = int(np.sum(innovations.observed[data.rows]))
    penalty = 0.5 * log(max(count, 2)) * len(formula.fit.free)
    return replace(formula, criterion=innovations.log_likelihood(data.rows) - penalty)


def _select_and_fit(search: _Search, previous: _FormulaFit, data: DataSet) -> _FormulaFit | None:
    """Terms selected anew under the previous formula and fitted; equal shapes merge, insignificant terms go."""
    robot, policy = previous.fit.robot, search.policy.formulas
    terms = _select_terms(search, previous, data)
    if not terms:
        return None
    candidate = _fit_terms(search, robot, terms, previous, data, search.log_likelihood(robot, data))
    merged = _merge_equal_shapes(candidate, policy.equal_shape_sigmas)
    if len(shape_names(list(merged))) < len(shape_names(list(candidate.terms))):
        candidate = _fit_terms(search, candidate.fit.robot, merged, candidate, data)
    insignificant = _least_significant_term(candidate, policy.min_coefficient_sigmas)
    while insignificant and len(candidate.terms) > 1:
        remaining_terms = {term: c for term, c in candidate.terms.items() if term != insignificant}
        candidate = _fit_terms(search, candidate.fit.robot, remaining_terms, candidate, data)
        insignificant = _least_significant_term(candidate, policy.min_coefficient_sigmas)
    return _with_criterion(search, candidate, data)


def _select_terms(search: _Search, previous: _FormulaFit, data: DataSet) -> dict[Term, float]:
    """The few candidate terms that explain most of the residual without the previous ones, with coefficients."""
    robot, accepted, fitter, policy = previous.fit.robot, search.accepted, search.fitter, search.policy
    first_data = data.first(policy.formulas.max_selection_samples)
    frequencies = spectral_lines(data.recording.time, search.innovations(robot, data), data.rows, policy.spectral_lines)
    candidates = candidate_terms(robot, run_signal_ranges(robot, accepted, fitter, first_data), frequencies)
    terms = tuple(dict.fromkeys((*previous.terms, *candidates)))
    equations = term_normal_equations(robot, accepted, terms, fitter, first_data)
    return select_terms(equations, previous.terms, fitter.poll_interrupts, policy.formulas)


def _fit_terms(
    search: _Search,
    robot: Robot,
    terms: dict[Term, float],
    previous: _FormulaFit,
    data: DataSet,
    min_log_likelihood: float = -inf,
) -> _FormulaFit:
    """Fit the terms' coefficients and shapes, and the accepted hypotheses' parameters, to the exact model."""
    begin = previous.terms
    fixed_formulas = tuple(formula for formula in robot.formulas if not formula.numbers)
    steps = [
        {term: begin.get(term, 0.0) + fraction * (c - begin.get(term, 0.0)) for term, c in terms.items()}
        for fraction in search.policy.formulas.step_fractions
    ]
    starts = [replace(robot, formulas=(*fixed_formulas, *parametrised_formulas(step))) for step in steps]
    fit = search.fitter.fit_from(starts, search.accepted, data, min_log_likelihood)
    numbers = _formula_numbers(fit.robot.formulas)
    names = shape_names(list(terms))
    fitted_terms = {
        replace(term, shape=numbers[names[term.family, term.shape]] if term.family else 0.0): numbers[f"c{index}"]
        for index, term in enumerate(terms, start=1)
    }
    return _FormulaFit(fitted_terms, fit, -inf)


def _merge_equal_shapes(formula: _FormulaFit, equal_sigmas: float) -> dict[Term, float]:
    """Terms with shape parameters merged that do not differ significantly."""
    deviations = _standard_deviations(formula)
    distinct: dict[tuple[str, float], float] = {}
    for (family, shape), name in shape_names(list(formula.terms)).items():
        matches = [
            (f, s)
            for f, s in distinct
            if f == family and abs(s - shape) < equal_sigmas * max(deviations[name], distinct[f, s])
        ]
        distinct.setdefault(matches[0] if matches else (family, shape), deviations[name])
        if matches:
            replacements = {
                t: replace(t, shape=matches[0][1]) for t in formula.terms if (t.family, t.shape) == (family, shape)
            }
            formula = replace(formula, terms={replacements.get(t, t): c for t, c in formula.terms.items()})
    return formula.terms


def _formula_numbers(formulas: Sequence[Formula]) -> dict[str, float]:
    return {name: float(value) for formula in formulas for name, value in formula.numbers.items()}


def _standard_deviations(formula: _FormulaFit) -> dict[str, float]:
    return {free.name: float(d) for free, d in zip(formula.fit.free, formula.fit.standard_deviations, strict=True)}


def _least_significant_term(formula: _FormulaFit, min_sigmas: float) -> Term | None:
    """The term with the least significant coefficient; None where that is significant too."""
    deviations = _standard_deviations(formula)
    significances = {
        term: abs(c) / max(deviations[f"c{i}"], 1e-300) for i, (term, c) in enumerate(formula.terms.items(), start=1)
    }
    weakest = min(significances, key=lambda term: significances[term])
    return weakest if significances[weakest] < min_sigmas else None


def _validate(search: _Search, base: Robot, best: _FormulaFit, split: DataSplit) -> Discovery | None:
    """Validate the formula with rounded numbers on the samples that did not find it; None where it is infeasible."""
    formulas = numeric_formulas(best.terms, _standard_deviations(best))
    robot = replace(best.fit.robot, formulas=(*base.formulas, *formulas))
    validation = split.validation
    try:
        innovations = search.innovations(robot, validation)
        is_white = residuals_are_white(innovations, validation.rows) and search.is_white(robot, split.estimation)
        reference = _reference_log_likelihood(search, base, validation)
        known = _log_likelihood_of_known_terms(search, best, validation, reference)
    except INFEASIBLE_MODEL_ERRORS:
        return None
    log_likelihood = innovations.log_likelihood(validation.rows)
    return Discovery(robot, formulas, log_likelihood - reference, log_likelihood - known, is_white)


def _reference_log_likelihood(search: _Search, base: Robot, validation: DataSet) -> float:
    """Log-likelihood of validation data without formulas, with the accepted hypotheses fitted there."""
    accepted = search.accepted
    robot = search.fitter.fit_from([base], accepted, validation, -inf).robot if accepted else base
    return search.log_likelihood(robot, validation)


def _log_likelihood_of_known_terms(
    search: _Search, best: _FormulaFit, validation: DataSet, reference_log_likelihood: float
) -> float:
    """Log-likelihood of validation data under the terms alone that resemble known effects, fitted there."""
    known_terms = {term: c for term, c in best.terms.items() if term.resembles_effect}
    if len(known_terms) == len(best.terms):
        return inf
    if not known_terms:
        return reference_log_likelihood
    fitted = _fit_terms(search, best.fit.robot, known_terms, best, validation)
    return max(reference_log_likelihood, search.log_likelihood(fitted.fit.robot, validation))
