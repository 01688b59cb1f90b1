"""What a table says of the complex modulus: both parts at each frequency, with the covariance of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array

from .table import PAIRS, MaterialTable

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Observations:
    """N rows: ``frequency`` in Hz, ``storage`` and ``loss`` in Pa, each (N,).

    ``covariance`` (2N, 2N), in Pa^2, is of all storage moduli followed by all loss moduli. ``static`` are measured
    long-term moduli with their ``static_uncertainty``, each (M,), in Pa. ``amplitude`` (N,) is of the strain, infinite
    where the table does not say.
    """

    frequency: Array
    storage: Array
    loss: Array
    covariance: Array
    amplitude: Array
    static: Array = field(default_factory=lambda: np.zeros(0))
    static_uncertainty: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def row_count(self) -> int:
        """N; there are two numbers a row."""
        return len(self.frequency)

    @property
    def number_count(self) -> int:
        """How many measured numbers there are: 2N + M."""
        return 2 * self.row_count + len(self.static)

    @property
    def has_amplitude(self) -> bool:
        """Whether the table says the strain amplitude of every row."""
        return bool(np.isfinite(self.amplitude).all())

    @property
    def damping(self) -> Array:
        """``c = E'' / (2 pi f)``, in Pa s."""
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
        """``L^-1`` of ``covariance = L L^T``, shape (2N, 2N): sparse where rows are independent."""
        lower = np.linalg.cholesky(self.covariance)
        return csr_array(solve_triangular(lower, np.eye(len(lower)), lower=True))

    def whitened(self, storage: Array, loss: Array, long_term: Array) -> Array:
        """Numbers of (N, ...), (N, ...) and (M, ...) as (2N + M, ...), in units in which errors have unit variance."""
        moduli = self.whitener @ np.concatenate([storage, loss])
        return np.concatenate([moduli, (long_term.T / self.static_uncertainty).T])

    def taken(self, rows: Sequence[int]) -> Observations:
        """These rows alone, counted from 0."""
        chosen = np.asarray(rows, dtype=int)
        both = np.concatenate([chosen, chosen + self.row_count])
        return replace(
            self,
            frequency=self.frequency[chosen],
            storage=self.storage[chosen],
            loss=self.loss[chosen],
            covariance=self.covariance[np.ix_(both, both)],
            amplitude=self.amplitude[chosen],
        )

    def with_static(self, table: MaterialTable) -> Observations:
        """The observations and the table's static rows."""
        quantities = [row.quantities["storage_modulus"] for row in table.static]
        return replace(
            self,
            static=np.array([quantity.value for quantity in quantities], dtype=float),
            static_uncertainty=np.array([quantity.uncertainty for quantity in quantities], dtype=float),
        )


def observations(
    table: MaterialTable, pair: tuple[str, str], shared: float = 0.0, coverage: float = 1.0
) -> Observations:
    """Both parts of the modulus from two columns of a table, errors propagated to first order.

    ``shared`` is the share of each column's variance that all rows have in common (an area, a gauge length, a phase
    offset); the rest is independent from row to row. Uncertainties are ``coverage`` standard deviations.
    """
    first, second = (np.array([row.quantities[name].value for row in table.rows]) for name in pair)
    sigmas = [np.array([row.quantities[name].uncertainty for row in table.rows], dtype=float) for name in pair]
    frequency = np.array([row.frequency for row in table.rows])
    storage, loss, slopes = _parts(pair, first, second, 2.0 * np.pi * frequency)
    jacobian = np.block([[np.diag(slope) for slope in part] for part in slopes])
    variances = np.zeros_like(jacobian)
    count = len(frequency)
    for place, sigma in enumerate(sigmas):
        block = slice(place * count, (place + 1) * count)
        mixed = shared + (1.0 - shared) * np.eye(count)
        variances[block, block] = np.outer(sigma, sigma) * mixed / coverage**2
    amplitude = [
        row.quantities["strain_amplitude"].value if "strain_amplitude" in row.quantities else np.inf
        for row in table.rows
    ]
    return Observations(frequency, storage, loss, jacobian @ variances @ jacobian.T, np.array(amplitude))


def _parts(
    pair: tuple[str, str], first: Array, second: Array, omega: Array
) -> tuple[Array, Array, tuple[tuple[Array, Array], tuple[Array, Array]]]:
    """Storage and loss modulus, and the slopes of each by the two columns; all (N,)."""
    one, zero = np.ones_like(first), np.zeros_like(first)
    if pair == PAIRS[0]:
        cosine, sine = np.cos(second), np.sin(second)
        storage, loss = first * cosine, first * sine
        return storage, loss, ((cosine, -loss), (sine, storage))
    if pair == PAIRS[1]:
        return first, first * second, ((one, zero), (second, first))
    factor = omega if pair == PAIRS[3] else one
    return first, factor * second, ((one, zero), (zero, factor))
