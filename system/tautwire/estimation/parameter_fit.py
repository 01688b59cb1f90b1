"""Maximum-likelihood fits of the parameters of a robot's effects."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tautwire_fmu.laws.effects import BY_NAME, Parameter

from ..errors import TautwireError, UnreachableError
from ..robot.schema import Robot
from ..robot.symbolic_model import FORMULA_INDEX, FreeParameter
from .disturbance import NEUTRAL, Disturbance
from .estimation_data import DataSet
from .hypotheses import Hypothesis, free_parameters, value_of, with_values
from .innovations import Innovations
from .kalman_filter import Noise
from .likelihood import Likelihood
from .normal_equations import NothingToGainError, StoppingRule, compressed_residuals
from .policy import DEFAULT_POLICY, FitPolicy

Array = NDArray[np.float64]

MAX_COMPILED_LIKELIHOODS = 40
# Instructions of all of them, each of which takes 100 to 200 bytes in each process.
MAX_KEPT_INSTRUCTIONS = 5_000_000
NORMAL_QUANTILE_95 = 1.959964


class NoFitError(TautwireError):
    """A model has no finite innovations where its fit would begin; carries the values there."""

    def __init__(self, values: Array) -> None:
        self.values = values
        super().__init__(f"no fit can start at {values.tolist()}: the model has no finite output there")


@dataclass(frozen=True)
class Fit:
    """Fitted parameters of a robot's effects, with their covariance.

    ``values`` of the ``free`` ones have shape (p,); ``covariance`` (p, p) is from the curvature of the likelihood.
    """

    robot: Robot
    free: tuple[FreeParameter, ...]
    values: Array
    covariance: Array

    @classmethod
    def without_parameters(cls, robot: Robot) -> Fit:
        """The fit of a robot with nothing to fit."""
        return cls(robot, (), np.zeros(0), np.zeros((0, 0)))

    @property
    def standard_deviations(self) -> Array:
        """Standard deviations (p,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def interval(self, index: int) -> tuple[float, float]:
        """95 % interval of one parameter."""
        half_width = NORMAL_QUANTILE_95 * float(self.standard_deviations[index])
        return float(self.values[index]) - half_width, float(self.values[index]) + half_width

    def parameter_index(self, effect: str, cables: tuple[int, ...], parameter: str) -> int:
        """Index of a fitted parameter of one effect on some cables."""
        for index, free in enumerate(self.free):
            if free.effect_index != FORMULA_INDEX and free.name == parameter:
                setting = self.robot.effects[free.effect_index]
                if (setting.name, setting.cables) == (effect, cables):
                    return index
        raise KeyError((effect, cables, parameter))


class Fitter:
    """Fits robots to data sets; keeps compiled likelihoods, calls ``poll_interrupts`` before each run.

    Sent to a worker process it becomes the fitter of that process, whose compiled likelihoods serve the next task.
    """

    def __init__(
        self,
        noise: Noise,
        poll_interrupts: Callable[[], None] = lambda: None,
        policy: FitPolicy = DEFAULT_POLICY.fit,
    ) -> None:
        self.noise = noise
        self.poll_interrupts = poll_interrupts
        self.policy = policy
        self._compiled: dict[tuple[object, ...], Likelihood] = {}

    def __reduce__(self) -> tuple[Callable[[Noise, FitPolicy], Fitter], tuple[Noise, FitPolicy]]:
        return _fitter_in_worker, (self.noise, self.policy)

    def with_disturbance(self, disturbance: Disturbance) -> Fitter:
        """The fitter under another disturbance, with the same compiled likelihoods; it has to have one."""
        fitter = Fitter(replace(self.noise, disturbance=disturbance), self.poll_interrupts, self.policy)
        fitter._compiled = self._compiled
        return fitter

    @property
    def has_disturbance(self) -> bool:
        """Whether a disturbance is a part of the model."""
        return self.noise.disturbance is not None

    def fit_from(
        self,
        starts: Sequence[Robot],
        chosen: Collection[Hypothesis],
        data: DataSet,
        min_log_likelihood: float = np.inf,
        cost_tolerance: float | None = None,
    ) -> Fit:
        """Least squares on whitened innovations, which frees the parameters of the chosen hypotheses.

        Begins at the first start whose log-likelihood is at least ``min_log_likelihood``, under the exact model. Where
        none does, at the last one with acceleration noise; the exact stage begins where that ended or where it began,
        whichever is more probable, and ends at ``cost_tolerance``, a relative change of the cost.

        Raises NoFitError, UnreachableError.
        """
        robot, is_near = self._first_near(starts, chosen, data, min_log_likelihood)
        exact_stage = (0.0, self.policy.fine_cost_tolerance if cost_tolerance is None else cost_tolerance)
        stages = (exact_stage,) if is_near else (*self.policy.coarse_stages, exact_stage)
        free = free_parameters(robot, chosen)
        if not free:
            return Fit.without_parameters(robot)
        scale = parameter_scales(robot, free)
        lower, upper = (bounds / scale for bounds in parameter_bounds(robot, free))
        likelihood = self._compiled_likelihood(robot, free, data)
        scaled_start = scaled = np.array([value_of(robot, f) for f in free]) / scale
        for noise_density, stage_tolerance in stages:
            residual = _Residual(likelihood, data, scale, noise_density, self.poll_interrupts)
            if noise_density == 0.0 and not is_near:
                scaled = max((scaled, scaled_start), key=residual.log_likelihood)
            # The first trust region is as large as the start: counted from one, a parameter near zero is not stuck.
            residual.origin = scaled - 1.0
            rule = StoppingRule(residual.evaluate, np.ones(len(free)), stage_tolerance)
            if not rule.has_finite_start:
                raise NoFitError(scaled * scale)
            with suppress(NothingToGainError):
                least_squares(
                    rule.residuals,
                    rule.best_point,
                    jac=rule.jacobian,
                    bounds=(lower - residual.origin, upper - residual.origin),
                    x_scale="jac",
                    ftol=stage_tolerance,
                    max_nfev=self.policy.max_evaluations,
                )
            scaled = residual.origin + rule.best_point
        return _scaled_back(robot, free, scaled, rule.best_jacobian)

    def _first_near(
        self, starts: Sequence[Robot], chosen: Collection[Hypothesis], data: DataSet, min_log_likelihood: float
    ) -> tuple[Robot, bool]:
        """The first start that is probable enough, and whether there is one; the last start if not."""
        for start in starts if min_log_likelihood < np.inf else ():
            try:
                log_likelihood = self.log_likelihood(start, chosen, data)
            except UnreachableError:
                continue
            if log_likelihood >= min_log_likelihood:
                return start, True
        return starts[-1], False

    def innovations(self, robot: Robot, data: DataSet) -> Innovations:
        """Innovations of all samples of a recording under a robot as it is."""
        return self._compiled_likelihood(robot, (), data).innovations(data.recording, ())

    def judged(self, robot: Robot, chosen: Collection[Hypothesis], data: DataSet) -> Innovations:
        """As :meth:`innovations`, with the likelihood that was compiled for fitting the chosen hypotheses."""
        likelihood, values = self.likelihood(robot, chosen, data)
        return likelihood.innovations(data.recording, values)

    def log_likelihood(self, robot: Robot, chosen: Collection[Hypothesis], data: DataSet) -> float:
        """Log-likelihood of the rows of some data, by :meth:`judged`."""
        return self.judged(robot, chosen, data).log_likelihood(data.rows)

    def likelihood(self, robot: Robot, chosen: Collection[Hypothesis], data: DataSet) -> tuple[Likelihood, list[float]]:
        """The likelihood compiled for fitting the chosen hypotheses, and the robot's values of their parameters."""
        free = free_parameters(robot, chosen)
        values = [value_of(robot, f) for f in free]
        return self._compiled_likelihood(robot, free, data), values

    def open_loop_variances(self, robot: Robot, data: DataSet) -> Array:
        """See :meth:`tautwire.estimation.likelihood.Likelihood.open_loop_variances`."""
        return self._compiled_likelihood(robot, (), data).open_loop_variances(data.recording, ())

    def _compiled_likelihood(self, robot: Robot, free: Sequence[FreeParameter], data: DataSet) -> Likelihood:
        self.poll_interrupts()
        interval = float(np.median(np.diff(data.recording.time)))
        robot = data.placed(robot)
        structure = with_values(robot, free, dict.fromkeys(free, 0.0))
        key = (structure, tuple(free), round(interval, 9))
        if key not in self._compiled:
            likelihood = Likelihood(robot, free, self.noise, interval, self.poll_interrupts)
            self._make_room(likelihood.instruction_count)
            self._compiled[key] = likelihood
        compiled, disturbance = self._compiled[key], self.noise.disturbance
        return compiled.with_disturbance(disturbance) if disturbance else compiled

    def _make_room(self, instruction_count: int) -> None:
        """Forget the oldest likelihoods until one of that size may be kept beside the others."""
        kept = instruction_count + sum(likelihood.instruction_count for likelihood in self._compiled.values())
        while self._compiled and (len(self._compiled) >= MAX_COMPILED_LIKELIHOODS or kept > MAX_KEPT_INSTRUCTIONS):
            kept -= self._compiled.pop(next(iter(self._compiled))).instruction_count


def _scaled_back(robot: Robot, free: tuple[FreeParameter, ...], scaled: Array, jacobian: Array) -> Fit:
    """The fit of parameters that were fitted in units of their scales."""
    scale = parameter_scales(robot, free)
    # What is scaled back may end beyond a bound by its last digit.
    values = np.clip(scaled * scale, *parameter_bounds(robot, free))
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * np.outer(scale, scale)
    fitted = with_values(robot, free, dict(zip(free, values.tolist(), strict=True)))
    return Fit(fitted, free, values, covariance)


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
    """Compressed innovations and their Jacobian in scaled parameters, counted from an origin."""

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

    def log_likelihood(self, scaled: Array) -> float:
        innovations = self.likelihood.innovations(
            self.sample.recording, scaled * self.scale, self.acceleration_noise_density
        )
        value = innovations.log_likelihood(self.sample.rows)
        return value if np.isfinite(value) else -np.inf

    def evaluate(self, offset: Array) -> tuple[Array, Array]:
        """Residuals and their slopes at an offset from the origin."""
        self.poll_interrupts()
        residuals, sensitivities = compressed_residuals(
            self.likelihood, (self.origin + offset) * self.scale, self.sample, self.acceleration_noise_density
        )
        return residuals, sensitivities * self.scale


def _fitter_in_worker(noise: Noise, policy: FitPolicy) -> Fitter:
    """The fitter of this worker process, under the disturbance of the one that was sent."""
    if noise.disturbance is None:
        return _fitter_of_process(noise, policy)
    # Whatever the disturbance, the compiled likelihoods are the same.
    return _fitter_of_process(replace(noise, disturbance=NEUTRAL), policy).with_disturbance(noise.disturbance)


@lru_cache(maxsize=1)
def _fitter_of_process(noise: Noise, policy: FitPolicy) -> Fitter:
    """The fitter of this worker process."""
    return Fitter(noise, policy=policy)
