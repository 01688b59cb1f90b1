"""Tension distribution of a redundantly actuated robot: which of all balancing tensions its cables carry."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import linprog, lsq_linear
from scipy.spatial import Delaunay, HalfspaceIntersection

from ..errors import ArgumentError
from ..name_suggestions import suggest_name
from .schema import TensionLimits

Array = NDArray[np.float64]

BALANCE_TOLERANCE = 1e-6
RANK_TOLERANCE = 1e-9
DEFAULT_LIMITS = TensionLimits(minimum=0.0, maximum=float("inf"), preferred=0.0)
RULES = ("nearest", "least_norm", "barycentre", "closed_form")
BOUNDED_RULES = ("barycentre", "closed_form")


def distribute_tensions(
    unit_directions: Array, load: Array, limits: TensionLimits, preferred: Array | None = None
) -> Array | None:
    """Tension distribution: the feasible tensions nearest to the preferred one that balance a load, shape (n,), in N.

    ``min |T - T_p|^2`` with ``U T = w``, ``T_min <= T_i <= T_max``. Their dependence on ``U`` and ``w`` is
    continuous, as the objective is strictly convex. ``unit_directions`` U (3, n) points from the platform to the exit
    points, ``load`` w (3,) is in N; of a rigid platform, U is the structure matrix and w the load wrench, with as many
    rows, moments divided by a length. ``preferred`` T_p (n,) is by default that of the limits for all cables. None if
    no tensions are feasible.
    """
    count = unit_directions.shape[1]
    problem: Any = {"h": casadi.Sparsity.dense(count, count), "a": casadi.Sparsity.dense(len(load), count)}
    solver = casadi.conic("tension_distribution", "daqp", problem, {"error_on_fail": False})
    scale = max(float(np.linalg.norm(load)), 1.0)
    solution = solver(
        h=np.eye(count),
        g=-(np.full(count, limits.preferred) if preferred is None else preferred) / scale,
        a=unit_directions,
        lba=load / scale,
        uba=load / scale,
        lbx=limits.minimum / scale,
        ubx=limits.maximum / scale,
    )
    tensions: Array = np.asarray(solution["x"], dtype=float).ravel() * scale
    # The solver ignores a row of zeros, as with cables in one plane.
    is_balanced = np.linalg.norm(unit_directions @ tensions - load) <= BALANCE_TOLERANCE * scale
    if solver.stats()["success"] and is_balanced:
        return tensions
    # Nor does it solve dependent rows, as with cables in a plane that is oblique to the axes.
    span, _ = _row_span(unit_directions)
    if span.shape[1] == len(load) or np.linalg.norm(load - span @ (span.T @ load)) > BALANCE_TOLERANCE * scale:
        return None
    return distribute_tensions(span.T @ unit_directions, span.T @ load, limits, preferred)


def _row_span(unit_directions: Array) -> tuple[Array, Array]:
    """Orthonormal basis (3, r) of the forces that cables can exert, and the singular values (r,) that belong to it."""
    left_vectors, singular_values, _ = np.linalg.svd(unit_directions, full_matrices=False)
    spanned = singular_values > RANK_TOLERANCE * singular_values[0]
    return left_vectors[:, spanned], singular_values[spanned]


def least_limit_violations(unit_directions: Array, load: Array, limits: TensionLimits) -> Array:
    """Least violation of the tension limits that balances a load, shape (n,), in N; negative below, positive above.

    ``min |s|^2`` with ``U (b + s) = w``, ``T_min <= b_i <= T_max``: of all tensions ``b + s`` that balance the
    load, those that violate the limits least. Cables that need not violate them have zero. Not a number where the
    cables cannot exert the load at all, such as cables in one plane.
    """
    scale = max(float(np.linalg.norm(load)), 1.0)
    span, singular_values = _row_span(unit_directions)
    rows = (span / singular_values).T
    unreachable_load = load - span @ (span.T @ load)
    if np.linalg.norm(unreachable_load) > 1e-9 * scale:
        return np.full(unit_directions.shape[1], np.nan)
    solution = lsq_linear(
        rows @ unit_directions,
        rows @ load / scale,
        bounds=(limits.minimum / scale, limits.maximum / scale),
        method="bvls",
    )
    excess: Array = scale * unit_directions.T @ (rows.T @ (rows @ load / scale - rows @ unit_directions @ solution.x))
    return excess


def distribute_by_rule(
    structure_matrix: Array, load: Array, limits: TensionLimits, rule: str = "nearest"
) -> Array | None:
    """Tension distribution by one of the :data:`RULES`, shape (n,), in N; None if the rule finds no feasible one.

    ``nearest`` to the preferred tension, ``least_norm``, the ``barycentre`` of all feasible tensions, or the improved
    ``closed_form``, which may miss feasible ones near the bounds; the last two need a finite maximum. Arguments as
    :func:`distribute_tensions` takes them. All rules give the same where only one distribution balances the load, as
    of fewer cables than degrees of freedom.

    Raises ArgumentError for another rule, or where a maximum is needed and not finite.
    """
    if rule not in RULES:
        raise ArgumentError("distribute_by_rule: rule", rule, f"is {rule!r}", f"write {suggest_name(rule, RULES)}")
    span, _ = _row_span(structure_matrix)
    if rule not in BOUNDED_RULES or span.shape[1] == structure_matrix.shape[1]:
        preferred = 0.0 if rule == "least_norm" else limits.preferred
        return distribute_tensions(structure_matrix, load, replace(limits, preferred=preferred))
    if not np.isfinite(limits.maximum):
        problem = f"is {rule}, which needs a maximum tension"
        raise ArgumentError("distribute_by_rule: rule", rule, problem, "give [tension] a maximum in the robot file")
    if np.linalg.norm(load - span @ (span.T @ load)) > BALANCE_TOLERANCE * max(float(np.linalg.norm(load)), 1.0):
        return None
    # Cables in a plane, or about one axis, have dependent rows.
    distribute = _barycentre if rule == "barycentre" else _closed_form
    return distribute(span.T @ structure_matrix, span.T @ load, limits)


def _closed_form(structure_matrix: Array, load: Array, limits: TensionLimits) -> Array | None:
    """Improved closed form: the tensions nearest to the middle of the bounds; while one violates a bound, the worst of
    them stays there and the others share the remaining load.

    Source: Pott (2014), An improved force distribution algorithm for over-constrained cable-driven parallel robots.
    """
    rows, count = structure_matrix.shape
    middle = 0.5 * (limits.minimum + limits.maximum)
    tensions, free = np.full(count, middle), np.ones(count, dtype=bool)
    tolerance = BALANCE_TOLERANCE * limits.maximum
    while free.sum() >= rows:
        remaining = load - structure_matrix[:, ~free] @ tensions[~free] - middle * structure_matrix[:, free].sum(axis=1)
        tensions[free] = middle + np.linalg.pinv(structure_matrix[:, free]) @ remaining
        if np.linalg.norm(structure_matrix @ tensions - load) > BALANCE_TOLERANCE * max(
            float(np.linalg.norm(load)), 1.0
        ):
            return None
        excess = np.abs(tensions - middle) - (limits.maximum - middle)
        worst = int(np.argmax(np.where(free, excess, -np.inf)))
        if excess[worst] <= tolerance:
            return np.clip(tensions, limits.minimum, limits.maximum)
        tensions[worst] = limits.maximum if tensions[worst] > middle else limits.minimum
        free[worst] = False
    return None


def _barycentre(structure_matrix: Array, load: Array, limits: TensionLimits) -> Array | None:
    """Centre of gravity of the polytope of feasible tensions, whose coordinates are those of the null space.

    Source: Mikelsons et al. (2008), A real-time capable force calculation algorithm for redundant tendon-based
    parallel manipulators; Lamaury and Gouttefarde (2013).
    """
    particular, null_basis = np.linalg.pinv(structure_matrix) @ load, null_space(structure_matrix)
    normals = np.vstack([-null_basis, null_basis])
    offsets = np.concatenate([particular - limits.minimum, limits.maximum - particular])
    dimension = null_basis.shape[1]
    # The centre of the largest inscribed sphere is inside, which the search for vertices needs.
    sizes = np.linalg.norm(normals, axis=1)
    inside = linprog(
        [*[0.0] * dimension, -1.0],
        np.column_stack([normals, sizes]),
        offsets,
        bounds=[(None, None)] * dimension + [(0.0, None)],
    )
    if not inside.success:
        return None
    *centre, radius = np.asarray(inside.x, dtype=np.float64).tolist()
    coordinates = np.array(centre)
    if radius > BALANCE_TOLERANCE * (limits.maximum - limits.minimum):
        coordinates = _polytope_centroid(normals, offsets, coordinates)
    return np.clip(particular + null_basis @ coordinates, limits.minimum, limits.maximum)


def _polytope_centroid(normals: Array, offsets: Array, inside: Array) -> Array:
    """Centroid of ``{x : normals x <= offsets}``, of which one point inside is known."""
    if len(inside) == 1:
        bounds = offsets / normals[:, 0]
        return np.array([0.5 * (np.max(bounds[normals[:, 0] < 0.0]) + np.min(bounds[normals[:, 0] > 0.0]))])
    corners = HalfspaceIntersection(np.column_stack([normals, -offsets]), inside).intersections
    simplices = corners[Delaunay(corners, qhull_options="QJ").simplices]
    volumes = np.abs(np.linalg.det(simplices[:, 1:] - simplices[:, :1]))
    centroid: Array = volumes @ simplices.mean(axis=1) / volumes.sum()
    return centroid
