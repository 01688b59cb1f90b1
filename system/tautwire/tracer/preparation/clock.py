"""Clocks of the sensors' recorder and of the winches' that are apart, otherwise in one recording than in the other.

A sensor that shows late by the same time in both is an effect, ``sensor_delay``; what differs between recordings, or
runs ahead, is a clock. Outputs ``y(t) = h(t - b)`` move the innovations by ``J = dv/db``; least squares gives ``b``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import casadi
import numpy as np
from numpy.typing import NDArray

from ...errors import RecordingError
from ...recordings.recording import Recording
from ...robots.robot import Robot
from ..data import Evidence, Sample
from ..fit import Fitter
from ..likelihood import Likelihood
from ..linearisation import Linearised, linearise_run

Array = NDArray[np.float64]

PARTS, SIGMAS = 6, 6.0
# An offset of half a swing's period takes some ten rounds.
ROUNDS, SETTLED = 25, 0.002
# Of a sample interval: less is no matter of clocks.
LEAST = 0.1
# Of the innovations' mean square: what an offset leaves at first order where it is worth a look, and in the end where
# clocks are what is wrong most. A clock that runs ahead in both recordings has to leave this much at most.
WORTH, MOSTLY = 0.8, 0.33
EXPLAINED = 1.5
# Taps on each side of a shifted sample, and the window's shape (Kaiser).
TAPS, SHAPE = 24, 8.0
EVEN = 1e-3


@dataclass(frozen=True)
class Channels:
    """Outputs that share a clock: their name, and the places from the first to before the last."""

    name: str
    first: int
    last: int | None

    @property
    def places(self) -> slice:
        """As an index."""
        return slice(self.first, self.last)


CHANNELS = (Channels("positions", 0, 3), Channels("tensions", 3, None))


@dataclass(frozen=True)
class Offset:
    """By how many seconds outputs are late, its deviation by parts of the recording, and mean squares of innovations.

    ``without`` is what was there, ``left`` what stays with the outputs shifted back.
    """

    seconds: float
    deviation: float
    without: float
    left: float


def with_clocks_set(fitter: Fitter, robot: Robot, evidence: Evidence) -> tuple[Evidence, tuple[str, ...]]:
    """The evidence with outputs shifted where clocks are apart, and notes.

    Raises RecordingError where they are, and samples are too uneven or too sparse to be shifted.
    """
    samples = (evidence.fit, evidence.judge)
    if evidence.fit.recording is evidence.judge.recording:
        return evidence, ()
    interval = max(float(np.median(np.diff(sample.recording.time))) for sample in samples)
    firsts = [_steps(fitter, robot, sample) for sample in samples]
    for channels in CHANNELS:
        begun = [first.get(channels) for first in firsts]
        if None in begun or not any(o and o.left < WORTH * o.without for o in begun):
            continue
        settled = [_offset(fitter, robot, sample, channels) for sample in samples]
        offsets = [offset for offset in settled if offset is not None]
        why = _why(offsets, interval) if len(offsets) == len(samples) else None
        if why is None:
            continue
        fit, judge = (_moved(sample, offset, channels) for sample, offset in zip(samples, offsets, strict=True))
        notes = tuple(_note(s.recording.path, o, channels, why) for s, o in zip(samples, offsets, strict=True))
        return Evidence(fit, judge, evidence.notes), notes
    return evidence, ()


def _why(offsets: list[Offset], interval: float) -> str | None:
    """Why offsets of two recordings are of clocks; None where they are not, or other things count for more."""
    least = max(SIGMAS * hypot(*(offset.deviation for offset in offsets)), LEAST * interval)
    larger = max(offsets, key=lambda offset: abs(offset.seconds))
    if abs(offsets[0].seconds - offsets[1].seconds) > least and larger.left < MOSTLY * larger.without:
        return "not as in the other recording"
    ahead = max(offset.seconds for offset in offsets) < -least
    return "before the motion" if ahead and all(offset.left < EXPLAINED for offset in offsets) else None


def _note(path: str, offset: Offset, channels: Channels, why: str) -> str:
    way = "behind" if offset.seconds > 0.0 else "ahead of"
    size = f"{1e3 * abs(offset.seconds):.2f} ms"
    return f"{path}: {channels.name} run {size} {way} winch speeds, {why}: a clock, no effect; shifted back"


def _moved(sample: Sample, offset: Offset, channels: Channels) -> Sample:
    return replace(sample, recording=shifted(sample.recording, offset.seconds, channels))


def _offset(fitter: Fitter, robot: Robot, sample: Sample, channels: Channels) -> Offset | None:
    """By Gauss and Newton's method, each step from the outputs as the last one shifted them; None if it does not end.

    An offset that is still on its way would differ from the other recording's and pass for a clock.
    """
    found = _steps(fitter, robot, sample)[channels]
    without, total = found.without, found.seconds
    for _ in range(ROUNDS):
        if abs(found.seconds) < max(SETTLED * abs(total), 0.2 * found.deviation):
            return Offset(total, found.deviation, without, found.left)
        current = replace(sample, recording=shifted(sample.recording, total, channels))
        found = _steps(fitter, robot, current)[channels]
        total += found.seconds
    return None


def _steps(fitter: Fitter, robot: Robot, sample: Sample) -> dict[Channels, Offset]:
    """A correction of the offset of each kind of outputs that is seen, to first order."""
    likelihood, values = fitter.likelihood(robot, (), sample)
    pulls, weights, squares = [], [], []
    slopes = np.zeros((likelihood.model.states.numel(), len(CHANNELS)))
    for run in linearise_run(likelihood, values, sample.recording):
        fitter.between()
        shown = np.zeros((*run.seen.shape, len(CHANNELS)))
        rates = _rates(likelihood, run)
        for number, channels in enumerate(CHANNELS):
            shown[:, channels.places, number] = -rates[:, channels.places]
        slopes, moved = run.carry(slopes, np.zeros((len(shown), len(slopes), len(CHANNELS))), shown)
        pulls.append(np.einsum("kmp,km->kp", moved, run.values))
        weights.append(np.sum(moved**2, axis=1))
        squares.append(run.values[run.seen] ** 2)
    pull, weight = np.concatenate(pulls), np.concatenate(weights)
    columns = [sample.recording.measured()[:, channels.places] for channels in CHANNELS]
    return {
        channels: _step(pull[:, number], weight[:, number], np.concatenate(squares))
        for number, channels in enumerate(CHANNELS)
        if np.isfinite(columns[number]).any()
    }


def _step(pull: Array, weight: Array, squares: Array) -> Offset:
    total = max(float(np.sum(weight)), np.finfo(float).tiny)
    step = -float(np.sum(pull)) / total
    # By how much each part would rather have another step, weighed as it counts.
    parts = np.array_split(np.arange(len(pull)), PARTS)
    apart = np.array([-(np.sum(pull[part]) + step * np.sum(weight[part])) / total for part in parts])
    deviation = float(np.sqrt(np.sum(apart**2) * PARTS / (PARTS - 1) + 1.0 / total))
    before = float(np.mean(squares))
    return Offset(step, deviation, before, before - step**2 * total / len(squares))


def _rates(likelihood: Likelihood, run: Linearised) -> Array:
    """Rates (K, m) of what sensors would show along a stretch of the predicted run."""
    model, count = likelihood.model, likelihood.cable_count
    shown = casadi.vertcat(model.outputs[:3], model.outputs[6 : 6 + count])
    outputs = casadi.Function("shown", [model.states, model.inputs], [shown])
    speeds = np.vstack([run.speeds, np.zeros((model.inputs.numel() - count, run.speeds.shape[1]))])
    values = np.array(outputs(run.states, speeds))
    # After the last sample nothing moves.
    time = np.append(0.0, np.cumsum(np.where(run.step > 0.0, run.step, 1.0)))
    slopes: Array = np.gradient(values, time, axis=1)[:, :-1].T
    slopes[:, :3] = run.states[3:6, :-1].T
    return slopes


def shifted(recording: Recording, seconds: float, channels: Channels) -> Recording:
    """The recording with some outputs as they were shown ``seconds`` later; NaN where they were not.

    By a windowed sinc, which leaves white noise white. Raises RecordingError where samples are uneven or too sparse.
    """
    interval = float(np.median(np.diff(recording.time)))
    places = (recording.time - recording.time[0]) / interval
    rows = np.round(places).astype(int)
    late = f"{channels.name} run {1e3 * seconds:.3g} ms behind winch speeds"
    if np.max(np.abs(places - rows)) > EVEN * max(1.0, float(rows[-1])) ** 0.5:
        raise RecordingError(recording.path, f"{late}, and samples are uneven", "set the clocks right")
    measured = recording.measured()
    steps = int(np.round(seconds / interval))
    taps = np.sinc(np.arange(-TAPS, TAPS + 1) - (seconds / interval - steps)) * np.kaiser(2 * TAPS + 1, SHAPE)
    reach = TAPS + abs(steps)
    for column in measured[:, channels.places].T:
        whole = np.full(int(rows[-1]) + 1 + 2 * reach, np.nan)
        whole[reach + rows] = column
        column[:] = np.correlate(whole, taps / np.sum(taps), mode="valid")[abs(steps) + steps + rows]
    if not np.isfinite(measured[:, channels.places]).any():
        raise RecordingError(recording.path, f"{late}, and are too sparse to be shifted", "set the clocks right")
    return replace(recording, position=measured[:, :3], tension=measured[:, 3:])
