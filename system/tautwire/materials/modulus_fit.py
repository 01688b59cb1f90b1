"""Fits a model of the complex modulus to observations by weighted least squares with no modulus below zero.

The modulus is linear in moduli and damping. Non-negative least squares over a grid of relaxation times and delays
therefore finds starting values, without local minima; a trust-region method then frees all parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls
from scipy.stats import chi2

from .modulus_observations import ModulusObservations
from .viscoelastic_model import (
    Complex,
    Material,
    ModelStructure,
    angular_frequency,
    complex_modulus,
    normalised_branch_modulus,
    normalised_friction_loss,
)

Array = NDArray[np.float64]

# Relaxation times up to this factor beyond the measured periods; a branch beyond looks like a damper or a spring.
RELAXATION_TIME_MARGIN = 10.0
GRID_TIMES_PER_DECADE = 4
GRID_DELAYS = 9
MAX_STARTS = 3
MAX_EVALUATIONS = 200
# Lower bound of the long-term modulus over the mean measured one: a rope that relaxes entirely carries no robot.
MIN_RELATIVE_MODULUS = 0.01
DENSE_GRID_TIMES_PER_DECADE = 80


@dataclass(frozen=True)
class MaterialFit:
    """Least-squares estimate of a model's parameters, in SI units, with the chi-squared of its residuals."""

    observations: ModulusObservations = field(repr=False)
    structure: ModelStructure
    values: tuple[float, ...]
    chi_squared: float

    @property
    def material(self) -> Material:
        """The fitted constants."""
        return self.structure.material(self.values)

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom: measured numbers less free parameters."""
        return self.observations.measurement_count - len(self.values)

    @property
    def p_value(self) -> float:
        """Probability that noise alone gives as large a chi-squared."""
        return float(chi2.sf(self.chi_squared, self.degrees_of_freedom))

    @property
    def bic(self) -> float:
        """Bayesian information criterion, up to a constant of the observations: chi-squared + p ln(numbers)."""
        return self.chi_squared + len(self.values) * float(np.log(self.observations.measurement_count))


@dataclass(frozen=True)
class LeastSquaresProblem:
    """Least-squares problem in scaled parameters, which are all of order one; times enter by their logarithm."""

    observations: ModulusObservations
    structure: ModelStructure

    @cached_property
    def _omega(self) -> Array:
        return angular_frequency(self.observations.frequency)

    @cached_property
    def _whitened_measurements(self) -> Array:
        return self.observations.whiten(
            self.observations.storage, self.observations.loss, self.observations.static_modulus
        )

    @cached_property
    def _hysteresis_columns(self) -> Array:
        """Loss modulus for a hysteresis parameter of one, shape (N, 0 or 1)."""
        kinds = {
            "none": [],
            "modulus": [np.ones_like(self._omega)],
            "stress": [normalised_friction_loss(self.observations.amplitude)],
        }
        return np.array(kinds[self.structure.hysteresis]).reshape(-1, len(self._omega)).T

    @cached_property
    def scale(self) -> Array:
        """Scale of each parameter in SI units; of a relaxation time, the middle of its range."""
        modulus = float(np.mean(np.hypot(self.observations.storage, self.observations.loss)))
        middle = float(np.sqrt(self._omega.min() * self._omega.max()))
        branches = [modulus] * self.structure.branches + [1.0 / middle] * self.structure.branches
        viscous = [modulus / middle] * self.structure.damping
        friction = [modulus / size for size in self._hysteresis_columns.max(axis=0)]
        return np.array([modulus, *viscous, *friction, *branches, *([1.0 / self._omega.max()] * self.structure.delay)])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the scaled parameters."""
        linear, branches = self.structure.linear_count, self.structure.branches
        reach = 0.5 * np.log(self._omega.max() / self._omega.min()) + np.log(RELAXATION_TIME_MARGIN)
        max_delay = [np.pi / 2.0] * self.structure.delay
        lower = [MIN_RELATIVE_MODULUS] + [0.0] * (linear - 1) + [-reach] * branches + [-each for each in max_delay]
        upper = [np.inf] * linear + [reach] * branches + max_delay
        return np.array(lower), np.array(upper)

    def to_si(self, scaled: Array) -> Array:
        """Convert scaled parameters to SI units."""
        first, last = self._time_indices()
        values = np.array(scaled, dtype=float)
        values[first:last] = np.exp(values[first:last])
        product: Array = values * self.scale
        return product

    def to_scaled(self, values: Array) -> Array:
        """Convert parameters in SI units to scaled ones."""
        first, last = self._time_indices()
        scaled = np.asarray(values, dtype=float) / self.scale
        scaled[first:last] = np.log(scaled[first:last])
        return scaled

    def residual(self, scaled: Array) -> Array:
        """Residual: model less measured, whitened, shape (2N + M,)."""
        linear = scaled[: self.structure.linear_count]
        return np.asarray(self._whiten(self._modulus_columns(scaled)) @ linear - self._whitened_measurements)

    def jacobian(self, scaled: Array) -> Array:
        """Jacobian of the residual, shape (2N + M, p)."""
        columns = self._modulus_columns(scaled)
        first, last = self._time_indices()
        linear = scaled[: self.structure.linear_count]
        derivatives: list[Complex] = [columns]
        if self.structure.branches:
            times = self.to_si(scaled)[first:last]
            branch_columns = columns[:, self.structure.linear_count - self.structure.branches :]
            # d/d ln(tau) of x / (1 + x) is x / (1 + x)^2.
            moduli: Array = linear[-self.structure.branches :]
            derivatives.append(np.asarray(branch_columns * moduli / (1.0 + 1j * np.outer(self._omega, times))))
        if self.structure.delay:
            delay_factor = 1j * self._omega * self.scale[-1]
            derivatives.append((delay_factor * (columns @ linear))[:, None])
        return self._whiten(np.hstack(derivatives))

    def solve_linear(self, nonlinear: Array) -> tuple[Array, float]:
        """Variable projection: scaled parameters, the linear ones best for fixed times and delay, and chi-squared."""
        lower = self.bounds[0][: self.structure.linear_count]
        scaled = np.concatenate([lower, nonlinear])
        matrix = self._whiten(self._modulus_columns(scaled))
        linear, residual_norm = nnls(matrix, self._whitened_measurements - matrix @ lower)
        return np.concatenate([lower + linear, nonlinear]), residual_norm**2

    def starting_points(self) -> list[Array]:
        """Starting points: the best of a grid search over times and delays, each with its best linear parameters."""
        lower, upper = (bound[self.structure.linear_count :] for bound in self.bounds)
        times: Array = np.zeros(0)
        if self.structure.branches:
            decades = (upper[0] - lower[0]) / np.log(10.0)
            times = np.linspace(lower[0], upper[0], 1 + int(np.ceil(GRID_TIMES_PER_DECADE * decades)))
        delays = (
            np.linspace(lower[-1], upper[-1], GRID_DELAYS)[1:-1, None] if self.structure.delay else np.zeros((1, 0))
        )
        candidates = [start for delay in delays for start in self._grid_starts(times, delay)]
        return [scaled for _, scaled in sorted(candidates, key=lambda each: each[0])[:MAX_STARTS]]

    def _grid_starts(self, times: Array, delay: Array) -> Iterator[tuple[float, Array]]:
        """Chi-squared and scaled parameters for every choice of branches from the grid of times."""
        branches, leading_count = self.structure.branches, self.structure.linear_count - self.structure.branches
        dense = LeastSquaresProblem(self.observations, replace(self.structure, branches=len(times)))
        scaled = np.concatenate([np.zeros(leading_count + len(times)), times, delay])
        matrix = dense._whiten(dense._modulus_columns(scaled))
        # The triangular factor of QR has the same least-squares solution in far fewer rows.
        triangle: Array = np.asarray(np.linalg.qr(np.column_stack([matrix, self._whitened_measurements]), mode="r"))
        target = triangle[:, -1] - MIN_RELATIVE_MODULUS * triangle[:, 0]
        for time_indices in combinations(range(len(times)), branches):
            columns = [*range(leading_count), *(leading_count + index for index in time_indices)]
            linear, residual_norm = nnls(triangle[:, columns], target)
            linear[0] += MIN_RELATIVE_MODULUS
            yield residual_norm**2, np.concatenate([linear, times[list(time_indices)], delay])

    def _time_indices(self) -> tuple[int, int]:
        return self.structure.linear_count, self.structure.linear_count + self.structure.branches

    def _modulus_columns(self, scaled: Array) -> Complex:
        """Complex modulus for each linear parameter of one, shape (N, linear_count)."""
        first, last = self._time_indices()
        values = self.to_si(scaled)
        ones = np.ones_like(self._omega)
        columns: list[Any] = [ones, *([1j * self._omega] * self.structure.damping), *(1j * self._hysteresis_columns.T)]
        columns += [normalised_branch_modulus(self._omega, time) for time in values[first:last]]
        phase_lead = np.exp(1j * self._omega * (values[-1] if self.structure.delay else 0.0))
        modulus: Complex = np.column_stack(columns) * self.scale[: self.structure.linear_count] * phase_lead[:, None]
        return modulus

    def _whiten(self, columns: Complex) -> Array:
        long_term = np.zeros((len(self.observations.static_modulus), columns.shape[1]))
        long_term[:, 0] = self.scale[0]
        return self.observations.whiten(columns.real, columns.imag, long_term)


def fit_structure(observations: ModulusObservations, structure: ModelStructure) -> MaterialFit:
    """Fit a model structure: the maximum-likelihood estimate of its parameters."""
    problem = LeastSquaresProblem(observations, structure)
    starts = problem.starting_points()
    if len(starts[0]) == structure.linear_count:
        scaled, chi_squared = problem.solve_linear(np.zeros(0))
    else:
        scaled, chi_squared = minimise(problem, starts)
        # The trust region only approaches a bound; the linear solution lies on it.
        scaled, chi_squared = min(
            problem.solve_linear(scaled[structure.linear_count :]), (scaled, chi_squared), key=lambda s: s[1]
        )
    values = _sorted_branches(structure, problem.to_si(scaled))
    return MaterialFit(observations, structure, tuple(values.tolist()), float(chi_squared))


def minimise(
    problem: LeastSquaresProblem, starts: list[Array], fixed_values: Mapping[int, float] | None = None
) -> tuple[Array, float]:
    """Scaled parameters that minimise chi-squared, from the best of several starting points, and that chi-squared.

    ``fixed_values`` holds scaled values of parameters, by index, that are not varied.
    """
    fixed_by_index = dict(fixed_values or {})
    free = np.array([index for index in range(len(problem.scale)) if index not in fixed_by_index], dtype=int)
    lower, upper = problem.bounds

    def with_fixed(free_values: Array) -> Array:
        scaled = np.zeros(len(problem.scale))
        scaled[free] = free_values
        for index, value in fixed_by_index.items():
            scaled[index] = value
        return scaled

    def residual(free_values: Array) -> Array:
        return problem.residual(with_fixed(free_values))

    def jacobian(free_values: Array) -> Array:
        return np.asarray(problem.jacobian(with_fixed(free_values))[:, free])

    if not len(free):
        return with_fixed(np.zeros(0)), float(np.sum(residual(np.zeros(0)) ** 2))
    solutions = [
        least_squares(
            residual,
            np.clip(start[free], lower[free], upper[free]),
            jac=jacobian,
            bounds=(lower[free], upper[free]),
            ftol=1e-9,
            max_nfev=MAX_EVALUATIONS,
        )
        for start in starts
    ]
    best = min(solutions, key=lambda solution: float(solution.cost))
    return with_fixed(best.x), 2.0 * float(best.cost)


def whitened_residuals(observations: ModulusObservations, material: Material) -> Array:
    """Whitened residuals, model less measured, of any material, shape (2N + M,); their squares sum to chi-squared."""
    modulus = complex_modulus(material, observations.frequency, observations.amplitude)
    long_term = material.modulus - observations.static_modulus
    return observations.whiten(modulus.real - observations.storage, modulus.imag - observations.loss, long_term)


def relaxation_floor(observations: ModulusObservations) -> float:
    """Minimum of chi-squared over damping and any number of branches: a convex problem, solved globally.

    No passive linear solid does better; relaxation cannot explain what is above noise here.
    """
    problem = LeastSquaresProblem(observations, ModelStructure(damping=True, branches=1))
    lower, upper = problem.bounds
    count = 1 + int(np.ceil(DENSE_GRID_TIMES_PER_DECADE * (upper[-1] - lower[-1]) / np.log(10.0)))
    dense = LeastSquaresProblem(observations, ModelStructure(damping=True, branches=count))
    return dense.solve_linear(np.linspace(lower[-1], upper[-1], count))[1]


def _sorted_branches(structure: ModelStructure, values: Array) -> Array:
    """The parameters with the branches sorted from the shortest time on."""
    count, first = structure.branches, structure.linear_count
    order = np.argsort(values[first : first + count])
    ordered = values.copy()
    ordered[first - count : first] = values[first - count : first][order]
    ordered[first : first + count] = values[first : first + count][order]
    return ordered
