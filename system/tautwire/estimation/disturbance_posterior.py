"""Posterior density of a disturbance, and of a model's free parameters with it, and its ascent by Fisher scoring.

Coordinates x are the logs of the disturbance's numbers and, where parameters are free, their distances from some values
in some units. With whitened innovations v and the logs l of their variances,

    dL/dx = -sum (v v' + l' / 2)
    E[-d2L/dx2] = sum (v' + v l' / 2)(v' + v l' / 2)^T + l' l'^T / 2

Derivatives by parameters are those of the filter with its gain held, which lose little: where a rope goes slack gains
jump, and differences over a small step with them.

Source: Gupta and Mehra (1974), IEEE Transactions on Automatic Control 19(6), 774-783.
"""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import log

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .disturbance import Disturbance, OrnsteinUhlenbeck
from .disturbance_sensitivities import disturbance_sensitivities
from .estimation_data import DataSet
from .innovations import FilterSegment
from .kalman_filter import Noise
from .likelihood import Likelihood
from .policy import DEFAULT_POLICY
from .preprocessing_policy import DisturbancePolicy

Array = NDArray[np.float64]

CONCURRENT_EVALUATIONS = 2
# Numbers in the covariances of a filter's run up to which an evaluation keeps it: 64 MB with the transitions.
MAX_KEPT_COVARIANCES = 4_000_000


@dataclass(frozen=True)
class DisturbancePrior:
    """Weak prior of a disturbance: its median, and standard deviations of the logs of its numbers (k,)."""

    median: Disturbance
    log_deviations: tuple[float, ...]

    def penalty(self, logs: Array) -> Array:
        """Deviations from the median in standard deviations (k,)."""
        deviations: Array = (logs - logs_of(self.median)) / np.array(self.log_deviations)
        return deviations

    @property
    def number_count(self) -> int:
        """Number k of a disturbance's numbers: 8, or 11 where the platform turns."""
        return len(self.log_deviations)

    @property
    def sizes(self) -> list[int]:
        """Indices of the processes' sizes among the numbers, each before its bandwidth."""
        sensor_kinds = (self.number_count - 2) // 3
        return list(range(0, 2 + 2 * sensor_kinds, 2))

    def disturbance_of(self, logs: Array) -> Disturbance:
        """The disturbance whose numbers have these logs (k,)."""
        numbers = np.exp(logs).tolist()
        first_noise = 2 * len(self.sizes)
        force, position, tension, *rotation = (OrnsteinUhlenbeck(*numbers[k : k + 2]) for k in self.sizes)
        white = numbers[first_noise:]
        disturbance = Disturbance(force, position, tension, white[0], white[1], moment_arm=self.median.moment_arm)
        return replace(disturbance, rotation=rotation[0], rotation_noise=white[2]) if rotation else disturbance


def logs_of(disturbance: Disturbance) -> Array:
    """Logs of a disturbance's numbers (k,): size and bandwidth of each process, then white noise."""
    processes = [disturbance.force, disturbance.position, disturbance.tension]
    white = [disturbance.position_noise, disturbance.tension_noise]
    if disturbance.rotation is not None:
        processes.append(disturbance.rotation)
        white.append(disturbance.rotation_noise)
    return np.log([*(number for each in processes for number in (each.rms, each.bandwidth)), *white])


def disturbance_prior(
    robot: Robot, noise: Noise, policy: DisturbancePolicy = DEFAULT_POLICY.fit.disturbance
) -> DisturbancePrior:
    """Prior of a robot with these sensors: a force in proportion to its weight, and half of the noise coloured."""
    share, weight = policy.coloured_noise_share, reference_weight(robot)
    white = (1.0 - share**2) ** 0.5
    median = Disturbance(
        OrnsteinUhlenbeck(policy.force_to_weight * weight, policy.bandwidth),
        OrnsteinUhlenbeck(share * noise.position, policy.bandwidth),
        OrnsteinUhlenbeck(share * noise.tension, policy.bandwidth),
        white * noise.position,
        white * noise.tension,
    )
    if noise.rotation is not None:
        rotation = OrnsteinUhlenbeck(share * noise.rotation, policy.bandwidth)
        median = replace(median, rotation=rotation, rotation_noise=white * noise.rotation, moment_arm=noise.moment_arm)
    size, bandwidth, sensor = (log(f) for f in (policy.size_factor, policy.bandwidth_factor, policy.noise_factor))
    kinds = 2 if noise.rotation is None else 3
    return DisturbancePrior(median, (*[size, bandwidth] * (1 + kinds), *[sensor] * kinds))


def reference_weight(robot: Robot) -> float:
    """Weight (N) to which random forces compare: the platform's, under 1 m/s^2 where it does not hang."""
    return robot.platform.mass * max(robot.gravity, 1.0)


@dataclass(frozen=True)
class ParameterBox:
    """Free parameters beside a disturbance: ``units`` (p,) in which they move, and bounds ``lower`` and ``upper``."""

    units: Array = field(default_factory=lambda: np.zeros(0))
    lower: Array = field(default_factory=lambda: np.zeros(0))
    upper: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Evaluation:
    """Posterior log-density at some coordinates, with what it is made of: whitened innovations, logs of variances.

    These count N of the outputs (samples, m), where ``is_counted``. ``slopes_by_parameters`` (p, N) are those of the
    innovations by the units of free parameters; ``constants`` (c) the uncertain parameters there, in standard
    deviations. ``segments`` of the filter's run, if it is to be scored, are there unless they take much memory.
    """

    coordinates: Array
    value: float
    innovations: Array
    log_variances: Array
    slopes_by_parameters: Array
    constants: Array
    is_counted: NDArray[np.bool_]
    segments: tuple[FilterSegment, ...]

    @property
    def logs(self) -> Array:
        """Logs of the disturbance's numbers (k,)."""
        return self.coordinates[: len(self.coordinates) - len(self.slopes_by_parameters)]


@dataclass(frozen=True)
class Posterior:
    """Posterior density of a disturbance under some data.

    The parameters are held at their ``values`` (p,), or move from there where they have a ``box``.
    """

    likelihood: Likelihood
    values: Array
    data: DataSet
    prior: DisturbancePrior
    box: ParameterBox = field(default_factory=ParameterBox)

    def given_constants(self, constants: Array) -> Posterior:
        """The posterior density given the uncertain parameters."""
        return replace(self, likelihood=self.likelihood.given_constants(constants))

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the coordinates.

        What hardly changes while a recording lasts is no disturbance, but an offset or a weight.
        """
        lower, upper = (np.full(self.prior.number_count, bound) for bound in (-np.inf, np.inf))
        time = self.data.recording.time
        lower[[size + 1 for size in self.prior.sizes]] = -log(float(time[-1] - time[0]))
        values = self.values[: len(self.box.units)]
        of_parameters = ((bound - values) / self.box.units for bound in (self.box.lower, self.box.upper))
        low, high = (np.append(bound, own) for bound, own in zip((lower, upper), of_parameters, strict=True))
        return low, high

    @cached_property
    def _keeps_segments(self) -> bool:
        _, covariance = self.likelihood.start(self.values)
        return self.data.recording.sample_count * covariance.size <= MAX_KEPT_COVARIANCES

    def values_at(self, coordinates: Array) -> Array:
        """The parameters (p,) at some coordinates."""
        if not len(self.box.units):
            return self.values
        moved = self.values + self.box.units * coordinates[self.prior.number_count :]
        return np.clip(moved, self.box.lower, self.box.upper)

    def evaluation(self, coordinates: Array, is_scored: bool = False) -> Evaluation:
        """Its evaluation at some coordinates, or at the bounds that these exceed; its score may be asked for next."""
        coordinates = np.clip(coordinates, *self.bounds)
        logs = coordinates[: self.prior.number_count]
        likelihood = self.likelihood.with_disturbance(self.prior.disturbance_of(logs))
        innovations = likelihood.innovations(
            self.data.recording, self.values_at(coordinates), keeps_segments=is_scored and self._keeps_segments
        )
        mask = innovations.observed & self.data.rows[:, None]
        value = innovations.log_likelihood(self.data.rows) - 0.5 * float(np.sum(self.prior.penalty(logs) ** 2))
        value = value if np.isfinite(value) else -np.inf
        values, log_variances = innovations.values[mask], innovations.log_variances[mask]
        slopes = innovations.sensitivities[mask].T[: len(self.box.units)] * self.box.units[:, None]
        constants, segments = innovations.constants, innovations.segments
        return Evaluation(coordinates, value, values, log_variances, slopes, constants, mask, segments)

    def evaluations(self, points: Iterable[Array]) -> list[Evaluation]:
        """Evaluations at several coordinates, two at once: a compiled filter runs without Python's lock."""
        with ThreadPoolExecutor(CONCURRENT_EVALUATIONS) as threads:
            return list(threads.map(self.evaluation, points))

    def score(self, evaluation: Evaluation) -> tuple[Array, Array]:
        """Gradient and Fisher information by the coordinates."""
        disturbance, values = self.prior.disturbance_of(evaluation.logs), self.values_at(evaluation.coordinates)
        recording, segments = self.data.recording, evaluation.segments
        by_logs = disturbance_sensitivities(self.likelihood, disturbance, recording, values, segments)
        slopes, log_slopes = (derivatives[evaluation.is_counted].T for derivatives in by_logs)
        slopes = np.vstack([slopes, evaluation.slopes_by_parameters])
        log_slopes = np.vstack([log_slopes, np.zeros_like(evaluation.slopes_by_parameters)])
        gradient = -slopes @ evaluation.innovations - 0.5 * np.sum(log_slopes, axis=1)
        unscaled = slopes + 0.5 * evaluation.innovations * log_slopes
        information = unscaled @ unscaled.T + 0.5 * log_slopes @ log_slopes.T
        deviations, numbers = np.array(self.prior.log_deviations), np.arange(self.prior.number_count)
        information[numbers, numbers] += deviations**-2
        gradient[numbers] -= self.prior.penalty(evaluation.logs) / deviations
        return gradient, information


def ascended(posterior: Posterior, start: Evaluation, policy: DisturbancePolicy, max_iterations: int) -> Evaluation:
    """The end of an ascent; Levenberg's damping lets no step descend."""
    current, damping = start, policy.first_damping
    lower, upper = posterior.bounds
    for _ in range(max_iterations):
        gradient, information = posterior.score(current)
        # At its bound and pushed beyond it, or without effect: such a coordinate stays, the others move without it.
        is_held = ((current.coordinates <= lower) & (gradient < 0.0)) | (
            (current.coordinates >= upper) & (gradient > 0.0)
        )
        is_held |= np.diag(information) <= 0.0
        gradient, information = np.where(is_held, 0.0, gradient), np.where(is_held[:, None] | is_held, 0.0, information)
        information[is_held, is_held] = 1.0
        while damping < policy.max_damping:
            scaled = information + damping * np.diag(np.diag(information))
            step = np.clip(np.linalg.solve(scaled, gradient), -policy.max_log_step, policy.max_log_step)
            trial = posterior.evaluation(current.coordinates + step, is_scored=True)
            if trial.value > current.value:
                break
            damping *= 10.0
        else:
            break
        gain, current, damping = trial.value - current.value, trial, 0.1 * damping
        if gain < policy.min_gain:
            break
    return current
