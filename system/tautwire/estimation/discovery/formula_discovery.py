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
from ..parameter_fit import Fit, Fitter, NoFitError
from ..residual_analysis import residuals_are_white
from ..residual_spectrum import spectral_lines
from .candidate_terms import Term, candidate_terms, numeric_formulas, parametrised_formulas, shape_names
from .term_selection import run_signal_ranges, select_terms, term_normal_equations

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

MAX_ROUNDS = 3
# Errors of infeasible formulas: a force that the ropes cannot hold, a slope that is not finite.
INFEASIBLE_MODEL_ERRORS = (UnreachableError, NoFitError, np.linalg.LinAlgError)
# Terms are selected on the first so many samples, and fitted to all.
MAX_SELECTION_SAMPLES = 10_000
# Fractions of the linear step at which a fit may start.
STEP_FRACTIONS = (1.0, 0.3)
# Standard deviations by which a coefficient has to differ from zero.
MIN_COEFFICIENT_SIGMAS = 4.0
# Standard deviations within which two shape parameters count as equal.
EQUAL_SHAPE_SIGMAS = 4.0
# Least share of a formula's gain that no term resembling a known effect achieves.
MIN_NOVEL_GAIN_RATIO = 0.05


@dataclass(frozen=True)
class Discovery:
    """A robot with the ``formulas`` that it lacked, validated on the samples that did not find them.

    ``log_likelihood_gain`` is the log-likelihood on the judging samples over that of the model without formulas fitted
    there, ``novel_gain`` over that with those terms alone that resemble known effects. ``residuals_are_white`` holds on
    both sets of samples.
    """

    robot: Robot
    formulas: tuple[Formula, ...]
    log_likelihood_gain: float
    novel_gain: float
    residuals_are_white: bool

    def is_accepted(self, threshold: float) -> bool:
        """Whether the formula is significant, and more than known effects by another name."""
        return self.log_likelihood_gain > threshold and self.novel_gain > max(
            threshold, MIN_NOVEL_GAIN_RATIO * self.log_likelihood_gain
        )


@dataclass(frozen=True)
class _FormulaFit:
    """Terms with coefficients, the fitted robot, and the information criterion on the fitting samples."""

    terms: dict[Term, float]
    fit: Fit
    criterion: float


@threadpool_limits.wrap(limits=1)
def discover_formula(
    base: Robot, accepted: Sequence[Hypothesis], fitter: Fitter, evidence: DataSplit, progress: Progress
) -> Discovery | None:
    """Discover a formula beside the accepted hypotheses; None where no term explains anything."""
    sample = evidence.estimation
    best = _with_criterion(fitter, _without_terms(base), accepted, sample)
    for number in range(1, MAX_ROUNDS + 1):
        progress(f"searching for a formula, round {number}", (number - 1) / MAX_ROUNDS)
        previous = best
        try:
            candidate = _select_and_fit(previous, accepted, fitter, sample)
        except INFEASIBLE_MODEL_ERRORS:
            break
        if candidate is None or candidate.criterion <= previous.criterion:
            break
        best = candidate
        if residuals_are_white(fitter.judged(best.fit.robot, accepted, sample), sample.rows):
            break
    progress("searching for a formula", 1.0)
    return _validate(base, best, accepted, fitter, evidence) if best.terms else None


def _without_terms(base: Robot) -> _FormulaFit:
    return _FormulaFit({}, Fit(base, (), np.zeros(0), np.zeros((0, 0))), -inf)


def _with_criterion(fitter: Fitter, state: _FormulaFit, accepted: Sequence[Hypothesis], sample: DataSet) -> _FormulaFit:
    """With its information criterion: log-likelihood less ``log(N) / 2`` for each parameter."""
    innovations = fitter.judged(state.fit.robot, accepted, sample)
    count = int(np.sum(innovations.observed[sample.rows]))
    penalty = 0.5 * log(max(count, 2)) * len(state.fit.free)
    return replace(state, criterion=innovations.log_likelihood(sample.rows) - penalty)


def _select_and_fit(
    previous: _FormulaFit, accepted: Sequence[Hypothesis], fitter: Fitter, sample: DataSet
) -> _FormulaFit | None:
    robot = previous.fit.robot
    frequencies = spectral_lines(sample.recording.time, fitter.judged(robot, accepted, sample), sample.rows)
    terms = candidate_terms(
        robot, run_signal_ranges(robot, accepted, fitter, sample.first(MAX_SELECTION_SAMPLES)), frequencies
    )
    terms = tuple(dict.fromkeys((*previous.terms, *terms)))
    slopes = term_normal_equations(robot, accepted, terms, fitter, sample.first(MAX_SELECTION_SAMPLES))
    selected = select_terms(slopes, previous.terms, fitter.poll_interrupts)
    if not selected:
        return None
    min_log_likelihood = fitter.judged(robot, accepted, sample).log_likelihood(sample.rows)
    candidate = _fit_terms(robot, selected, previous, accepted, fitter, sample, min_log_likelihood)
    merged = _merge_equal_shapes(candidate)
    if len(shape_names(list(merged))) < len(shape_names(list(candidate.terms))):
        candidate = _fit_terms(candidate.fit.robot, merged, candidate, accepted, fitter, sample, -inf)
    insignificant = _least_significant_term(candidate)
    while insignificant and len(candidate.terms) > 1:
        remaining_terms = {term: c for term, c in candidate.terms.items() if term != insignificant}
        candidate = _fit_terms(candidate.fit.robot, remaining_terms, candidate, accepted, fitter, sample, -inf)
        insignificant = _least_significant_term(candidate)
    return _with_criterion(fitter, candidate, accepted, sample)


def _fit_terms(
    robot: Robot,
    terms: dict[Term, float],
    previous: _FormulaFit,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    sample: DataSet,
    min_log_likelihood: float,
) -> _FormulaFit:
    """Fit the terms' coefficients and shapes, and the accepted hypotheses' parameters, to the exact model."""
    previous_coefficients = previous.terms
    fixed_formulas = tuple(formula for formula in robot.formulas if not formula.numbers)
    steps = [
        {t: previous_coefficients.get(t, 0.0) + s * (c - previous_coefficients.get(t, 0.0)) for t, c in terms.items()}
        for s in STEP_FRACTIONS
    ]
    starts = [replace(robot, formulas=(*fixed_formulas, *parametrised_formulas(step))) for step in steps]
    fit = fitter.fit_from(starts, accepted, sample, min_log_likelihood)
    numbers = _formula_numbers(fit.robot.formulas)
    names = shape_names(list(terms))
    fitted_terms = {
        replace(term, shape=numbers[names[term.family, term.shape]] if term.family else 0.0): numbers[f"c{index}"]
        for index, term in enumerate(terms, start=1)
    }
    return _FormulaFit(fitted_terms, fit, -inf)


def _merge_equal_shapes(state: _FormulaFit) -> dict[Term, float]:
    """Terms with shape parameters merged that do not differ significantly."""
    deviations = _standard_deviations(state)
    distinct: dict[tuple[str, float], float] = {}
    for (family, shape), name in shape_names(list(state.terms)).items():
        matches = [
            (f, s)
            for f, s in distinct
            if f == family and abs(s - shape) < EQUAL_SHAPE_SIGMAS * max(deviations[name], distinct[f, s])
        ]
        distinct.setdefault(matches[0] if matches else (family, shape), deviations[name])
        if matches:
            replacements = {
                t: replace(t, shape=matches[0][1]) for t in state.terms if (t.family, t.shape) == (family, shape)
            }
            state = replace(state, terms={replacements.get(t, t): c for t, c in state.terms.items()})
    return state.terms


def _formula_numbers(formulas: Sequence[Formula]) -> dict[str, float]:
    return {name: float(value) for formula in formulas for name, value in formula.numbers.items()}


def _standard_deviations(state: _FormulaFit) -> dict[str, float]:
    return {free.name: float(d) for free, d in zip(state.fit.free, state.fit.standard_deviations, strict=True)}


def _least_significant_term(state: _FormulaFit) -> Term | None:
    """The term with the least significant coefficient; None where that is significant too."""
    deviations = _standard_deviations(state)
    significances = {
        term: abs(c) / max(deviations[f"c{i}"], 1e-300) for i, (term, c) in enumerate(state.terms.items(), start=1)
    }
    weakest = min(significances, key=lambda term: significances[term])
    return weakest if significances[weakest] < MIN_COEFFICIENT_SIGMAS else None


def _validate(
    base: Robot, best: _FormulaFit, accepted: Sequence[Hypothesis], fitter: Fitter, evidence: DataSplit
) -> Discovery | None:
    """Validate the formula with rounded numbers on the samples that did not find it; None where it is infeasible."""
    formulas = numeric_formulas(best.terms, _standard_deviations(best))
    robot = replace(best.fit.robot, formulas=(*base.formulas, *formulas))
    fit, judge = evidence.estimation, evidence.validation
    try:
        innovations = fitter.judged(robot, accepted, judge)
        is_white = residuals_are_white(innovations, judge.rows) and residuals_are_white(
            fitter.judged(robot, accepted, fit), fit.rows
        )
        reference_robot = fitter.fit_from([base], accepted, judge, -inf).robot if accepted else base
        reference_log_likelihood = fitter.judged(reference_robot, accepted, judge).log_likelihood(judge.rows)
        known_log_likelihood = _log_likelihood_of_known_terms(
            base, best, accepted, fitter, judge, reference_log_likelihood
        )
    except INFEASIBLE_MODEL_ERRORS:
        return None
    log_likelihood = innovations.log_likelihood(judge.rows)
    return Discovery(
        robot, formulas, log_likelihood - reference_log_likelihood, log_likelihood - known_log_likelihood, is_white
    )


def _log_likelihood_of_known_terms(
    base: Robot,
    best: _FormulaFit,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    judge: DataSet,
    reference_log_likelihood: float,
) -> float:
    """Log-likelihood of the judging samples under the terms alone that resemble known effects, fitted there."""
    known_terms = {term: c for term, c in best.terms.items() if term.resembles_effect}
    if len(known_terms) == len(best.terms):
        return inf
    if not known_terms:
        return reference_log_likelihood
    fitted = _fit_terms(best.fit.robot, known_terms, best, accepted, fitter, judge, -inf)
    log_likelihood = fitter.judged(fitted.fit.robot, accepted, judge).log_likelihood(judge.rows)
    return max(reference_log_likelihood, log_likelihood)
