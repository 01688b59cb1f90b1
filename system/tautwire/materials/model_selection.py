"""Selects a model of the modulus by information criterion and likelihood-ratio tests, and cross-validates it.

Modulus and damping, the constant pair of the paper's law, are in every model that describes the rope; only a delay
between the test's channels may replace damping. Within a family, branches are added as long as the
Bayesian information criterion falls. Of the families without a delay the one with the lowest criterion is selected, and
then loses, by backward elimination, every term that is not significant: chance would improve the fit as much in more
than ``significance_level`` of tables that lack it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from .modulus_fit import MaterialFit, fit_structure, whitened_residuals
from .modulus_observations import ModulusObservations
from .viscoelastic_model import Hysteresis, ModelStructure, branch_variants, complex_modulus

CONSTANT_PAIR = ModelStructure(damping=True)
LINEAR_VISCOELASTIC = ModelStructure(damping=True, branches=1)
# Differences of the criterion from here on are strong evidence (Kass and Raftery 1995).
STRONG_BIC_DIFFERENCE = 6.0
# Measured numbers beyond the free parameters: one remains where cross-validation holds out a row of two.
MIN_DEGREES_OF_FREEDOM = 3

# Leave-one-out up to this number of rows; longer tables are held out in as many interleaved folds.
MAX_FOLDS = 12


@dataclass(frozen=True)
class ModelSelection:
    """Selected model family, among the best fits of every family."""

    best_fits: Mapping[ModelStructure, MaterialFit]
    chosen: ModelStructure

    @property
    def fit(self) -> MaterialFit:
        """The fit of the selected family."""
        return self.best_fits[self.chosen]

    def evidence(self, effect: str) -> float:
        """Log likelihood ratio (natural) to the best model without one effect, other than damping."""
        return 0.5 * (self.best_fits[self.chosen.without(effect)].chi_squared - self.fit.chi_squared)

    def confusable_models(self, significance_level: float) -> tuple[ModelStructure, ...]:
        """Confusable families: their residuals are noise, and the criterion gives no strong evidence against them.

        A family that includes the chosen one, or another confusable one, adds nothing and is left out.
        """
        adequate = [
            family
            for family, fit in self.best_fits.items()
            if not family.includes(self.chosen)
            and fit.p_value >= significance_level
            and fit.bic < self.fit.bic + STRONG_BIC_DIFFERENCE
        ]
        minimal = [
            family for family in adequate if not any(family.includes(other) for other in adequate if other != family)
        ]
        return tuple(sorted(minimal, key=lambda family: self.best_fits[family].bic))


def select_model(
    observations: ModulusObservations,
    significance_level: float,
    progress: Callable[[str, float], None] = lambda what, done: None,
) -> ModelSelection:
    """Fit every model family and select one; ``progress`` receives the present task and the share that is done."""
    best_fits: dict[ModelStructure, MaterialFit] = {}
    families = _model_families(observations)
    for index, family in enumerate(families):
        progress(f"fitting {family.label}", index / len(families))
        plain, *branched = _fits_of_family(observations, family)
        best_fits[family] = plain
        if branched:
            best_fits[branched[0].structure.family] = min(branched, key=lambda fit: fit.bic)
    candidates = [family for family in best_fits if not family.delay]
    chosen = min(candidates, key=lambda family: best_fits[family].bic)
    return ModelSelection(best_fits, _eliminate_backward(observations, best_fits, chosen, significance_level))


def best_linear_fit(observations: ModulusObservations) -> MaterialFit:
    """The best fit of damping and relaxation alone, which is what robot files can hold."""
    return min(_fits_of_family(observations, CONSTANT_PAIR)[1:], key=lambda fit: fit.bic)


def likelihood_ratio_p_value(fit: MaterialFit, reduced: MaterialFit) -> float:
    """P value of the likelihood-ratio test of ``fit`` against the ``reduced`` fit, which lacks some of its terms."""
    gain, added_parameters = reduced.chi_squared - fit.chi_squared, len(fit.values) - len(reduced.values)
    return float(chi2.sf(max(gain, 0.0), added_parameters))


def _model_families(observations: ModulusObservations) -> tuple[ModelStructure, ...]:
    """All model families, without branches."""
    kinds: tuple[Hysteresis, ...] = ("none", "modulus", "stress") if observations.has_amplitude else ("none", "modulus")
    choices = product((False, True), kinds, (False, True))
    return tuple(
        ModelStructure(damping=damping, hysteresis=kind, delay=delay)
        for delay, kind, damping in choices
        if delay or damping
    )


def _fits_of_family(observations: ModulusObservations, family: ModelStructure) -> list[MaterialFit]:
    """Fits of a family with no branch, one, two ... until the criterion rises; the last may be the worse one."""
    fits: list[MaterialFit] = []
    for structure in branch_variants(family, observations.measurement_count - MIN_DEGREES_OF_FREEDOM):
        fits.append(fit_structure(observations, structure))
        if structure.branches > 1 and fits[-1].bic > fits[-2].bic:
            break
    return fits


def _eliminate_backward(
    observations: ModulusObservations,
    best_fits: Mapping[ModelStructure, MaterialFit],
    chosen: ModelStructure,
    significance_level: float,
) -> ModelStructure:
    while True:
        fit = best_fits[chosen]
        # With as many branches the smaller model is nested in the larger, as the test requires.
        p_values = {
            effect: likelihood_ratio_p_value(fit, fit_structure(observations, fit.structure.without(effect)))
            for effect in chosen.effects - {"damping"}
        }
        least_significant = max(p_values, key=lambda effect: p_values[effect], default=None)
        if least_significant is None or p_values[least_significant] < significance_level:
            return chosen
        chosen = chosen.without(least_significant)


Array = NDArray[np.float64]


@dataclass(frozen=True)
class CrossValidation:
    """Cross-validated predictions of N rows by fits that have not seen them.

    ``storage`` in Pa and ``damping`` in Pa s are predicted; ``chi_squared`` is of each row's two numbers against the
    table's uncertainty alone; all (N,). ``is_interpolated`` marks rows between frequencies that the fit had seen: the
    others are extrapolated. ``fits`` are the fits to the other rows, and ``held_out_rows`` what each had not seen.
    """

    storage: Array
    damping: Array
    chi_squared: Array
    is_interpolated: NDArray[np.bool_]
    fits: tuple[MaterialFit, ...]
    held_out_rows: tuple[tuple[int, ...], ...]

    @property
    def total_chi_squared(self) -> float:
        """Chi-squared of all predictions."""
        return float(np.sum(self.chi_squared))

    @property
    def interpolated_chi_squared(self) -> float:
        """Chi-squared of the predictions that are no extrapolation."""
        return float(np.sum(self.chi_squared[self.is_interpolated]))


def cross_validate(observations: ModulusObservations, structure: ModelStructure) -> CrossValidation:
    """Cross-validate a model: fit it without each row (each of twelve folds of a longer table) and predict that."""
    count = observations.row_count
    folds = [tuple(range(first, count, MAX_FOLDS)) for first in range(min(count, MAX_FOLDS))]
    predicted = np.zeros(count, dtype=complex)
    chi_squared, is_interpolated = np.zeros(count), np.zeros(count, dtype=bool)
    fits = []
    for rows in folds:
        training_rows = [row for row in range(count) if row not in rows]
        fit = fit_structure(observations.select_rows(training_rows), structure)
        fits.append(fit)
        for row in rows:
            held_out = observations.select_rows([row])
            predicted[row] = complex_modulus(fit.material, observations.frequency[row], observations.amplitude[row])
            chi_squared[row] = float(np.sum(whitened_residuals(held_out, fit.material)[:2] ** 2))
            is_interpolated[row] = (
                observations.frequency[training_rows].min()
                <= observations.frequency[row]
                <= observations.frequency[training_rows].max()
            )
    damping = predicted.imag / (2.0 * np.pi * observations.frequency)
    return CrossValidation(predicted.real, damping, chi_squared, is_interpolated, tuple(fits), tuple(folds))
