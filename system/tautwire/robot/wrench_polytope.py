"""The polytope of all wrenches that cables between bounds can exert, and the distance of wrenches from its faces."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .schema import TensionLimits

Array = NDArray[np.float64]

PARALLEL_TOLERANCE = 1e-9
# Relative to the required wrench: smaller margins are zero up to rounding.
ZERO_MARGIN_TOLERANCE = 1e-12


def polytope_margin(structure_matrix: Array, limits: TensionLimits, required: Array) -> float:
    """Smallest signed distance of required wrenches (m, d) from the faces of ``{A T : T_min <= T_i <= T_max}``.

    ``min h(n) - n . w`` over unit face normals n and required w, ``h(n) = sum_k max(T_min n . a_k, T_max n . a_k)``,
    with the columns a_k of ``structure_matrix`` A (d, k): two, three or six coordinates of one unit. Negative outside.
    Where the columns span less, the polytope is flat: faces are within the span, and what points out of it is outside.

    Source: Bouchard, Gosselin and Moore (2010), Journal of Mechanisms and Robotics 2(1), 011013.
    """
    left_vectors, singular_values, _ = np.linalg.svd(structure_matrix)
    rank = int(np.sum(singular_values > PARALLEL_TOLERANCE * singular_values[0]))
    beside = np.max(np.abs(required @ left_vectors[:, rank:]), initial=0.0)
    if beside > PARALLEL_TOLERANCE * np.max(np.abs(required), initial=1.0):
        return -float(beside)
    structure_matrix, required = left_vectors[:, :rank].T @ structure_matrix, required @ left_vectors[:, :rank]
    normals = face_normals(structure_matrix)
    projections = normals @ structure_matrix
    # Infinity times zero is not zero: a cable in the plane of a face does not contribute.
    extreme_tensions = np.where(
        projections > PARALLEL_TOLERANCE,
        limits.maximum,
        np.where(projections < -PARALLEL_TOLERANCE, limits.minimum, 0.0),
    )
    support = np.sum(np.where(extreme_tensions == 0.0, 0.0, extreme_tensions) * projections, axis=1)
    margins = support[:, None] - normals @ required.T
    margins[np.abs(margins) < ZERO_MARGIN_TOLERANCE * np.max(np.abs(required), initial=1.0)] = 0.0
    return float(np.min(margins))


def face_normals(structure_matrix: Array) -> Array:
    """Unit normals of all faces, in both directions; the columns span all.

    Each face contains d - 1 independent columns, whose generalised cross product is its normal.
    """
    rows, count = structure_matrix.shape
    chosen = np.array(list(combinations(range(count), rows - 1)), dtype=int)
    columns = np.moveaxis(structure_matrix[:, chosen], 1, 0)
    crossed = _generalised_cross_products(columns)
    sizes = np.linalg.norm(crossed, axis=1)
    is_spanned = sizes > PARALLEL_TOLERANCE * np.max(sizes)
    normals = crossed[is_spanned] / sizes[is_spanned, None]
    return np.vstack([normals, -normals])


def _generalised_cross_products(columns: Array) -> Array:
    """Vectors (m, d) orthogonal to d - 1 columns each, by cofactors; ``columns`` (m, d, d - 1)."""
    rows = columns.shape[1]
    minors = [np.linalg.det(np.delete(columns, row, axis=1)) for row in range(rows)]
    signs = (-1.0) ** np.arange(rows)
    crossed: Array = signs * np.stack(minors, axis=1)
    return crossed
