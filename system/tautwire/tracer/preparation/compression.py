"""Innovations of a whole recording as few rows that least squares cannot tell from all of them.

With innovations ``e``, slopes ``J``, the norms ``D`` of its columns, and ``J' J = D V L V' D``: rows ``L^(1/2) V' D``
with residuals ``L^(-1/2) V' D^-1 J' e``, and one row without slope that makes up the sum of squares. Cost, gradient and
curvature are those of all rows; memory does not grow with a recording's length.

Source: Golub and Van Loan (2013), Matrix Computations, sec. 5.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..data import Sample
from ..likelihood import Likelihood

Array = NDArray[np.float64]

# Of the largest eigenvalue: below it there is nothing but rounding.
LEAST = 1e-13


def compressed(likelihood: Likelihood, values: Array, sample: Sample, roughness: float) -> tuple[Array, Array]:
    """Residuals (p + 1,) and slopes (p + 1, p) in place of all samples that count; not finite where one of them is not.

    A sample that a lag leaves without a state counts as noise, see :meth:`Likelihood.innovations`.
    """
    given = np.isfinite(sample.recording.measured())
    count = len(values)
    gram, pull, square = np.zeros((count, count)), np.zeros(count), 0.0
    last = 0
    for stretch in likelihood.stretches(sample.recording, values, roughness):
        own = slice(last, last + int(np.sum(stretch.own)))
        last = own.stop
        rows = sample.rows[own, None]
        looked = stretch.columns[1].T[stretch.own] > 0.0
        chosen = looked & rows
        residuals, slopes = stretch.values[stretch.own][chosen], stretch.slopes[stretch.own][chosen]
        gram += slopes.T @ slopes
        pull += slopes.T @ residuals
        square += float(residuals @ residuals) + float(np.sum(given[own] & ~looked & rows))
    return _few_rows(gram, pull, square)


def _few_rows(gram: Array, pull: Array, square: float) -> tuple[Array, Array]:
    count = len(pull)
    if not (np.isfinite(square) and np.all(np.isfinite(gram)) and np.all(np.isfinite(pull))):
        return np.full(count + 1, np.nan), np.zeros((count + 1, count))
    size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    weights, axes = np.linalg.eigh(gram / np.outer(size, size))
    weights = np.where(weights > LEAST * max(float(weights[-1]), np.finfo(float).tiny), weights, 0.0)
    root = np.sqrt(weights)
    projected = np.divide(axes.T @ (pull / size), root, out=np.zeros(count), where=root > 0.0)
    rest = np.sqrt(max(square - float(projected @ projected), 0.0))
    slopes = root[:, None] * axes.T * size
    return np.append(projected, rest), np.vstack([slopes, np.zeros((1, count))])
