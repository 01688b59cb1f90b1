"""How probable a recording is under a robot with its effects: an extended Kalman filter's innovations.

The filter predicts each sample from all before it, so noise of the winch speeds, which integrates into a drift of
the unstrained lengths, is accounted for instead of piling up as in plain simulation. With innovations ``e_k`` of
variance ``s_k``

    log p(recording) = -1/2 sum_k (e_k^2 / s_k + log s_k + log 2 pi)

Source: Ljung (1999), System Identification, sec. 7.4.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import log, pi

import casadi
import numpy as np
from numpy.typing import NDArray

from ..model.symbolic import FreeParameter, symbolic_model
from ..model.uncertain import uncertain_numbers
from ..native.repeated import Repeated, stacked
from ..recordings.recording import Recording
from ..robots.robot import Robot
from .filter_step import Noise, filter_sample, filter_slopes
from .preparation.start_state import start_covariance
from .substeps import substeps_between

Array = NDArray[np.float64]

CHUNK = 500
# In medians of the sample interval.
LONGEST_STEP = 1.5


@dataclass(frozen=True)
class Innovations:
    """Whitened innovations of N samples of m outputs, NaN where nothing was ``seen`` (N, m).

    ``values`` (N, m) have unit variance where the model is right; ``slopes`` (N, m, p) are their derivatives by the
    free parameters; ``log_variances`` (N, m) the log of the variances that they were divided by.
    """

    seen: NDArray[np.bool_]
    values: Array
    slopes: Array
    log_variances: Array

    def log_likelihood(self, rows: NDArray[np.bool_]) -> float:
        """Log of the probability density, in SI units, of the samples in ``rows`` given those before them."""
        chosen = self.seen & rows[:, None]
        squares = self.values[chosen] ** 2 + self.log_variances[chosen] + log(2.0 * pi)
        return float(-0.5 * np.sum(squares))

    def mean_square(self, rows: NDArray[np.bool_]) -> Array:
        """Mean square of each output's innovations, shape (m,); one where the model is right, NaN if unseen."""
        count = np.sum(self.seen[rows], axis=0)
        total = np.nansum(self.values[rows] ** 2, axis=0)
        return np.divide(total, count, out=np.full(len(total), np.nan), where=count > 0)


@dataclass(frozen=True)
class Stretch:
    """K successive samples as the filter took them.

    ``columns`` are measured, seen and shift (m, K), speed and next speed (cables, K), time step and drift (1, K);
    ``own`` tells which samples are the recording's, the others fill gaps. ``states`` (n, K + 1) and ``covariances``
    (K, n, n) are those predicted; ``values``, ``log_variances`` (K, m) and ``slopes`` (K, m, p) as in Innovations.
    """

    columns: tuple[Array, ...]
    own: NDArray[np.bool_]
    states: Array
    covariances: Array
    values: Array
    log_variances: Array
    slopes: Array


class Likelihood:
    """Innovations of recordings under a robot whose free parameters vary; compiled once."""

    def __init__(self, robot: Robot, free: Sequence[FreeParameter], noise: Noise, sample_time: float) -> None:
        self.uncertain = uncertain_numbers(robot)
        self.model = symbolic_model(robot, free, self.uncertain)
        self.robot = robot
        self.noise = noise
        self.cable_count = robot.cable_count
        self._start = casadi.Function(
            "start",
            [self.model.parameters],
            [self.model.start, casadi.jacobian(self.model.start, self.model.parameters)],
        )
        states = self.model.states.numel()
        remembers = states > 6 + robot.cable_count + len(self.uncertain)
        self.substeps = substeps_between(robot, sample_time, states, remembers)
        self._lags = casadi.Function("lags", [self.model.parameters], [self.model.lags])
        self._run = Repeated(filter_sample(self.model, robot.cable_count, noise, self.substeps), carried=3)

    def innovations(
        self, recording: Recording, parameters: Sequence[float] | Array, roughness: float = 0.0
    ) -> Innovations:
        """Filter a recording at some values of the free parameters.

        ``roughness`` (m/s^2 per root hertz) adds an unknown white acceleration of the platform: a fit that starts
        far from the solution then follows the data instead of losing phase.
        """
        measured, shift = self._as_of(recording, parameters)
        seen = np.isfinite(measured)
        stretches = self._filter(recording, measured, shift, parameters, self._start_covariance(), roughness)
        values, variances, slopes = _gathered(stretches)
        given = np.isfinite(recording.measured())
        values[~given] = np.nan
        variances[~given] = np.nan
        _fill(values, variances, slopes, given & ~seen)
        return Innovations(given, values, slopes, variances)

    @cached_property
    def slopes(self) -> Repeated:
        """See :func:`tautwire.tracer.filter_step.filter_slopes`; compiled when first asked for."""
        return Repeated(filter_slopes(self.model, self.cable_count, self.substeps))

    def start(self, parameters: Sequence[float] | Array) -> tuple[Array, Array]:
        """State (n,) and covariance (n, n) with which the filter begins."""
        state, _ = self._start(np.asarray(parameters, dtype=float))
        return np.array(state).ravel(), self._start_covariance()

    def stretches(
        self, recording: Recording, parameters: Sequence[float] | Array, roughness: float = 0.0
    ) -> Iterator[Stretch]:
        """The filter's run over a recording, part by part: memory does not grow with its length.

        For ``roughness`` see :meth:`innovations`.
        """
        measured, shift = self._as_of(recording, parameters)
        yield from self._filter(recording, measured, shift, parameters, self._start_covariance(), roughness)

    def simulated(self, recording: Recording, parameters: Sequence[float] | Array) -> Array:
        """What sensors without noise or lag would show of a run over a recording's winch speeds, shape (N, m)."""
        nothing = np.full(recording.measured().shape, np.nan)
        shown = casadi.vertcat(self.model.outputs[:3], self.model.outputs[6 : 6 + self.cable_count])
        function = casadi.Function("shown", [self.model.states, self.model.inputs, self.model.parameters], [shown])
        still = np.zeros(self.model.inputs.numel() - self.cable_count)
        parts = []
        for stretch in self._filter(
            recording, nothing, np.zeros_like(nothing), parameters, self._start_covariance(), 0.0
        ):
            states, speeds = stretch.states[:, :-1][:, stretch.own], stretch.columns[3][:, stretch.own]
            count = states.shape[1]
            inputs = np.vstack([speeds, np.repeat(still[:, None], count, axis=1)])
            theta = np.repeat(np.asarray(parameters, dtype=float)[:, None], count, axis=1)
            parts.append(np.array(function.map(count)(states, inputs, theta)).T)
        return np.vstack(parts)

    def _as_of(self, recording: Recording, parameters: Sequence[float] | Array) -> tuple[Array, Array]:
        lags = np.array(self._lags(np.asarray(parameters, dtype=float))).ravel()
        return as_of(recording.time, recording.measured(), lags)

    def open_loop_variances(self, recording: Recording, parameters: Sequence[float] | Array) -> Array:
        """Variance of measured less simulated, shape (N, m), where the model is right and its start exact.

        Noise of the sensors, and of the recorded winch speeds as it integrates.
        """
        nothing = np.full(recording.measured().shape, np.nan)
        size = self.model.states.numel()
        exact = np.zeros((size, size))
        stretches = self._filter(recording, nothing, np.zeros_like(nothing), parameters, exact, 0.0)
        _, log_variances, _ = _gathered(stretches)
        variances: Array = np.exp(log_variances)
        return variances

    def _filter(
        self,
        recording: Recording,
        measured: Array,
        shift: Array,
        parameters: Sequence[float] | Array,
        start_covariance: Array,
        roughness: float,
    ) -> Iterator[Stretch]:
        theta = np.asarray(parameters, dtype=float)
        columns, own = _columns(recording, measured, shift)
        state, slopes = self._start(theta)
        carried = (np.array(state), start_covariance, np.array(slopes))
        size, free = len(start_covariance), len(theta)
        for first in range(0, len(own), CHUNK):
            part = tuple(column[:, first : first + CHUNK] for column in columns)
            count = part[0].shape[1]
            found = self._run(count, *carried, theta[:, None], *part, np.full((1, 1), roughness))
            states, covariances, state_slopes, values, log_variances, moved = found
            yield Stretch(
                part,
                own[first : first + CHUNK],
                states,
                stacked(covariances, count + 1)[:-1],
                values.T,
                log_variances.T,
                stacked(moved, count),
            )
            carried = (states[:, -1:], covariances[:, size * count :], state_slopes[:, free * count :])

    def _start_covariance(self) -> Array:
        return start_covariance(self.robot, self.noise, self.model.states.numel(), len(self.uncertain))


def _gathered(stretches: Iterable[Stretch]) -> tuple[Array, Array, Array]:
    """Values, log variances and slopes of the recording's own samples."""
    parts = [(s.values[s.own], s.log_variances[s.own], s.slopes[s.own]) for s in stretches]
    values, variances, slopes = (np.concatenate(part) for part in zip(*parts, strict=True))
    return values, variances, slopes


def _fill(values: Array, variances: Array, slopes: Array, alone: NDArray[np.bool_]) -> None:
    """Samples that a lag leaves without a state count as noise: dropping them must neither pay nor cost."""
    for column in np.flatnonzero(alone.any(axis=0)):
        places = np.flatnonzero(alone[:, column])
        values[places, column] = np.where(places % 2, 1.0, -1.0)
        variances[places, column] = np.median(np.delete(variances[:, column], places))
        slopes[places, column] = 0.0


def as_of(time: Array, measured: Array, lags: Array) -> tuple[Array, Array]:
    """What sensors that lag show of the state at each time: the sample nearest to the time plus the lag.

    Returns the values, NaN where there is none, and by how many seconds later than the state they were shown.
    """
    values, shift = measured.copy(), np.zeros_like(measured)
    half = 0.5 * float(np.median(np.diff(time)))
    for column in np.flatnonzero(lags > half):
        wanted = time + lags[column]
        after = np.clip(np.searchsorted(time, wanted), 1, len(time) - 1)
        nearest = np.where(wanted - time[after - 1] < time[after] - wanted, after - 1, after)
        there = np.abs(time[nearest] - wanted) <= 2.0 * half
        values[:, column] = np.where(there, measured[nearest, column], np.nan)
        shift[:, column] = np.where(there, time[nearest] - time, 0.0)
    return values, shift


def _columns(recording: Recording, measured: Array, shift: Array) -> tuple[tuple[Array, ...], NDArray[np.bool_]]:
    """What the filter takes, a column a sample, and whether each is one of the recording's own samples.

    A gap in time is filled with samples of which nothing was seen, so that no step is longer than usual.
    """
    steps = np.diff(recording.time)
    pieces = np.maximum(np.ceil(steps / (LONGEST_STEP * np.median(steps))), 1).astype(int)
    rows = np.append(0, np.cumsum(pieces))
    time = np.interp(np.arange(rows[-1] + 1), rows, recording.time)
    speed = np.array([np.interp(time, recording.time, column) for column in recording.winch_speed.T])
    shown = np.zeros((measured.shape[1], len(time)))
    looked, later = np.zeros_like(shown), np.zeros_like(shown)
    seen = np.isfinite(measured)
    shown[:, rows] = np.where(seen, measured, 0.0).T
    looked[:, rows] = seen.T
    later[:, rows] = shift.T
    step = np.append(np.diff(time), 0.0)
    drift = step * np.append(np.repeat(steps, pieces), 0.0)
    speeds = (speed, np.hstack([speed[:, 1:], speed[:, -1:]]))
    own = np.zeros(len(time), dtype=bool)
    own[rows] = True
    return (shown, looked, later, *speeds, step[None, :], drift[None, :]), own
