"""Optimal input design: winch programs that maximise the smallest separation between effects within limits.

The separation follows from linearising the estimator's filter along the program: an effect ``i`` of the size at which
fits start, with signature ``a_i``, is ``|a_i|^2 (1 - cos^2) / 2`` nats from the best that effect ``j`` can do in its
place.

Source: optimal input design, Goodwin and Payne (1977), Dynamic System Identification, ch. 6; evolution strategies,
Beyer and Schwefel (2002), Natural Computing 1, 3-52.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil, isfinite, log2, log10

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats.qmc import Sobol
from threadpoolctl import threadpool_limits

from ..errors import InputError, TautwireError
from ..recordings.recording import Recording
from ..robot.pose_trajectory import OrientationTrajectory, PoseTrajectory
from ..robot.rigid_equilibrium import platform_size
from ..robot.schema import Point, Robot
from ..robot.trajectory import Trajectory
from ..robot.winch_speeds import ideal_winch_speeds
from .effect_sensitivities import EffectSensitivities
from .excitation_limits import ExcitationLimits, can_turn
from .filter_linearisation import linearise_filter
from .hypotheses import Hypothesis, hypotheses
from .identifiability import separation_nats, start_steps
from .likelihood import Likelihood
from .measurement_noise import declared_noise
from .multisine import MultisinePath
from .score_test import effect_sensitivities, statistics_of_runs
from .worker_pool import map_in_forks

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

# Sines of each axis: slow ones that cover the workspace, and one near the lowest modes.
SLOW_SINES, FAST_SINES = 2, 1
SINES = SLOW_SINES + FAST_SINES
# A path that breaks a limit shrinks by such factors, the best one by finer ones, down to a size that shows nothing.
SHRINK_FACTOR, FINE_SHRINK_FACTOR, MIN_SCALE = 0.7, 0.7 ** (1.0 / 12.0), 0.015
SPEED_CHECK_STRIDE = 16
INFEASIBLE_SCORE, MIN_SEPARATION = -99.0, 1e-12
# At least this share of the programs is spread; then come generations, as far from the best one as ``MOVE`` in each
# decision variable but for a share that is drawn anew.
SPREAD_SHARE, GENERATION, MOVE, ANEW_SHARE = 1.0 / 3.0, 8, 0.08, 0.1
# Radians of the fastest vibration in one integration step: six times those of fits move separations by 3e-4 at most.
MAX_STATE_ANGLE = 0.3
# The filter takes as long to compile as so many effects, the first time on a computer.
FILTER_WORK = 40


class ExcitationError(TautwireError):
    """No program within the limits was found; carries the number of trials."""

    def __init__(self, trial_count: int) -> None:
        self.trial_count = trial_count
        super().__init__(
            f"none of {trial_count} programs keeps the winch speeds and tensions within their limits: "
            "give a larger --speed or a smaller --reach, or wider [tension] limits in the robot file"
        )


@dataclass(frozen=True)
class DesignOptions:
    """Options of a design: ``duration`` and sample ``interval`` in s; about how many ``programs`` are tried."""

    limits: ExcitationLimits
    duration: float
    interval: float
    programs: int
    seed: int = 0


@dataclass(frozen=True)
class EffectSeparation:
    """Separation of an effect from the best that another can do in its place, in nats."""

    effect: Hypothesis
    other: Hypothesis
    nats: float


@dataclass(frozen=True)
class Excitation:
    """Excitation program: ``time`` (N,) in s, ``winch_speed`` (N, n) in m/s, and separations, the closest pair first.

    ``median_separation`` is the smallest separation in nats of the median program that was tried.
    """

    path: Trajectory
    time: Array
    winch_speed: Array
    pairs: tuple[EffectSeparation, ...]
    median_separation: float

    def frame(self) -> pd.DataFrame:
        """A table in the form of a recording: time and winch_speed_i."""
        names = [f"winch_speed_{i + 1}" for i in range(self.winch_speed.shape[1])]
        return pd.DataFrame(np.column_stack([self.time, self.winch_speed]), columns=["time", *names])


def design_excitation(
    robot: Robot,
    effects: Sequence[Hypothesis],
    options: DesignOptions,
    progress: Progress,
) -> Excitation:
    """Design the motion that maximises the smallest separation between effects; the same for the same seed.

    Some programs are spread over all that there are, the others near the best one so far.

    Raises ExcitationError where none is within the limits, and InputError where the sensors' noise is not declared.
    """
    # On matrices as small as these, threads wait for each other longer than one of them computes.
    with threadpool_limits(1):
        design = _design_problem(robot, tuple(effects), options, progress)
        best, scores = _search(design, progress)
        if max(scores) <= INFEASIBLE_SCORE:
            raise ExcitationError(len(scores))
        path, program = design.program(best, FINE_SHRINK_FACTOR)
        pairs = tuple(design.separations(program))
    median_separation = 10.0 ** float(np.median([score for score in scores if score > INFEASIBLE_SCORE]))
    return Excitation(path, program.time, program.winch_speed, pairs, median_separation)


def _search(design: _DesignProblem, progress: Progress) -> tuple[Array, list[float]]:
    """The best decision variables, and the scores of all programs in the order in which they were tried."""
    # An amplitude and a frequency of each sine on each axis.
    count, requested = 2 * SINES * (6 if can_turn(design.robot) else 3), design.options.programs
    # Sobol's sequence is balanced at powers of two.
    spread_count = 2 ** ceil(log2(max(count, SPREAD_SHARE * requested)))
    generations = max(0, round((requested - spread_count) / GENERATION))
    total = spread_count + generations * GENERATION
    random = np.random.RandomState(design.options.seed)
    scores: list[float] = []
    # What is called is compiled at its first call, which each process that is forked would do again.
    design.score(np.zeros(count))

    def report(begun: int) -> None:
        progress("trying programs", (len(scores) + begun) / total)

    tried = Sobol(count, seed=random).random(spread_count)
    scores += map_in_forks(design.score, list(tried), report)
    for _ in range(generations):
        best = tried[np.argmax(scores)]
        moved = np.clip(best + MOVE * random.standard_normal((GENERATION, count)), 0.0, 1.0)
        is_anew = random.random_sample(moved.shape) < ANEW_SHARE
        moved[is_anew] = random.random_sample(np.sum(is_anew))
        tried = np.vstack([tried, moved])
        scores += map_in_forks(design.score, list(moved), report)
    return tried[np.argmax(scores)], scores


@dataclass(frozen=True)
class _DesignProblem:
    robot: Robot
    effects: tuple[Hypothesis, ...]
    options: DesignOptions
    likelihood: Likelihood
    sensitivities: tuple[EffectSensitivities, ...]

    def score(self, decision_variables: Array) -> float:
        """Log10 of the smallest separation in nats."""
        try:
            _, program = self.program(decision_variables)
        except _InfeasibleError:
            return INFEASIBLE_SCORE
        pairs = self.separations(program)
        is_known = bool(pairs) and isfinite(pairs[0].nats)
        return log10(max(pairs[0].nats, MIN_SEPARATION)) if is_known else INFEASIBLE_SCORE

    def program(self, decision_variables: Array, shrink_factor: float = SHRINK_FACTOR) -> tuple[Trajectory, Recording]:
        """Decode decision variables between 0 and 1 into a path within the limits, and what sensors show along it."""
        scale = 1.0
        while scale > MIN_SCALE:
            path = self._path(decision_variables, scale)
            recording = self._simulated_within_limits(path)
            if recording is not None:
                return path, recording
            scale *= shrink_factor
        raise _InfeasibleError

    def _path(self, decision_variables: Array, scale: float) -> Trajectory:
        """The path whose amplitudes are scaled; of a platform that turns, the last axes are those of its rotation."""
        groups = np.asarray(decision_variables).reshape(2, SINES, -1)
        limits, platform = self.options.limits, self.robot.platform
        translation = self._multisine(platform.start, groups[:, :, :3], (limits.reach, limits.speed), scale)
        if not can_turn(self.robot):
            return translation
        of_rotation = (limits.turn, limits.speed / platform_size(self.robot))
        rotation = self._multisine((0.0, 0.0, 0.0), groups[:, :, 3:], of_rotation, scale)
        return PoseTrajectory(translation, OrientationTrajectory(platform.start_orientation, rotation))

    def _multisine(
        self, start: Point, decision_variables: Array, bounds: tuple[float, float], scale: float
    ) -> MultisinePath:
        """Sines of three axes from ``start``, within bounds of their deviation and its rate."""
        amplitude, frequency_fraction = decision_variables
        slowest, middle, fastest = 1.0 / self.options.duration, 6.0 / self.options.duration, 0.2 / self.options.interval
        begin = np.array([slowest] * SLOW_SINES + [middle] * FAST_SINES)[:, None]
        end = np.array([middle] * SLOW_SINES + [max(min(fastest, 3.0), middle)] * FAST_SINES)[:, None]
        frequencies = begin * (end / begin) ** frequency_fraction
        # Amplitudes are limited by speed too: a fast sine is small.
        max_amplitude = np.minimum(
            bounds[0] / SINES,
            bounds[1] / (2.0 * np.pi * frequencies),
        )
        amplitudes = _as_rows(amplitude * max_amplitude)
        return MultisinePath(start, self.options.duration, amplitudes, _as_rows(frequencies)).scaled(scale)

    def _simulated_within_limits(self, path: Trajectory) -> Recording | None:
        """Simulated recording of sensors without noise; None where a limit is broken."""
        limits, interval = self.options.limits, self.options.interval
        time = np.asarray(interval * np.arange(round(self.options.duration / interval) + 1), dtype=np.float64)
        # A few samples show of most paths that they are too fast.
        for stride in (SPEED_CHECK_STRIDE, 1):
            speed = ideal_winch_speeds(self.robot, path, time[::stride])
            if np.max(np.abs(speed)) > limits.speed:
                return None
        unmeasured = np.full(speed.shape, np.nan)
        template = Recording("program", time, speed, unmeasured, np.full((len(time), 3), np.nan))
        outputs = self.likelihood.simulated_outputs(template, ())
        if not (limits.min_tension <= np.min(outputs.tension) and np.max(outputs.tension) <= limits.max_tension):
            return None
        recording = replace(template, position=outputs.position, tension=outputs.tension)
        return recording if outputs.orientation is None else replace(recording, orientation=outputs.orientation)

    def separations(self, recording: Recording) -> list[EffectSeparation]:
        """Separations of each effect from each other along a program, the closest first."""
        runs = linearise_filter(self.likelihood, [], recording)
        signatures = statistics_of_runs(runs, self.sensitivities, np.ones(len(recording.time), dtype=bool))
        start_directions = {one: start_steps(signatures, self.robot, one) for one in self.effects}
        # An effect that this motion would not show at all (slack, where no rope hangs) does not rank programs.
        visible_effects = [
            one
            for one, move in start_directions.items()
            if float((move.T @ signatures.fisher_information @ move)[0, 0]) > 0.0
        ]
        if not visible_effects:
            return []
        steps = np.hstack([start_directions[one] for one in visible_effects])
        nats = np.array([separation_nats(signatures, steps, other) for other in visible_effects]).T.tolist()
        separations = [
            EffectSeparation(one, other, value)
            for one, row in zip(visible_effects, nats, strict=True)
            for other, value in zip(visible_effects, row, strict=True)
            if one.effect is not other.effect
        ]
        return sorted(separations, key=lambda pair: pair.nats)


def _design_problem(
    robot: Robot, effects: tuple[Hypothesis, ...], options: DesignOptions, progress: Progress
) -> _DesignProblem:
    progress("compiling the filter", 0.0)
    likelihood = Likelihood(robot, (), declared_noise(robot), options.interval, max_state_angle=MAX_STATE_ANGLE)
    sensitivities: list[EffectSensitivities] = []
    groups = [[h for h in effects if h.effect is effect] for effect in dict.fromkeys(h.effect for h in effects)]
    for group in groups:
        sensitivities += effect_sensitivities(robot, group, likelihood.model.state_names)
        progress("compiling the filter", len(sensitivities) / (len(groups) + FILTER_WORK))
    return _DesignProblem(robot, effects, options, likelihood, tuple(sensitivities))


class _InfeasibleError(Exception):
    """Even a small motion along this path breaks a limit."""


def _as_rows(matrix: Array) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in matrix)


def effects_by_name(robot: Robot, names: str | None) -> tuple[Hypothesis, ...]:
    """The hypotheses on all cables or the platform, of the effects that a list with commas names, or of all.

    Raises InputError for a name that is no effect, and for fewer than two.
    """
    candidates = [h for h in hypotheses(robot) if h.cables in ((), robot.cable_numbers)]
    if names is None:
        return tuple(candidates)
    requested = [name.strip() for name in names.split(",") if name.strip()]
    available = sorted({hypothesis.effect.name for hypothesis in candidates})
    for name in requested:
        if name not in available:
            raise InputError(
                "--effects", f"{name!r} is not an effect that acts on all cables", f"choose from {', '.join(available)}"
            )
    if len(set(requested)) < 2:
        raise InputError("--effects", "names fewer than two effects", "name at least two, as in damping,relaxation")
    return tuple(hypothesis for hypothesis in candidates if hypothesis.effect.name in requested)
