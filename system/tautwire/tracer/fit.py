"""Fits the parameters of a robot's effects to recorded samples."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tautwire_fmu.laws.effects import BY_NAME, Parameter

from ..errors import TautwireError, UnreachableError
from ..model.symbolic import OF_FORMULAS, FreeParameter
from ..robots.robot import Robot
from ..runs.start import placed
from .data import Sample
from .filter_step import Noise
from .hypotheses import Hypothesis, free_parameters, value_of, with_values
from .likelihood import Innovations, Likelihood
from .preparation.compression import compressed

Array = NDArray[np.float64]

# Roughness of the model and relative change of the cost at which to stop, stage by stage; then the exact model's.
ROUGH_STAGES = ((0.1, 1e-3), (0.01, 1e-3))
EXACT = 1e-7
EVALUATIONS = 15
KEPT = 40
NORMAL_95 = 1.959964


class NoFitError(TautwireError):
    """A model has no finite innovations where its fit would begin; carries the values there."""

    def __init__(self, values: Array) -> None:
        self.values = values
        super().__init__(f"no fit can begin at {values.tolist()}: the model has no finite output there")


@dataclass(frozen=True)
class Fit:
    """A robot some of whose effects' parameters are fitted.

    ``values`` of the ``free`` ones have shape (p,); ``covariance`` (p, p) is from the curvature of the likelihood.
    """

    robot: Robot
    free: tuple[FreeParameter, ...]
    values: Array
    covariance: Array

    @property
    def deviations(self) -> Array:
        """Standard deviations (p,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def interval(self, index: int) -> tuple[float, float]:
        """95 % interval of one parameter."""
        reach = NORMAL_95 * float(self.deviations[index])
        return float(self.values[index]) - reach, float(self.values[index]) + reach


class Fitter:
    """Fits and judges robots on samples; compiled likelihoods are kept, and ``between`` is called before each run."""

    def __init__(self, noise: Noise, between: Callable[[], None] = lambda: None) -> None:
        self.noise = noise
        self.between = between
        self._compiled: dict[tuple[object, ...], Likelihood] = {}

    def fit(self, robot: Robot, chosen: Collection[Hypothesis], sample: Sample) -> Fit:
        """Least squares on whitened innovations, first under a rough model, then under the exact one.

        Frees the parameters of the chosen hypotheses. The exact stage begins where the rough one ended or where that
        began, whichever is more probable.
        """
        return self._fit(robot, chosen, sample, (*ROUGH_STAGES, (0.0, EXACT)))

    def fit_from(
        self, starts: Sequence[Robot], chosen: Collection[Hypothesis], sample: Sample, least: float, stop: float = EXACT
    ) -> Fit:
        """Fit from the first start whose log-likelihood reaches ``least``, under the exact model at once.

        Where none does, the last start is fitted as :meth:`fit` does. ``stop`` is the relative change of the cost at
        which the exact stage ends.

        Raises NoFitError, UnreachableError.
        """
        for start in starts:
            try:
                found = self.judged(start, chosen, sample).log_likelihood(sample.rows)
            except UnreachableError:
                continue
            if found >= least:
                return self._fit(start, chosen, sample, ((0.0, stop),))
        return self._fit(starts[-1], chosen, sample, (*ROUGH_STAGES, (0.0, stop)))

    def _fit(
        self, robot: Robot, chosen: Collection[Hypothesis], sample: Sample, stages: Sequence[tuple[float, float]]
    ) -> Fit:
        free = free_parameters(robot, chosen)
        if not free:
            return Fit(robot, (), np.zeros(0), np.zeros((0, 0)))
        start = np.array([value_of(robot, f) for f in free])
        scale = sizes_of(robot, free)
        lower, upper = (bounds / scale for bounds in bounds_of(robot, free))
        likelihood = self._likelihood(placed(robot, sample.start), free, sample)
        begun = scaled = start / scale
        slopes = np.zeros((0, len(free)))
        for rough, stop in stages:
            residual = _Residual(likelihood, sample, scale, rough, self.between)
            if rough == 0.0:
                scaled = max((scaled, begun), key=residual.log_likelihood)
            # The first trust region is as large as the start: counted from one, a parameter near zero is not stuck.
            residual.origin = scaled - 1.0
            if not np.all(np.isfinite(residual.values(np.ones(len(free))))):
                raise NoFitError(scaled * scale)
            solution = least_squares(
                residual.values,
                np.ones(len(free)),
                jac=residual.slopes,
                bounds=(lower - residual.origin, upper - residual.origin),
                x_scale="jac",
                ftol=stop,
                max_nfev=EVALUATIONS,
            )
            scaled, slopes = residual.origin + solution.x, np.asarray(solution.jac, dtype=float)
        # What is scaled back may end beyond a bound by its last digit.
        values = np.clip(scaled * scale, *bounds_of(robot, free))
        covariance = np.linalg.pinv(slopes.T @ slopes) * np.outer(scale, scale)
        fitted = with_values(robot, free, dict(zip(free, values.tolist(), strict=True)))
        return Fit(fitted, free, values, covariance)

    def innovations(self, robot: Robot, sample: Sample) -> Innovations:
        """Innovations of all samples of a recording under a robot as it is."""
        return self._likelihood(placed(robot, sample.start), (), sample).innovations(sample.recording, ())

    def judged(self, robot: Robot, chosen: Collection[Hypothesis], sample: Sample) -> Innovations:
        """As :meth:`innovations`, by what was compiled for fitting the chosen hypotheses."""
        likelihood, values = self.likelihood(robot, chosen, sample)
        return likelihood.innovations(sample.recording, values)

    def likelihood(
        self, robot: Robot, chosen: Collection[Hypothesis], sample: Sample
    ) -> tuple[Likelihood, list[float]]:
        """What was compiled for fitting the chosen hypotheses, and the values that the robot has."""
        free = free_parameters(robot, chosen)
        values = [value_of(robot, f) for f in free]
        return self._likelihood(placed(robot, sample.start), free, sample), values

    def open_loop_variances(self, robot: Robot, sample: Sample) -> Array:
        """See :meth:`tautwire.tracer.likelihood.Likelihood.open_loop_variances`."""
        return self._likelihood(placed(robot, sample.start), (), sample).open_loop_variances(sample.recording, ())

    def _likelihood(self, robot: Robot, free: Sequence[FreeParameter], sample: Sample) -> Likelihood:
        self.between()
        interval = float(np.median(np.diff(sample.recording.time)))
        opened = with_values(robot, free, dict.fromkeys(free, 0.0))
        key = (opened, tuple(free), round(interval, 9))
        if key not in self._compiled:
            if len(self._compiled) >= KEPT:
                self._compiled.pop(next(iter(self._compiled)))
            self._compiled[key] = Likelihood(robot, free, self.noise, interval)
        return self._compiled[key]


def bounds_of(robot: Robot, free: Sequence[FreeParameter]) -> tuple[Array, Array]:
    """Least and largest value of each free parameter, (p,) each."""
    known = _parameters(robot, free)
    return np.array([p.minimum for p in known], dtype=float), np.array([p.maximum for p in known], dtype=float)


def sizes_of(robot: Robot, free: Sequence[FreeParameter]) -> Array:
    """What the free parameters are measured by (p,): their values, or where fits begin if that is more."""
    known = _parameters(robot, free)
    return np.array([max(abs(value_of(robot, f)), abs(p.start)) for f, p in zip(free, known, strict=True)])


def _parameters(robot: Robot, free: Sequence[FreeParameter]) -> list[Parameter]:
    """What the effects say of each free parameter; a number of a formula may be any."""
    return [
        Parameter(f.name, "", "", -np.inf, np.inf, 0.0, value_of(robot, f) or 1.0)
        if f.setting == OF_FORMULAS
        else {p.name: p for p in BY_NAME[robot.effects[f.setting].name].parameters}[f.name]
        for f in free
    ]


class _Residual:
    """Innovations and their slopes, compressed, at the last point asked for, in scaled parameters."""

    def __init__(
        self, likelihood: Likelihood, sample: Sample, scale: Array, roughness: float, between: Callable[[], None]
    ) -> None:
        self.between = between
        self.likelihood = likelihood
        self.sample = sample
        self.scale = scale
        self.roughness = roughness
        self.origin = np.zeros(len(scale))
        self._at: Array | None = None
        self._found: tuple[Array, Array] = (np.zeros(0), np.zeros((0, 0)))

    def log_likelihood(self, scaled: Array) -> float:
        found = self.likelihood.innovations(self.sample.recording, scaled * self.scale, self.roughness)
        value = found.log_likelihood(self.sample.rows)
        return value if np.isfinite(value) else -np.inf

    def values(self, moved: Array) -> Array:
        return self._evaluate(self.origin + moved)[0]

    def slopes(self, moved: Array) -> Array:
        return self._evaluate(self.origin + moved)[1]

    def _evaluate(self, scaled: Array) -> tuple[Array, Array]:
        if self._at is None or not np.array_equal(self._at, scaled):
            self.between()
            residuals, slopes = compressed(self.likelihood, scaled * self.scale, self.sample, self.roughness)
            self._found = (residuals, slopes * self.scale)
            self._at = scaled.copy()
        return self._found
