"""Maximum-likelihood fits of the parameters of a robot's effects, and their validation on other samples."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tautwire_fmu.laws.effects import BY_NAME, Parameter

from ..errors import TautwireError, UnreachableError
from ..recordings.start_position import with_start
from ..robot.schema import Robot
from ..robot.symbolic_model import FORMULA_INDEX, FreeParameter
from .estimation_data import DataSet
from .hypotheses import Hypothesis, free_parameters, value_of, with_values
from .kalman_filter import Noise
from .likelihood import Innovations, Likelihood
from .normal_equations import compressed_residuals

Array = NDArray[np.float64]

# Acceleration noise density and relative change of the cost at which to stop, stage by stage; then without it.
COARSE_FIT_STAGES = ((0.1, 1e-3), (0.01, 1e-3))
FINE_COST_TOLERANCE = 1e-7
MAX_FIT_EVALUATIONS = 15
MAX_COMPILED_LIKELIHOODS = 40
NORMAL_QUANTILE_95 = 1.959964


class NoFitError(TautwireError):
    """A model has no finite innovations where its fit would begin; carries the values there."""

    def __init__(self, values: Array) -> None:
        self.values = values
        super().__init__(f"no fit can begin at {values.tolist()}: the model has no finite output there")


@dataclass(frozen=True)
class Fit:
    """Fitted parameters of a robot's effects, with their covariance.

    ``values`` of the ``free`` ones have shape (p,); ``covariance`` (p, p) is from the curvature of the likelihood.
    """

    robot: Robot
    free: tuple[FreeParameter, ...]
    values: Array
    covariance: Array

    @property
    def standard_deviations(self) -> Array:
        """Standard deviations (p,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def interval(self, index: int) -> tuple[float, float]:
        """95 % interval of one parameter."""
        half_width = NORMAL_QUANTILE_95 * float(self.standard_deviations[index])
        return float(self.values[index]) - half_width, float(self.values[index]) + half_width


class Fitter:
    """Fits and validates robots on data sets; keeps compiled likelihoods, calls ``poll_interrupts`` before each run."""

    def __init__(self, noise: Noise, poll_interrupts: Callable[[], None] = lambda: None) -> None:
        self.noise = noise
        self.poll_interrupts = poll_interrupts
        self._compiled: dict[tuple[object, ...], Likelihood] = {}

    def fit(self, robot: Robot, chosen: Collection[Hypothesis], data: DataSet) -> Fit:
        """Least squares on whitened innovations, first with acceleration noise, then under the exact model.

        Frees the parameters of the chosen hypotheses. The exact stage begins where the coarse one ended or where that
        began, whichever is more probable.
        """
        return self._fit(robot, chosen, data, (*COARSE_FIT_STAGES, (0.0, FINE_COST_TOLERANCE)))

    def fit_from(
        self,
        starts: Sequence[Robot],
        chosen: Collection[Hypothesis],
        data: DataSet,
        min_log_likelihood: float,
        cost_tolerance: float = FINE_COST_TOLERANCE,
    ) -> Fit:
        """Fit from the first start whose log-likelihood is at least ``min_log_likelihood``, under the exact model.

        Where none does, the last start is fitted as :meth:`fit` does. ``cost_tolerance`` is the relative change of the
        cost at which the exact stage ends.

        Raises NoFitError, UnreachableError.
        """
        for start in starts:
            try:
                log_likelihood = self.judged(start, chosen, data).log_likelihood(data.rows)
            except UnreachableError:
                continue
            if log_likelihood >= min_log_likelihood:
                return self._fit(start, chosen, data, ((0.0, cost_tolerance),))
        return self._fit(starts[-1], chosen, data, (*COARSE_FIT_STAGES, (0.0, cost_tolerance)))

    def _fit(
        self, robot: Robot, chosen: Collection[Hypothesis], data: DataSet, stages: Sequence[tuple[float, float]]
    ) -> Fit:
        free = free_parameters(robot, chosen)
        if not free:
            return Fit(robot, (), np.zeros(0), np.zeros((0, 0)))
        start = np.array([value_of(robot, f) for f in free])
        scale = parameter_scales(robot, free)
        lower, upper = (bounds / scale for bounds in parameter_bounds(robot, free))
        likelihood = self._compiled_likelihood(with_start(robot, data.start), free, data)
        scaled_start = scaled = start / scale
        jacobian = np.zeros((0, len(free)))
        for noise_density, cost_tolerance in stages:
            residual = _Residual(likelihood, data, scale, noise_density, self.poll_interrupts)
            if noise_density == 0.0:
                scaled = max((scaled, scaled_start), key=residual.log_likelihood)
            # The first trust region is as large as the start: counted from one, a parameter near zero is not stuck.
            residual.origin = scaled - 1.0
            if not np.all(np.isfinite(residual.residuals(np.ones(len(free))))):
                raise NoFitError(scaled * scale)
            solution = least_squares(
                residual.residuals,
                np.ones(len(free)),
                jac=residual.jacobian,
                bounds=(lower - residual.origin, upper - residual.origin),
                x_scale="jac",
                ftol=cost_tolerance,
                max_nfev=MAX_FIT_EVALUATIONS,
            )
            scaled, jacobian = residual.origin + solution.x, np.asarray(solution.jac, dtype=float)
        # What is scaled back may end beyond a bound by its last digit.
        values = np.clip(scaled * scale, *parameter_bounds(robot, free))
        covariance = np.linalg.pinv(jacobian.T @ jacobian) * np.outer(scale, scale)
        fitted = with_values(robot, free, dict(zip(free, values.tolist(), strict=True)))
        return Fit(fitted, free, values, covariance)

    def innovations(self, robot: Robot, data: DataSet) -> Innovations:
        """Innovations of all samples of a recording under a robot as it is."""
        return self._compiled_likelihood(with_start(robot, data.start), (), data).innovations(data.recording, ())

    def judged(self, robot: Robot, chosen: Collection[Hypothesis], data: DataSet) -> Innovations:
        """As :meth:`innovations`, with the likelihood that was compiled for fitting the chosen hypotheses."""
        likelihood, values = self.likelihood(robot, chosen, data)
        return likelihood.innovations(data.recording, values)

    def likelihood(self, robot: Robot, chosen: Collection[Hypothesis], data: DataSet) -> tuple[Likelihood, list[float]]:
        """The likelihood compiled for fitting the chosen hypotheses, and the robot's values of their parameters."""
        free = free_parameters(robot, chosen)
        values = [value_of(robot, f) for f in free]
        return self._compiled_likelihood(with_start(robot, data.start), free, data), values

    def open_loop_variances(self, robot: Robot, data: DataSet) -> Array:
        """See :meth:`tautwire.estimation.likelihood.Likelihood.open_loop_variances`."""
        return self._compiled_likelihood(with_start(robot, data.start), (), data).open_loop_variances(
            data.recording, ()
        )

    def _compiled_likelihood(self, robot: Robot, free: Sequence[FreeParameter], data: DataSet) -> Likelihood:
        self.poll_interrupts()
        interval = float(np.median(np.diff(data.recording.time)))
        structure = with_values(robot, free, dict.fromkeys(free, 0.0))
        key = (structure, tuple(free), round(interval, 9))
        if key not in self._compiled:
            if len(self._compiled) >= MAX_COMPILED_LIKELIHOODS:
                self._compiled.pop(next(iter(self._compiled)))
            self._compiled[key] = Likelihood(robot, free, self.noise, interval)
        return self._compiled[key]


def parameter_bounds(robot: Robot, free: Sequence[FreeParameter]) -> tuple[Array, Array]:
    """Lower and upper bound of each free parameter, (p,) each."""
    declarations = _parameter_declarations(robot, free)
    return np.array([p.minimum for p in declarations], dtype=float), np.array(
        [p.maximum for p in declarations], dtype=float
    )


def parameter_scales(robot: Robot, free: Sequence[FreeParameter]) -> Array:
    """Scale of each free parameter (p,): its value, or where fits begin if that is more."""
    declarations = _parameter_declarations(robot, free)
    return np.array([max(abs(value_of(robot, f)), abs(p.start)) for f, p in zip(free, declarations, strict=True)])


def _parameter_declarations(robot: Robot, free: Sequence[FreeParameter]) -> list[Parameter]:
    """Declaration of each free parameter; a number of a formula is unbounded."""
    return [
        Parameter(f.name, "", "", -np.inf, np.inf, 0.0, value_of(robot, f) or 1.0)
        if f.effect_index == FORMULA_INDEX
        else {p.name: p for p in BY_NAME[robot.effects[f.effect_index].name].parameters}[f.name]
        for f in free
    ]


class _Residual:
    """Compressed innovations and their Jacobian in scaled parameters, cached at the last point."""

    def __init__(
        self,
        likelihood: Likelihood,
        data: DataSet,
        scale: Array,
        acceleration_noise_density: float,
        poll_interrupts: Callable[[], None],
    ) -> None:
        self.poll_interrupts = poll_interrupts
        self.likelihood = likelihood
        self.sample = data
        self.scale = scale
        self.acceleration_noise_density = acceleration_noise_density
        self.origin = np.zeros(len(scale))
        self._evaluated_at: Array | None = None
        self._cached: tuple[Array, Array] = (np.zeros(0), np.zeros((0, 0)))

    def log_likelihood(self, scaled: Array) -> float:
        innovations = self.likelihood.innovations(
            self.sample.recording, scaled * self.scale, self.acceleration_noise_density
        )
        value = innovations.log_likelihood(self.sample.rows)
        return value if np.isfinite(value) else -np.inf

    def residuals(self, offset: Array) -> Array:
        return self._evaluate(self.origin + offset)[0]

    def jacobian(self, offset: Array) -> Array:
        return self._evaluate(self.origin + offset)[1]

    def _evaluate(self, scaled: Array) -> tuple[Array, Array]:
        if self._evaluated_at is None or not np.array_equal(self._evaluated_at, scaled):
            self.poll_interrupts()
            residuals, sensitivities = compressed_residuals(
                self.likelihood, scaled * self.scale, self.sample, self.acceleration_noise_density
            )
            self._cached = (residuals, sensitivities * self.scale)
            self._evaluated_at = scaled.copy()
        return self._cached


@dataclass(frozen=True)
class FitTask:
    """Fit of the chosen hypotheses to estimation data, from starts that are tried in turn; validated on other data.

    ``min_log_likelihood`` is that of the data without the last of them; for ``cost_tolerance`` see
    :meth:`Fitter.fit_from`.
    """

    chosen: tuple[Hypothesis, ...]
    starts: tuple[Robot, ...]
    min_log_likelihood: float
    cost_tolerance: float


@dataclass(frozen=True)
class ValidatedFit:
    """A fit with its validation: log-likelihood and mean square of the innovations on validation data."""

    fit: Fit
    log_likelihood: float
    mean_square: float


def fit_and_validate(fitter: Fitter, task: FitTask, data: DataSet, validation: DataSet) -> ValidatedFit | None:
    """Fit and validate a task; None where the cables cannot hold the platform, or nothing finite comes out."""
    try:
        fit = fitter.fit_from(task.starts, task.chosen, data, task.min_log_likelihood, task.cost_tolerance)
        innovations = fitter.judged(fit.robot, task.chosen, validation)
    except (UnreachableError, NoFitError):
        return None
    log_likelihood = innovations.log_likelihood(validation.rows)
    mean_square = float(np.nanmean(innovations.mean_square(validation.rows)))
    return ValidatedFit(fit, log_likelihood, mean_square) if np.isfinite(log_likelihood) else None


def fit_and_validate_in_worker(noise: Noise, task: FitTask, data: DataSet, validation: DataSet) -> ValidatedFit | None:
    """As :func:`fit_and_validate`, in a worker process with its own fitter."""
    return fit_and_validate(worker_fitter(noise), task, data, validation)


@lru_cache(maxsize=1)
def worker_fitter(noise: Noise) -> Fitter:
    """The fitter of this worker process. Its compiled likelihoods serve the next task of the same process."""
    return Fitter(noise)
