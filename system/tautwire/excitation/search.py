"""Finds a winch program after which effects can be told apart: the largest smallest separation, within limits.

How far two effects are apart is what linearising the tracer's filter along the program gives: an effect ``i`` of the
size at which fits begin, with signature ``a_i``, stands ``|a_i|^2 (1 - cos^2) / 2`` nats from the best that effect
``j`` can do in its place.

Source: optimal input design, Goodwin and Payne (1977), Dynamic System Identification, ch. 6; differential evolution,
Storn and Price (1997), J. Global Optimization 11, 341-359.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import log10

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import Bounds, differential_evolution

from ..errors import TautwireError
from ..recordings.recording import Recording
from ..robots.robot import Robot
from ..tracer.data import Sample
from ..tracer.filter_step import Noise
from ..tracer.fit import Fitter
from ..tracer.hypotheses import Hypothesis
from ..tracer.likelihood import Likelihood
from ..tracer.preparation.noise import noise_of
from ..tracer.screen import signatures_of
from ..tracer.separation import apart, start_moves
from ..trajectory import ideal_winch_speeds
from .program import MultisinePath

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

# Sines of each axis: slow ones that cover the room, and one near the lowest modes.
SLOW, FAST = 2, 1
SHRINK, SHRINKINGS = 0.7, 12
HOPELESS, LEAST = -99.0, 1e-12


class ExcitationError(TautwireError):
    """No program within the limits was found; carries how many were tried."""

    def __init__(self, tried: int) -> None:
        self.tried = tried
        super().__init__(
            f"none of {tried} programs keeps the winch speeds and tensions within their limits: "
            "give more --speed or less --reach, or wider [tension] limits in the robot file"
        )


@dataclass(frozen=True)
class Limits:
    """Winch speed in m/s, distance from the start along each axis in m, and tensions in N."""

    speed: float
    reach: float
    least_tension: float
    largest_tension: float


@dataclass(frozen=True)
class Pair:
    """How far an effect is from the best that another can do in its place, in nats."""

    effect: Hypothesis
    other: Hypothesis
    nats: float


@dataclass(frozen=True)
class Excitation:
    """A program: ``time`` (N,) in s, ``winch_speed`` (N, n) in m/s, and how it separates, the closest pair first.

    ``typical`` is the smallest separation in nats of the median program that was tried.
    """

    path: MultisinePath
    time: Array
    winch_speed: Array
    pairs: tuple[Pair, ...]
    typical: float

    def frame(self) -> pd.DataFrame:
        """A table in the form of a recording: time and winch_speed_i."""
        names = [f"winch_speed_{i + 1}" for i in range(self.winch_speed.shape[1])]
        return pd.DataFrame(np.column_stack([self.time, self.winch_speed]), columns=["time", *names])


def excite(
    robot: Robot,
    effects: Sequence[Hypothesis],
    limits: Limits,
    duration: float,
    interval: float,
    programs: int,
    seed: int,
    progress: Progress,
) -> Excitation:
    """The program of those tried that tells the effects apart best; the same for the same seed.

    ``duration`` and sample ``interval`` in s. About so many ``programs`` are tried, by differential evolution.

    Raises ExcitationError where none is within the limits.
    """
    declared = robot.sensors
    noise = Noise(declared.position_noise or 0.0, declared.tension_noise or 0.0, declared.winch_speed_noise or 0.0, 0.0)
    likelihood = Likelihood(robot, (), noise, interval)
    design = _Design(robot, tuple(effects), limits, duration, interval, likelihood)
    count = 6 * (SLOW + FAST)
    bounds = Bounds(np.zeros(count), np.ones(count))
    generations = max(1, programs // count - 1)
    scores: list[float] = []

    def cost(numbers: Array) -> float:
        progress("trying programs", min(len(scores) / ((generations + 1) * count), 1.0))
        scores.append(design.score(numbers))
        return -scores[-1]

    best = differential_evolution(
        cost, bounds, init="sobol", popsize=1, maxiter=generations, polish=False, seed=seed, tol=0.0
    )
    if max(scores) <= HOPELESS:
        raise ExcitationError(len(scores))
    path = design.path(best.x)
    time, speed = design.program(path)
    typical = 10.0 ** float(np.median([score for score in scores if score > HOPELESS]))
    return Excitation(path, time, speed, tuple(design.pairs(path)), typical)


@dataclass(frozen=True)
class _Design:
    robot: Robot
    effects: tuple[Hypothesis, ...]
    limits: Limits
    duration: float
    interval: float
    likelihood: Likelihood

    def score(self, numbers: Array) -> float:
        """Log10 of the smallest separation in nats."""
        try:
            pairs = self.pairs(self.path(numbers))
        except _NotWithinError:
            return HOPELESS
        return log10(max(pairs[0].nats, LEAST)) if pairs else HOPELESS

    def path(self, numbers: Array) -> MultisinePath:
        """The path that some numbers between 0 and 1 stand for, shrunk until it is within the limits."""
        amplitude, pace = np.asarray(numbers).reshape(2, SLOW + FAST, 3)
        slowest, middle, fastest = 1.0 / self.duration, 6.0 / self.duration, 0.2 / self.interval
        begin = np.array([slowest] * SLOW + [middle] * FAST)[:, None]
        end = np.array([middle] * SLOW + [max(min(fastest, 3.0), middle)] * FAST)[:, None]
        frequencies = begin * (end / begin) ** pace
        # By speed, not by distance: a fast sine is small.
        largest = np.minimum(self.limits.reach / (SLOW + FAST), self.limits.speed / (2.0 * np.pi * frequencies))
        path = MultisinePath(self.robot.platform.start, self.duration, _rows(amplitude * largest), _rows(frequencies))
        for _ in range(SHRINKINGS):
            if self._within(path):
                return path
            path = path.scaled(SHRINK)
        raise _NotWithinError

    def program(self, path: MultisinePath) -> tuple[Array, Array]:
        time = np.asarray(self.interval * np.arange(round(self.duration / self.interval) + 1), dtype=np.float64)
        return time, ideal_winch_speeds(self.robot, path, time)

    def _within(self, path: MultisinePath) -> bool:
        _, speed = self.program(path)
        if np.max(np.abs(speed)) > self.limits.speed:
            return False
        tension = self._run(path).tension
        least, most = float(np.min(tension)), float(np.max(tension))
        return bool(self.limits.least_tension <= least and most <= self.limits.largest_tension)

    def _run(self, path: MultisinePath) -> Recording:
        """What sensors without noise would record."""
        time, speed = self.program(path)
        nothing = np.full(speed.shape, np.nan)
        blind = Recording("program", time, speed, nothing, nothing[:, :3])
        shown = self.likelihood.simulated(blind, ())
        return replace(blind, position=shown[:, :3], tension=shown[:, 3:])

    def pairs(self, path: MultisinePath) -> list[Pair]:
        """Each effect with each other, the closest first."""
        recording = self._run(path)
        fitter = Fitter(noise_of(self.robot, recording))
        sample = Sample(recording, self.robot.platform.start, np.ones(len(recording.time), dtype=bool))
        signatures = signatures_of(self.robot, (), self.effects, fitter, sample)
        moves = {one: start_moves(signatures, self.robot, one) for one in self.effects}
        # What this motion would not show at all (slack, where no rope hangs) is not what tells programs apart.
        shown = [one for one, move in moves.items() if float((move.T @ signatures.gram @ move)[0, 0]) > 0.0]
        found = [
            Pair(one, other, apart(signatures, moves[one], other))
            for one in shown
            for other in shown
            if one.effect is not other.effect
        ]
        return sorted(found, key=lambda pair: pair.nats)


class _NotWithinError(Exception):
    """Even a small motion along this path breaks a limit."""


def _rows(matrix: Array) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in matrix)
