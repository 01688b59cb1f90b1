"""Innovations of a recording: what a filter did not predict of each sample, over its standard deviation."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import log, pi

import numpy as np
from numpy.typing import NDArray

from .compiled_filter import FilterResults

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Innovations:
    """Whitened innovations of N samples of m outputs, NaN where nothing was ``observed`` (N, m).

    ``values`` (N, m) have unit variance where the model is right; ``sensitivities`` (N, m, p) are their derivatives by
    the free parameters; ``log_variances`` (N, m) the log of the variances that they were divided by. ``constants`` (c)
    are the uncertain parameters as filtered, in declared standard deviations. ``segments`` are those of the filter's
    run where they were to be kept.
    """

    observed: NDArray[np.bool_]
    values: Array
    sensitivities: Array
    log_variances: Array
    constants: Array = field(default_factory=lambda: np.zeros(0))
    segments: tuple[FilterSegment, ...] = ()

    def log_likelihood(self, rows: NDArray[np.bool_]) -> float:
        """Log of the probability density, in SI units, of the samples in ``rows`` given those before them."""
        mask = self.observed & rows[:, None]
        terms = self.values[mask] ** 2 + self.log_variances[mask] + log(2.0 * pi)
        return float(-0.5 * np.sum(terms))

    def misfit(self, rows: NDArray[np.bool_]) -> float:
        """Half of what the squares of the samples in ``rows`` exceed their number by: nats, of a perfect model none."""
        mask = self.observed & rows[:, None]
        return 0.5 * float(np.sum(self.values[mask] ** 2 - 1.0))

    def mean_square(self, rows: NDArray[np.bool_]) -> Array:
        """Mean square of each output's innovations, shape (m,); one where the model is right, NaN if unobserved."""
        count = np.sum(self.observed[rows], axis=0)
        total = np.nansum(self.values[rows] ** 2, axis=0)
        return np.divide(total, count, out=np.full(len(total), np.nan), where=count > 0)

    def overall_mean_square(self, rows: NDArray[np.bool_]) -> float:
        """The mean of :meth:`mean_square` over the observed outputs."""
        return float(np.nanmean(self.mean_square(rows)))


@dataclass(frozen=True)
class FilterSegment:
    """Filter segment: K successive samples of a filter's run.

    ``columns`` are those of :class:`tautwire.estimation.compiled_filter.FilterInputs`; ``is_recorded`` (K) tells which
    samples are the recording's, the others fill gaps.
    """

    columns: tuple[Array, ...]
    is_recorded: NDArray[np.bool_]
    results: FilterResults


def concatenated(segments: Iterable[FilterSegment]) -> tuple[Array, Array, Array, Array]:
    """Values, log variances (N, m), sensitivities (N, m, p) of the recording's samples; and the last state (n,)."""
    parts, last_state = [], np.zeros(0)
    for segment in segments:
        rows, results = segment.is_recorded, segment.results
        parts.append((results.values[rows], results.log_variances[rows], results.sensitivities[rows]))
        last_state = results.states[:, -1]
    values, log_variances, sensitivities = (np.concatenate(part) for part in zip(*parts, strict=True))
    return values, log_variances, sensitivities, last_state
