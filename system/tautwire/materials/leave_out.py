"""How well a model, fitted to the other rows, predicts a row that it has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fit import MaterialFit, fit_terms, residuals
from .modulus import complex_modulus
from .observations import Observations
from .terms import Terms

Array = NDArray[np.float64]

# Longer tables are left out in so many interleaved parts.
MOST_PARTS = 12


@dataclass(frozen=True)
class LeaveOut:
    """What N rows look like to fits that have not seen them.

    ``storage`` in Pa and ``damping`` in Pa s are predicted; ``chi_squared`` is of each row's two numbers against the
    table's uncertainty alone; all (N,). ``inside`` marks rows between frequencies that the fit had seen: the others
    are extrapolated. ``rest`` are the fits to the other rows, and ``rows`` what each had not seen.
    """

    storage: Array
    damping: Array
    chi_squared: Array
    inside: NDArray[np.bool_]
    rest: tuple[MaterialFit, ...]
    rows: tuple[tuple[int, ...], ...]

    @property
    def total(self) -> float:
        """Chi-squared of all predictions."""
        return float(np.sum(self.chi_squared))

    @property
    def total_inside(self) -> float:
        """Chi-squared of the predictions that are no extrapolation."""
        return float(np.sum(self.chi_squared[self.inside]))


def leave_out(seen: Observations, terms: Terms) -> LeaveOut:
    """Fits a model without each row (each of twelve parts of a longer table) and predicts what was left out."""
    count = seen.row_count
    parts = [tuple(range(first, count, MOST_PARTS)) for first in range(min(count, MOST_PARTS))]
    predicted = np.zeros(count, dtype=complex)
    chi_squared, inside = np.zeros(count), np.zeros(count, dtype=bool)
    rest = []
    for rows in parts:
        kept = [row for row in range(count) if row not in rows]
        fit = fit_terms(seen.taken(kept), terms)
        rest.append(fit)
        for row in rows:
            alone = seen.taken([row])
            predicted[row] = complex_modulus(fit.material, seen.frequency[row], seen.amplitude[row])
            chi_squared[row] = float(np.sum(residuals(alone, fit.material)[:2] ** 2))
            inside[row] = seen.frequency[kept].min() <= seen.frequency[row] <= seen.frequency[kept].max()
    damping = predicted.imag / (2.0 * np.pi * seen.frequency)
    return LeaveOut(predicted.real, damping, chi_squared, inside, tuple(rest), tuple(parts))
