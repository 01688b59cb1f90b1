"""How probable a recording is under a robot with its effects: an extended Kalman filter's innovations.

The filter predicts each sample from all before it, so noise of the winch speeds, which integrates into a drift of
the unstrained lengths, is accounted for instead of piling up as in plain simulation. With innovations ``e_k`` of
variance ``s_k``

    log p(recording) = -1/2 sum_k (e_k^2 / s_k + log s_k + log 2 pi)

Source: Ljung (1999), System Identification, sec. 7.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, log, pi

import casadi
import numpy as np
from numpy.typing import NDArray

from ..recording import Recording
from ..robot import Robot
from ..symbolic import FreeParameter, symbolic_model
from .filter_step import Noise, filter_sample

Array = NDArray[np.float64]

STEP_TIMES_FREQUENCY = 0.15
CHUNK = 500


@dataclass(frozen=True)
class Innovations:
    """Whitened innovations of N samples of m outputs, NaN where nothing was measured.

    ``values`` (N, m) have unit variance where the model is right; ``slopes`` (N, m, p) are their derivatives by the
    free parameters; ``log_variances`` (N, m) the log of the variances that they were divided by.
    """

    values: Array
    slopes: Array
    log_variances: Array

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """Where something was measured, shape (N, m)."""
        return np.isfinite(self.values)

    @cached_property
    def log_likelihood(self) -> float:
        """Natural logarithm of the recording's probability density, in SI units."""
        squares = self.values[self.seen] ** 2 + self.log_variances[self.seen] + log(2.0 * pi)
        return float(-0.5 * np.sum(squares))

    @property
    def mean_square(self) -> Array:
        """Mean square of each output's innovations, shape (m,); one where the model is right."""
        count = np.maximum(np.sum(self.seen, axis=0), 1)
        square: Array = np.nansum(self.values**2, axis=0) / count
        return square


class Likelihood:
    """Innovations of recordings under a robot whose free parameters vary; compiled once."""

    def __init__(self, robot: Robot, free: Sequence[FreeParameter], noise: Noise, sample_time: float) -> None:
        model = symbolic_model(robot, free)
        self.noise = noise
        self.cable_count = robot.cable_count
        self.state_count = model.states.numel()
        self._start = casadi.Function(
            "start", [model.parameters], [model.start, casadi.jacobian(model.start, model.parameters)]
        )
        substeps = max(1, ceil(fastest_mode(robot) * sample_time / STEP_TIMES_FREQUENCY))
        self._sample = filter_sample(model, robot.cable_count, noise, substeps)
        self._runs = {CHUNK: self._sample.mapaccum("run", CHUNK, 3)}

    def innovations(self, recording: Recording, parameters: Sequence[float], roughness: float = 0.0) -> Innovations:
        """Filter a recording at some values of the free parameters.

        ``roughness`` (m/s^2 per root hertz) adds an unknown white acceleration of the platform: a fit that starts
        far from the solution then follows the data instead of losing phase.
        """
        theta = np.asarray(parameters, dtype=float)
        measured = recording.measured()
        seen = np.isfinite(measured)
        speed = recording.winch_speed
        columns = (
            np.where(seen, measured, 0.0).T,
            seen.astype(float).T,
            speed.T,
            np.vstack([speed[1:], speed[-1:]]).T,
            np.append(np.diff(recording.time), 0.0)[None, :],
        )
        state, slopes = self._start(theta)
        carried = (state, self._start_covariance(), slopes)
        values, logs, gradients = [], [], []
        for first in range(0, len(measured), CHUNK):
            part = [column[:, first : first + CHUNK] for column in columns]
            count = part[0].shape[1]
            width = self.state_count
            result = self._run(count)(
                *carried, np.repeat(theta[:, None], count, axis=1), *part, np.full((1, count), roughness)
            )
            carried = (result[0][:, -1], result[1][:, -width:], result[2][:, result[2].shape[1] - len(theta) :])
            values.append(np.array(result[3]).T)
            logs.append(np.array(result[4]).T)
            gradients.append(np.array(result[5]).reshape(measured.shape[1], count, len(theta)).swapaxes(0, 1))
        whitened, variances = np.vstack(values), np.vstack(logs)
        whitened[~seen] = np.nan
        variances[~seen] = np.nan
        return Innovations(whitened, np.vstack(gradients), variances)

    def _run(self, count: int) -> casadi.Function:
        if count not in self._runs:
            self._runs[count] = self._sample.mapaccum("run", count, 3)
        return self._runs[count]

    def _start_covariance(self) -> Array:
        variance = np.zeros(self.state_count)
        variance[:3] = self.noise.start**2
        variance[6 : 6 + self.cable_count] = self.noise.start**2
        covariance: Array = np.diag(variance)
        return covariance


def fastest_mode(robot: Robot) -> float:
    """Largest magnitude of an eigenvalue at the start, in rad/s."""
    model = symbolic_model(robot)
    slope = casadi.Function("a", [model.states, model.inputs], [casadi.jacobian(model.rates, model.states)])
    start = casadi.Function("start", [], [model.start])
    matrix = np.array(slope(start()["o0"], 0.0))
    return float(np.max(np.abs(np.linalg.eigvals(matrix))))
