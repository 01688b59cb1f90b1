"""Fits a model of the modulus to observations: weighted least squares with no modulus below zero.

The modulus is linear in moduli and damping. Non-negative least squares over a grid of relaxation times and delays
therefore finds where to begin, without local minima; a trust-region method then frees all parameters.
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

from .modulus import Complex, Material, angular, branch_share, complex_modulus, friction_share
from .observations import Observations
from .terms import Terms

Array = NDArray[np.float64]

# Beyond these, in tenths and tens of the measured periods, a branch looks like a damper or like a spring.
TIME_MARGIN = 10.0
TIMES_A_DECADE = 4
DELAYS = 9
STARTS = 3
EVALUATIONS = 200
# A rope that let go entirely could not carry a robot: some modulus is left, as a share of the mean measured one.
LEAST_MODULUS = 0.01
DENSE_TIMES_A_DECADE = 80


@dataclass(frozen=True)
class MaterialFit:
    """The best values of a model's parameters, in SI units, with what they leave of the observations."""

    seen: Observations = field(repr=False)
    terms: Terms
    values: tuple[float, ...]
    chi_squared: float

    @property
    def material(self) -> Material:
        """The fitted constants."""
        return self.terms.material(self.values)

    @property
    def freedom(self) -> int:
        """Degrees of freedom: measured numbers less free parameters."""
        return self.seen.number_count - len(self.values)

    @property
    def p_value(self) -> float:
        """How often noise alone would leave as much."""
        return float(chi2.sf(self.chi_squared, self.freedom))

    @property
    def bic(self) -> float:
        """Bayesian information criterion, up to a constant of the observations: chi-squared + p ln(numbers)."""
        return self.chi_squared + len(self.values) * float(np.log(self.seen.number_count))


@dataclass(frozen=True)
class Problem:
    """Residuals of a model by scaled parameters, which are all of order one; times enter by their logarithm."""

    seen: Observations
    terms: Terms

    @cached_property
    def _omega(self) -> Array:
        return angular(self.seen.frequency)

    @cached_property
    def _target(self) -> Array:
        return self.seen.whitened(self.seen.storage, self.seen.loss, self.seen.static)

    @cached_property
    def _hysteresis(self) -> Array:
        """Loss modulus of each parameter of hysteresis of one, shape (N, 0 or 1)."""
        kinds = {"none": [], "modulus": [np.ones_like(self._omega)], "stress": [friction_share(self.seen.amplitude)]}
        return np.array(kinds[self.terms.hysteresis]).reshape(-1, len(self._omega)).T

    @cached_property
    def scale(self) -> Array:
        """SI units of one scaled parameter; of a time, its middle."""
        modulus = float(np.mean(np.hypot(self.seen.storage, self.seen.loss)))
        middle = float(np.sqrt(self._omega.min() * self._omega.max()))
        branches = [modulus] * self.terms.branches + [1.0 / middle] * self.terms.branches
        viscous = [modulus / middle] * self.terms.damping
        friction = [modulus / size for size in self._hysteresis.max(axis=0)]
        return np.array([modulus, *viscous, *friction, *branches, *([1.0 / self._omega.max()] * self.terms.delay)])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Least and greatest scaled parameters."""
        linear, branches = self.terms.linear_count, self.terms.branches
        reach = 0.5 * np.log(self._omega.max() / self._omega.min()) + np.log(TIME_MARGIN)
        quarter = [np.pi / 2.0] * self.terms.delay
        lower = [LEAST_MODULUS] + [0.0] * (linear - 1) + [-reach] * branches + [-each for each in quarter]
        upper = [np.inf] * linear + [reach] * branches + quarter
        return np.array(lower), np.array(upper)

    def in_units(self, scaled: Array) -> Array:
        """Parameters in SI units."""
        first, last = self._times()
        values = np.array(scaled, dtype=float)
        values[first:last] = np.exp(values[first:last])
        product: Array = values * self.scale
        return product

    def in_scale(self, values: Array) -> Array:
        """Scaled parameters of values in SI units."""
        first, last = self._times()
        scaled = np.asarray(values, dtype=float) / self.scale
        scaled[first:last] = np.log(scaled[first:last])
        return scaled

    def residual(self, scaled: Array) -> Array:
        """Model less measured, whitened, shape (2N + M,)."""
        linear = scaled[: self.terms.linear_count]
        return np.asarray(self._whitened(self._columns(scaled)) @ linear - self._target)

    def jacobian(self, scaled: Array) -> Array:
        """Derivatives of the residual, shape (2N + M, p)."""
        columns = self._columns(scaled)
        first, last = self._times()
        linear = scaled[: self.terms.linear_count]
        slopes: list[Complex] = [columns]
        if self.terms.branches:
            times = self.in_units(scaled)[first:last]
            shares = columns[:, self.terms.linear_count - self.terms.branches :]
            # d/d ln(tau) of x / (1 + x) is x / (1 + x)^2.
            moduli: Array = linear[-self.terms.branches :]
            slopes.append(np.asarray(shares * moduli / (1.0 + 1j * np.outer(self._omega, times))))
        if self.terms.delay:
            turn = 1j * self._omega * self.scale[-1]
            slopes.append((turn * (columns @ linear))[:, None])
        return self._whitened(np.hstack(slopes))

    def linear_solution(self, nonlinear: Array) -> tuple[Array, float]:
        """All scaled parameters with the best linear ones for given times and delay, and the chi-squared."""
        lower = self.bounds[0][: self.terms.linear_count]
        scaled = np.concatenate([lower, nonlinear])
        matrix = self._whitened(self._columns(scaled))
        linear, left = nnls(matrix, self._target - matrix @ lower)
        return np.concatenate([lower + linear, nonlinear]), left**2

    def starts(self) -> list[Array]:
        """Where to begin: the best points of a grid of times and delays, each with its best linear parameters."""
        lower, upper = (bound[self.terms.linear_count :] for bound in self.bounds)
        times: Array = np.zeros(0)
        if self.terms.branches:
            decades = (upper[0] - lower[0]) / np.log(10.0)
            times = np.linspace(lower[0], upper[0], 1 + int(np.ceil(TIMES_A_DECADE * decades)))
        delays = np.linspace(lower[-1], upper[-1], DELAYS)[1:-1, None] if self.terms.delay else np.zeros((1, 0))
        found = [start for delay in delays for start in self._starts_on(times, delay)]
        return [scaled for _, scaled in sorted(found, key=lambda each: each[0])[:STARTS]]

    def _starts_on(self, times: Array, delay: Array) -> Iterator[tuple[float, Array]]:
        """Chi-squared and scaled parameters of every choice of branches from these times."""
        branches, head = self.terms.branches, self.terms.linear_count - self.terms.branches
        dense = Problem(self.seen, replace(self.terms, branches=len(times)))
        scaled = np.concatenate([np.zeros(head + len(times)), times, delay])
        matrix = dense._whitened(dense._columns(scaled))
        # The triangle of the QR decomposition has the same least squares in far fewer rows.
        short: Array = np.asarray(np.linalg.qr(np.column_stack([matrix, self._target]), mode="r"))
        rest = short[:, -1] - LEAST_MODULUS * short[:, 0]
        for chosen in combinations(range(len(times)), branches):
            columns = [*range(head), *(head + place for place in chosen)]
            linear, left = nnls(short[:, columns], rest)
            linear[0] += LEAST_MODULUS
            yield left**2, np.concatenate([linear, times[list(chosen)], delay])

    def _times(self) -> tuple[int, int]:
        return self.terms.linear_count, self.terms.linear_count + self.terms.branches

    def _columns(self, scaled: Array) -> Complex:
        """The complex modulus of each linear parameter of one, shape (N, linear_count)."""
        first, last = self._times()
        values = self.in_units(scaled)
        ones = np.ones_like(self._omega)
        columns: list[Any] = [ones, *([1j * self._omega] * self.terms.damping), *(1j * self._hysteresis.T)]
        columns += [branch_share(self._omega, time) for time in values[first:last]]
        lead = np.exp(1j * self._omega * (values[-1] if self.terms.delay else 0.0))
        modulus: Complex = np.column_stack(columns) * self.scale[: self.terms.linear_count] * lead[:, None]
        return modulus

    def _whitened(self, columns: Complex) -> Array:
        long_term = np.zeros((len(self.seen.static), columns.shape[1]))
        long_term[:, 0] = self.scale[0]
        return self.seen.whitened(columns.real, columns.imag, long_term)


def fit_terms(seen: Observations, terms: Terms) -> MaterialFit:
    """The most probable values of a model's parameters."""
    problem = Problem(seen, terms)
    starts = problem.starts()
    if len(starts[0]) == terms.linear_count:
        scaled, left = problem.linear_solution(np.zeros(0))
    else:
        scaled, left = solve(problem, starts)
        # The trust region only comes near a bound; the linear solution sits on it.
        scaled, left = min(problem.linear_solution(scaled[terms.linear_count :]), (scaled, left), key=lambda s: s[1])
    values = _sorted_branches(terms, problem.in_units(scaled))
    return MaterialFit(seen, terms, tuple(values.tolist()), float(left))


def solve(problem: Problem, starts: list[Array], fixed: Mapping[int, float] | None = None) -> tuple[Array, float]:
    """Scaled parameters of least chi-squared, from the best of some starts, and the chi-squared.

    ``fixed`` holds scaled values of parameters, by index, that stay as they are.
    """
    held = dict(fixed or {})
    free = np.array([index for index in range(len(problem.scale)) if index not in held], dtype=int)
    lower, upper = problem.bounds

    def whole(part: Array) -> Array:
        scaled = np.zeros(len(problem.scale))
        scaled[free] = part
        for index, value in held.items():
            scaled[index] = value
        return scaled

    def residual(part: Array) -> Array:
        return problem.residual(whole(part))

    def slopes(part: Array) -> Array:
        return np.asarray(problem.jacobian(whole(part))[:, free])

    if not len(free):
        return whole(np.zeros(0)), float(np.sum(residual(np.zeros(0)) ** 2))
    solutions = [
        least_squares(
            residual,
            np.clip(start[free], lower[free], upper[free]),
            jac=slopes,
            bounds=(lower[free], upper[free]),
            ftol=1e-9,
            max_nfev=EVALUATIONS,
        )
        for start in starts
    ]
    best = min(solutions, key=lambda solution: float(solution.cost))
    return whole(best.x), 2.0 * float(best.cost)


def residuals(seen: Observations, material: Material) -> Array:
    """Model less measured of any material, whitened, shape (2N + M,); its squares sum to chi-squared."""
    modulus = complex_modulus(material, seen.frequency, seen.amplitude)
    long_term = material.modulus - seen.static
    return seen.whitened(modulus.real - seen.storage, modulus.imag - seen.loss, long_term)


def relaxation_floor(seen: Observations) -> float:
    """The least chi-squared that damping and any number of branches can leave: a convex problem, solved globally.

    No passive linear solid does better; what is above noise here, relaxation cannot be the reason of.
    """
    problem = Problem(seen, Terms(damping=True, branches=1))
    lower, upper = problem.bounds
    count = 1 + int(np.ceil(DENSE_TIMES_A_DECADE * (upper[-1] - lower[-1]) / np.log(10.0)))
    dense = Problem(seen, Terms(damping=True, branches=count))
    return dense.linear_solution(np.linspace(lower[-1], upper[-1], count))[1]


def _sorted_branches(terms: Terms, values: Array) -> Array:
    """The same parameters with the branches from the shortest time on."""
    count, first = terms.branches, terms.linear_count
    order = np.argsort(values[first : first + count])
    ordered = values.copy()
    ordered[first - count : first] = values[first - count : first][order]
    ordered[first : first + count] = values[first : first + count][order]
    return ordered
