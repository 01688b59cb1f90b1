"""Sampling of the inputs: Sobol, Latin hypercube, random and Saltelli designs, grids; Gaussian copula."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.stats import norm, qmc

from .campaign_plan import Input, MissingExtraError, Plan, PlanError

Array = NDArray[np.float64]

# The normal quantiles of probabilities 0 and 1 are infinite.
MIN_TAIL_PROBABILITY = 1e-12
# Rounding may put the smallest eigenvalue of a correlation matrix this far below zero.
EIGENVALUE_TOLERANCE = 1e-9


def draw_samples(plan: Plan) -> Array:
    """Draw the inputs of all samples, shape (count, inputs).

    Samples are drawn in the unit cube and correlated by a Gaussian copula: probabilities are mapped to normal
    variables, multiplied by a factor of the correlation matrix, and mapped back; each input is then its quantile.
    A grid is the Cartesian product of the discrete values, the last input fastest.

    Raises PlanError where correlations contradict each other.
    """
    if not plan.inputs:
        return np.zeros((plan.count, 0))
    if plan.method == "grid":
        return np.array(list(product(*(each.distribution.discrete_values for each in plan.inputs))))
    probabilities = _apply_copula(
        plan, np.clip(_unit_cube_samples(plan), MIN_TAIL_PROBABILITY, 1.0 - MIN_TAIL_PROBABILITY)
    )
    return np.column_stack([each.distribution.quantile(probabilities[:, i]) for i, each in enumerate(plan.inputs)])


def median_value(varied: Input) -> float | str:
    """The median of an input."""
    return varied.distribution.value(float(varied.distribution.quantile(np.array([0.5]))[0]))


def correlation_matrix(plan: Plan) -> Array:
    """Correlation matrix of the normal variables of the copula, shape (inputs, inputs)."""
    matrix = np.eye(len(plan.inputs))
    for each in plan.correlations:
        matrix[each.first, each.second] = matrix[each.second, each.first] = each.value
    return matrix


def correlated_groups(plan: Plan) -> tuple[int, ...]:
    """Group number of each input: connected components of the graph of correlations."""
    _, labels = connected_components(correlation_matrix(plan) != 0.0, directed=False)
    return tuple(labels.tolist())


def salib_problem(plan: Plan) -> dict[str, Any]:
    """The problem definition of SALib: the unit cube, with correlated inputs in one group."""
    names = list(plan.keys)
    problem: dict[str, Any] = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    if plan.correlations:
        groups = correlated_groups(plan)
        labels = {g: " and ".join(n for n, own in zip(names, groups, strict=True) if own == g) for g in groups}
        problem["groups"] = [labels[group] for group in groups]
    return problem


def saltelli_block_size(plan: Plan) -> int:
    """Block size of a Saltelli design: one sample, one for each group exchanged, one with all exchanged."""
    return len(set(correlated_groups(plan))) + 2


def _unit_cube_samples(plan: Plan) -> Array:
    count, dimension = plan.count, len(plan.inputs)
    generator = np.random.default_rng(plan.seed)
    if plan.method == "random":
        return generator.random((count, dimension))
    if plan.method == "latin hypercube":
        return np.asarray(qmc.LatinHypercube(dimension, seed=generator).random(count))
    if plan.method == "sobol":
        return np.asarray(qmc.Sobol(dimension, scramble=True, seed=generator).random(count))
    sample = _saltelli_sampler()
    base = plan.count // saltelli_block_size(plan)
    return np.asarray(sample(salib_problem(plan), base, calc_second_order=False, scramble=True, seed=plan.seed))


def _saltelli_sampler() -> Any:
    try:
        from SALib.sample import sobol
    except ImportError as error:
        raise MissingExtraError("SALib") from error
    return sobol.sample


def _apply_copula(plan: Plan, probabilities: Array) -> Array:
    if not plan.correlations:
        return probabilities
    return np.clip(
        norm.cdf(norm.ppf(probabilities) @ _correlation_factor(correlation_matrix(plan)).T),
        MIN_TAIL_PROBABILITY,
        1.0 - MIN_TAIL_PROBABILITY,
    )


def _correlation_factor(matrix: Array) -> Array:
    """Factor F of a correlation matrix, ``F F' = matrix``: Cholesky's, or by eigenvectors where barely singular."""
    try:
        return np.asarray(np.linalg.cholesky(matrix))
    except np.linalg.LinAlgError as error:
        eigenvalues, eigenvectors = np.linalg.eigh(matrix)
        if eigenvalues[0] < -EIGENVALUE_TOLERANCE:
            problem = "contradict each other: the correlation matrix is not positive definite"
            raise PlanError("correlation", problem, "make them smaller") from error
    return np.asarray(eigenvectors * np.sqrt(np.maximum(eigenvalues, 0.0)))
