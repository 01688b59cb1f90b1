"""The values that inputs have in each sample; the same seed gives the same ones, however they are run."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, qmc

from .errors import MissingExtraError, PlanError
from .plan import Input, Plan

Array = NDArray[np.float64]

# A share of 0 or 1 would be infinitely far out.
FARTHEST = 1e-12
# By rounding the least eigenvalue of correlations may lie this far below zero.
SINGULAR = 1e-9


def samples(plan: Plan) -> Array:
    """The inputs of all samples, shape (count, inputs).

    Samples are drawn in a unit cube. Correlations are those of normal variables there (a Gaussian copula): shares of
    probability go to normal variables, through a factor of their correlations, and back; each input is then
    its quantile. A grid is the product of its steps, the last input fastest.

    Raises PlanError where correlations contradict each other.
    """
    if not plan.inputs:
        return np.zeros((plan.count, 0))
    if plan.method == "grid":
        return np.array(list(product(*(each.distribution.steps for each in plan.inputs))))
    shares = _correlated(plan, np.clip(_shares(plan), FARTHEST, 1.0 - FARTHEST))
    return np.column_stack([each.distribution.quantile(shares[:, i]) for i, each in enumerate(plan.inputs)])


def middle(one: Input) -> float | str:
    """The median of an input."""
    return one.distribution.value(float(one.distribution.quantile(np.array([0.5]))[0]))


def correlation_matrix(plan: Plan) -> Array:
    """The correlations of the normal variables behind the inputs, shape (inputs, inputs)."""
    matrix = np.eye(len(plan.inputs))
    for each in plan.correlations:
        matrix[each.first, each.second] = matrix[each.second, each.first] = each.value
    return matrix


def correlated_groups(plan: Plan) -> tuple[int, ...]:
    """A number for each input, the same for those that are correlated with each other, whatever lies between."""
    groups = list(range(len(plan.inputs)))
    for each in plan.correlations:
        old, new = groups[each.second], groups[each.first]
        groups = [new if group == old else group for group in groups]
    order = list(dict.fromkeys(groups))
    return tuple(order.index(group) for group in groups)


def sobol_problem(plan: Plan) -> dict[str, Any]:
    """What SALib calls a problem: the unit cube, correlated inputs in one group."""
    names = list(plan.keys)
    problem: dict[str, Any] = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    if plan.correlations:
        groups = correlated_groups(plan)
        labels = {g: " and ".join(n for n, own in zip(names, groups, strict=True) if own == g) for g in groups}
        problem["groups"] = [labels[group] for group in groups]
    return problem


def sobol_block(plan: Plan) -> int:
    """How many samples of a Saltelli design stand together: one, one for each group exchanged, one with all."""
    return len(set(correlated_groups(plan))) + 2


def _shares(plan: Plan) -> Array:
    count, width = plan.count, len(plan.inputs)
    generator = np.random.default_rng(plan.seed)
    if plan.method == "random":
        return generator.random((count, width))
    if plan.method == "latin hypercube":
        return np.asarray(qmc.LatinHypercube(width, seed=generator).random(count))
    if plan.method == "sobol":
        return np.asarray(qmc.Sobol(width, scramble=True, seed=generator).random(count))
    sample = _saltelli()
    base = plan.count // sobol_block(plan)
    return np.asarray(sample(sobol_problem(plan), base, calc_second_order=False, scramble=True, seed=plan.seed))


def _saltelli() -> Any:
    try:
        from SALib.sample import sobol
    except ImportError as error:
        raise MissingExtraError("SALib") from error
    return sobol.sample


def _correlated(plan: Plan, shares: Array) -> Array:
    if not plan.correlations:
        return shares
    return np.clip(norm.cdf(norm.ppf(shares) @ _factor(correlation_matrix(plan)).T), FARTHEST, 1.0 - FARTHEST)


def _factor(matrix: Array) -> Array:
    """A matrix F with ``F F' = matrix``: Cholesky's, or by eigenvectors where the matrix is barely singular."""
    try:
        return np.asarray(np.linalg.cholesky(matrix))
    except np.linalg.LinAlgError as error:
        sizes, vectors = np.linalg.eigh(matrix)
        if sizes[0] < -SINGULAR:
            problem = "contradict each other: no inputs are correlated like that"
            raise PlanError("correlation", problem, "make them smaller") from error
    return np.asarray(vectors * np.sqrt(np.maximum(sizes, 0.0)))
