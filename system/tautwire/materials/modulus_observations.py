"""Observations of the complex modulus from a table: both parts at each frequency, with their joint covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array

from .material_table import MODULUS_PAIRS, MaterialTable

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModulusObservations:
    """Observed complex moduli, N rows: ``frequency`` in Hz, ``storage`` and ``loss`` in Pa, each (N,).

    ``covariance`` (2N, 2N), in Pa^2, is of all storage moduli followed by all loss moduli. ``static_modulus``
    are measured long-term moduli with their ``static_modulus_uncertainty``, each (M,), in Pa. ``amplitude`` (N,) is of
    the strain, infinite where the table does not say.
    """

    frequency: Array
    storage: Array
    loss: Array
    covariance: Array
    amplitude: Array
    static_modulus: Array = field(default_factory=lambda: np.zeros(0))
    static_modulus_uncertainty: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def row_count(self) -> int:
        """Number of rows N, of two measured numbers each."""
        return len(self.frequency)

    @property
    def measurement_count(self) -> int:
        """Number of measured numbers: 2N + M."""
        return 2 * self.row_count + len(self.static_modulus)

    @property
    def has_amplitude(self) -> bool:
        """Whether the table has the strain amplitude of every row."""
        return bool(np.isfinite(self.amplitude).all())

    @property
    def damping(self) -> Array:
        """Equivalent viscous damping ``c = E'' / (2 pi f)``, in Pa s."""
        damping: Array = self.loss / (2.0 * np.pi * self.frequency)
        return damping

    @property
    def storage_uncertainty(self) -> Array:
        """One standard deviation of each storage modulus, in Pa."""
        sigma: Array = np.sqrt(np.diag(self.covariance))[: self.row_count]
        return sigma

    @property
    def damping_uncertainty(self) -> Array:
        """One standard deviation of each damping, in Pa s."""
        sigma: Array = np.sqrt(np.diag(self.covariance))[self.row_count :] / (2.0 * np.pi * self.frequency)
        return sigma

    @cached_property
    def whitener(self) -> csr_array:
        """Whitening matrix ``L^-1`` of ``covariance = L L^T``, shape (2N, 2N): sparse where rows are independent."""
        lower = np.linalg.cholesky(self.covariance)
        return csr_array(solve_triangular(lower, np.eye(len(lower)), lower=True))

    def whiten(self, storage: Array, loss: Array, long_term: Array) -> Array:
        """Whiten (N, ...), (N, ...) and (M, ...) numbers into (2N + M, ...), whose errors have unit variance."""
        moduli = self.whitener @ np.concatenate([storage, loss])
        return np.concatenate([moduli, (long_term.T / self.static_modulus_uncertainty).T])

    def select_rows(self, rows: Sequence[int]) -> ModulusObservations:
        """The observations of some rows alone, counted from 0."""
        row_indices = np.asarray(rows, dtype=int)
        moduli_indices = np.concatenate([row_indices, row_indices + self.row_count])
        return replace(
            self,
            frequency=self.frequency[row_indices],
            storage=self.storage[row_indices],
            loss=self.loss[row_indices],
            covariance=self.covariance[np.ix_(moduli_indices, moduli_indices)],
            amplitude=self.amplitude[row_indices],
        )

    def with_static_rows(self, table: MaterialTable, coverage_factor: float = 1.0) -> ModulusObservations:
        """The observations together with the table's static rows, whose uncertainties are so many deviations."""
        quantities = [row.quantities["storage_modulus"] for row in table.static_rows]
        return replace(
            self,
            static_modulus=np.array([quantity.value for quantity in quantities], dtype=float),
            static_modulus_uncertainty=np.array([quantity.uncertainty for quantity in quantities]) / coverage_factor,
        )


def observations_from_table(
    table: MaterialTable, pair: tuple[str, str], shared_variance: float = 0.0, coverage_factor: float = 1.0
) -> ModulusObservations:
    """Observations of both parts of the modulus from two columns of a table, errors propagated to first order.

    ``shared_variance`` is the share of each column's variance that all rows have in common (an area, a gauge length,
    a phase offset); the remainder is independent from row to row. Uncertainties are ``coverage_factor`` standard
    deviations.
    """
    first, second = (np.array([row.quantities[name].value for row in table.rows]) for name in pair)
    sigmas = [np.array([row.quantities[name].uncertainty for row in table.rows], dtype=float) for name in pair]
    frequency = np.array([row.frequency for row in table.rows])
    storage, loss, slopes = _storage_and_loss(pair, first, second, 2.0 * np.pi * frequency)
    jacobian = np.block([[np.diag(slope) for slope in part] for part in slopes])
    variances = np.zeros_like(jacobian)
    count = len(frequency)
    for index, sigma in enumerate(sigmas):
        block = slice(index * count, (index + 1) * count)
        correlation = shared_variance + (1.0 - shared_variance) * np.eye(count)
        variances[block, block] = np.outer(sigma, sigma) * correlation / coverage_factor**2
    amplitude = [
        row.quantities["strain_amplitude"].value if "strain_amplitude" in row.quantities else np.inf
        for row in table.rows
    ]
    return ModulusObservations(frequency, storage, loss, jacobian @ variances @ jacobian.T, np.array(amplitude))


def _storage_and_loss(
    pair: tuple[str, str], first: Array, second: Array, omega: Array
) -> tuple[Array, Array, tuple[tuple[Array, Array], tuple[Array, Array]]]:
    """Storage and loss modulus, and the derivatives of each by the two columns; all (N,)."""
    one, zero = np.ones_like(first), np.zeros_like(first)
    if pair == MODULUS_PAIRS[0]:
        cosine, sine = np.cos(second), np.sin(second)
        storage, loss = first * cosine, first * sine
        return storage, loss, ((cosine, -loss), (sine, storage))
    if pair == MODULUS_PAIRS[1]:
        return first, first * second, ((one, zero), (second, first))
    factor = omega if pair == MODULUS_PAIRS[3] else one
    return first, factor * second, ((one, zero), (zero, factor))
