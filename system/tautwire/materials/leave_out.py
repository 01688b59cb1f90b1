"""Cross-validation: how well a model predicts rows that it was not fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fit import MaterialFit, fit_structure, whitened_residuals
from .modulus import complex_modulus
from .observations import ModulusObservations
from .terms import ModelStructure

Array = NDArray[np.float64]

# Leave-one-out up to this number of rows; longer tables are held out in as many interleaved folds.
MAX_FOLDS = 12


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
