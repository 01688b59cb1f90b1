"""Forward selection of a few formula terms by the first-order effect of each on the innovations.

Terms are added one by one, each time the one that most reduces the sum of squares beside those selected, while the gain
exceeds the extended Bayesian information criterion; then each is exchanged where another reduces it more.

Source: Chen, Billings and Luo (1989), Orthogonal least squares methods and their application to non-linear system
identification, Int. J. Control 50(5), 1873-1896; Chen and Chen (2008), Extended Bayesian information criteria for
model selection with large model spaces, Biometrika 95(3), 759-771.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray

from ...robot.schema import Robot
from ...robot.symbolic_model import FORMULA_INDEX
from ..estimation_data import DataSet
from ..filter_linearisation import linearise_filter
from ..hypotheses import Hypothesis, free_parameters
from ..parameter_fit import Fitter
from ..policy import DEFAULT_POLICY
from .candidate_terms import SignalRanges, Term, signal_ranges
from .formula_ports import FormulaPorts, PortSignals, sensitivities_along_run
from .policy import FormulaPolicy

Array = NDArray[np.float64]

# Least share of a term's squared slopes that is linearly independent of the other terms.
MIN_INDEPENDENT_RATIO = 1e-6
RANK_TOLERANCE = 1e-12


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations of the whitened innovations ``e`` by nuisance parameters, then by each term.

    With slopes ``J``: ``fisher_information`` is ``J' J``, ``score`` ``J' e``; ``observation_count`` the number of
    innovations.
    """

    nuisance_count: int
    terms: tuple[Term, ...]
    fisher_information: Array
    score: Array
    observation_count: int


def run_signal_ranges(robot: Robot, accepted: Sequence[Hypothesis], fitter: Fitter, sample: DataSet) -> SignalRanges:
    """Ranges of the signals that formulas may use, along the run of a model over a recording."""
    likelihood, values = fitter.likelihood(robot, accepted, sample)
    ports = FormulaPorts(sample.placed(robot), likelihood.model.state_names)
    return signal_ranges([ports.signals(run) for run in linearise_filter(likelihood, values, sample.recording)])


def term_normal_equations(
    robot: Robot, accepted: Sequence[Hypothesis], terms: Sequence[Term], fitter: Fitter, sample: DataSet
) -> NormalEquations:
    """Normal equations of terms added to a robot; the nuisances are the parameters of the accepted hypotheses."""
    likelihood, values = fitter.likelihood(robot, accepted, sample)
    free = free_parameters(robot, accepted)
    nuisance_columns = [index for index, parameter in enumerate(free) if parameter.effect_index != FORMULA_INDEX]
    ports = FormulaPorts(sample.placed(robot), likelihood.model.state_names)
    size = len(nuisance_columns) + len(terms)
    fisher_information, score, count = np.zeros((size, size)), np.zeros(size), 0
    segments = linearise_filter(likelihood, values, sample.recording)

    def series_in(signals: PortSignals, first_sample: int) -> list[Array]:
        return _term_series(terms, signals)

    for run in sensitivities_along_run(segments, ports, [term.site for term in terms], series_in, sample.rows):
        fitter.poll_interrupts()
        segment, rows = run.segment, run.rows
        matrix = np.concatenate([segment.sensitivities[:, :, nuisance_columns], run.sensitivities], axis=2)[rows]
        is_observed = segment.observed[rows]
        fisher_information += matrix[is_observed].T @ matrix[is_observed]
        score += matrix[is_observed].T @ segment.values[rows][is_observed]
        count += int(np.sum(is_observed))
    is_finite = np.isfinite(np.diag(fisher_information))
    fisher_information = np.where(np.outer(is_finite, is_finite), fisher_information, 0.0)
    return NormalEquations(
        len(nuisance_columns), tuple(terms), fisher_information, np.where(is_finite, score, 0.0), count
    )


def _term_series(terms: Sequence[Term], signals: PortSignals) -> list[Array]:
    """Series of each term: (1, K + 1) on the platform, else a row for each of its cables."""
    return [
        np.array([term.series(signals.ropes[cable - 1]) for cable in term.cables])
        if term.cables
        else term.series(signals.platform)[None, :]
        for term in terms
    ]


def select_terms(
    equations: NormalEquations,
    present: dict[Term, float],
    poll_interrupts: Callable[[], None],
    policy: FormulaPolicy = DEFAULT_POLICY.discovery.formulas,
) -> dict[Term, float]:
    """Select the few terms that explain most, with coefficients; ``present`` are those that the run had already."""
    present_coefficients = np.array([present.get(term, 0.0) for term in equations.terms])
    # The score as it would be without the present terms.
    score = equations.score - equations.fisher_information[:, equations.nuisance_count :] @ present_coefficients
    min_gain = 0.5 * log(max(equations.observation_count, 2)) + log(max(len(equations.terms), 1))
    selected: list[int] = []
    while len(selected) < policy.max_terms:
        gains = _gains(equations, score, selected)
        best = int(np.argmax(gains))
        if gains[best] < min_gain:
            break
        selected.append(best)
        poll_interrupts()
    for number in range(policy.max_exchanges if len(selected) > 1 else 0):
        index = number % len(selected)
        kept_terms = [*selected[:index], *selected[index + 1 :]]
        gains = _gains(equations, score, kept_terms)
        best = int(np.argmax(gains))
        if gains[best] > gains[selected[index]] * (1.0 + MIN_INDEPENDENT_RATIO):
            selected[index] = best
    coefficients = _solve_coefficients(equations, score, selected)
    return {equations.terms[term]: float(c) for term, c in zip(selected, coefficients, strict=True)}


def _column_indices(equations: NormalEquations, selected: Sequence[int]) -> list[int]:
    """Columns of the nuisances and of the selected terms."""
    return [*range(equations.nuisance_count), *(equations.nuisance_count + term for term in selected)]


def _gains(equations: NormalEquations, score: Array, selected: Sequence[int]) -> Array:
    """Predicted gain in nats of each term beside the nuisances and the selected terms (score test)."""
    columns, nuisance_count = _column_indices(equations, selected), equations.nuisance_count
    information = equations.fisher_information
    diagonal = np.diag(information)[nuisance_count:]
    residual_information, residual_score = diagonal.copy(), score[nuisance_count:].copy()
    if columns:
        inner, scale = _scaled_block(information, columns)
        cross_products = information[np.ix_(columns, range(nuisance_count, len(information)))] / scale[:, None]
        projection = np.linalg.lstsq(
            inner, np.column_stack([cross_products, score[columns] / scale]), rcond=RANK_TOLERANCE
        )[0]
        residual_information = residual_information - np.sum(cross_products * projection[:, :-1], axis=0)
        residual_score = residual_score - cross_products.T @ projection[:, -1]
    is_independent = residual_information > MIN_INDEPENDENT_RATIO * diagonal
    gains: Array = np.where(
        is_independent, 0.5 * residual_score**2 / np.where(is_independent, residual_information, 1.0), 0.0
    )
    return gains


def _solve_coefficients(equations: NormalEquations, score: Array, selected: Sequence[int]) -> Array:
    """Coefficients of the selected terms by least squares."""
    columns = _column_indices(equations, selected)
    inner, scale = _scaled_block(equations.fisher_information, columns)
    coefficients: Array = -np.linalg.lstsq(inner, score[columns] / scale, rcond=RANK_TOLERANCE)[0] / scale
    return coefficients[equations.nuisance_count :]


def _scaled_block(information: Array, columns: Sequence[int]) -> tuple[Array, Array]:
    """The information of some columns, scaled to a diagonal of one, and the scale."""
    scale = np.sqrt(np.maximum(np.diag(information)[columns], np.finfo(float).tiny))
    return information[np.ix_(columns, columns)] / np.outer(scale, scale), scale
