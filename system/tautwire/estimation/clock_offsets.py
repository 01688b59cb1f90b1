"""Clock offsets between the sensors' recorder and the winches', estimated where they differ between recordings.

A sensor that lags by the same time in both recordings is an effect, ``sensor_delay``; what differs between them, or
runs ahead, is a clock offset. Outputs ``y(t) = h(t - b)`` move the innovations by ``J = dv/db``; least squares gives
``b``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import casadi
import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..recordings.recording import Recording
from ..robot.schema import Robot
from .estimation_data import DataSet, DataSplit
from .filter_linearisation import LinearisedSegment, linearise_filter
from .likelihood import Likelihood
from .parameter_fit import Fitter
from .policy import DEFAULT_POLICY
from .preprocessing_policy import ClockOffsetPolicy

Array = NDArray[np.float64]

JACKKNIFE_BLOCKS = 6
# Taps of the windowed sinc on each side of a shifted sample, and the Kaiser window's beta.
TAPS_PER_SIDE, KAISER_BETA = 24, 8.0
UNIFORM_SAMPLING_TOLERANCE = 1e-3


@dataclass(frozen=True)
class ChannelGroup:
    """Output channels that share a clock, and their name: those of the tracker, pose, or those of the load cells."""

    name: str
    is_tracker: bool

    def columns(self, cable_count: int, output_count: int) -> list[int]:
        """The columns among the outputs."""
        tensions = range(3, 3 + cable_count)
        return [column for column in range(output_count) if (column not in tensions) == self.is_tracker]


CHANNEL_GROUPS = (ChannelGroup("positions", True), ChannelGroup("tensions", False))


@dataclass(frozen=True)
class ClockOffset:
    """Clock offset of a channel group: positive ``seconds`` where outputs lag, and its jackknife standard deviation.

    ``variance_before`` and ``variance_after`` are mean squares of the innovations without and with the outputs shifted
    back.
    """

    seconds: float
    standard_deviation: float
    variance_before: float
    variance_after: float


def with_clocks_set(
    fitter: Fitter,
    robot: Robot,
    split: DataSplit,
    policy: ClockOffsetPolicy = DEFAULT_POLICY.preprocessing.clock_offsets,
) -> tuple[DataSplit, tuple[str, ...]]:
    """Data with outputs shifted where clocks are offset, and notes.

    Raises RecordingError where they are, and samples are too uneven or too sparse to be shifted.
    """
    samples = (split.estimation, split.validation)
    if split.estimation.recording is split.validation.recording:
        return split, ()
    interval = max(float(np.median(np.diff(sample.recording.time))) for sample in samples)
    first_steps = [_offset_steps(fitter, robot, sample) for sample in samples]
    for channels in CHANNEL_GROUPS:
        initial_offsets = [steps.get(channels) for steps in first_steps]
        if None in initial_offsets or not any(
            offset and offset.variance_after < policy.max_candidate_variance_ratio * offset.variance_before
            for offset in initial_offsets
        ):
            continue
        converged = [_estimate_offset(fitter, robot, sample, channels, policy) for sample in samples]
        offsets = [offset for offset in converged if offset is not None]
        reason = _clock_reason(offsets, interval, policy) if len(offsets) == len(samples) else None
        if reason is None:
            continue
        estimation, validation = (
            _shift_sample(sample, offset, channels) for sample, offset in zip(samples, offsets, strict=True)
        )
        notes = tuple(
            _offset_note(s.recording.path, o, channels, reason) for s, o in zip(samples, offsets, strict=True)
        )
        return DataSplit(estimation, validation, split.notes), notes
    return split, ()


def _clock_reason(offsets: list[ClockOffset], interval: float, policy: ClockOffsetPolicy) -> str | None:
    """Reason why the offsets of two recordings are clock offsets; None where they are not, or other errors dominate."""
    min_difference = max(
        policy.min_offset_sigmas * hypot(*(offset.standard_deviation for offset in offsets)),
        policy.min_offset_intervals * interval,
    )
    larger = max(offsets, key=lambda offset: abs(offset.seconds))
    if (
        abs(offsets[0].seconds - offsets[1].seconds) > min_difference
        and larger.variance_after < policy.max_clock_variance_ratio * larger.variance_before
    ):
        return "unlike in the other recording"
    ahead = max(offset.seconds for offset in offsets) < -min_difference
    return (
        "so they precede the motion"
        if ahead and all(offset.variance_after < policy.max_explained_variance for offset in offsets)
        else None
    )


def _offset_note(path: str, offset: ClockOffset, channels: ChannelGroup, reason: str) -> str:
    relation = "behind" if offset.seconds > 0.0 else "ahead of"
    size = f"{1e3 * abs(offset.seconds):.2f} ms"
    return f"{path}: {channels.name} are {size} {relation} the winch speeds, {reason}: corrected as a clock offset"


def _shift_sample(sample: DataSet, offset: ClockOffset, channels: ChannelGroup) -> DataSet:
    return replace(sample, recording=shifted(sample.recording, offset.seconds, channels))


def _estimate_offset(
    fitter: Fitter, robot: Robot, sample: DataSet, channels: ChannelGroup, policy: ClockOffsetPolicy
) -> ClockOffset | None:
    """Estimate an offset by the Gauss-Newton method, shifting outputs at each step; None where it does not converge.

    An offset that has not converged would differ from the other recording's and pass for a clock.
    """
    step = _offset_steps(fitter, robot, sample)[channels]
    variance_before, total = step.variance_before, step.seconds
    for _ in range(policy.max_iterations):
        if abs(step.seconds) < max(policy.relative_tolerance * abs(total), 0.2 * step.standard_deviation):
            return ClockOffset(total, step.standard_deviation, variance_before, step.variance_after)
        current = replace(sample, recording=shifted(sample.recording, total, channels))
        step = _offset_steps(fitter, robot, current)[channels]
        total += step.seconds
    return None


def _offset_steps(fitter: Fitter, robot: Robot, sample: DataSet) -> dict[ChannelGroup, ClockOffset]:
    """First-order corrections of the offset of each measured channel group."""
    likelihood, values = fitter.likelihood(robot, (), sample)
    scores, informations, squares = [], [], []
    state_sensitivities = np.zeros((likelihood.model.states.numel(), len(CHANNEL_GROUPS)))
    for segment in linearise_filter(likelihood, values, sample.recording):
        fitter.poll_interrupts()
        output_sensitivities = np.zeros((*segment.observed.shape, len(CHANNEL_GROUPS)))
        output_rates = _output_rates(likelihood, segment)
        for number, channels in enumerate(CHANNEL_GROUPS):
            columns = channels.columns(robot.cable_count, output_rates.shape[1])
            output_sensitivities[:, columns, number] = -output_rates[:, columns]
        state_sensitivities, innovation_sensitivities = segment.propagate_sensitivities(
            state_sensitivities,
            np.zeros((len(output_sensitivities), len(state_sensitivities), len(CHANNEL_GROUPS))),
            output_sensitivities,
        )
        scores.append(np.einsum("kmp,km->kp", innovation_sensitivities, segment.values))
        informations.append(np.sum(innovation_sensitivities**2, axis=1))
        squares.append(segment.values[segment.observed] ** 2)
    score, information = np.concatenate(scores), np.concatenate(informations)
    is_seen = {True: sample.recording.has_position, False: sample.recording.has_tension}
    return {
        channels: _gauss_newton_step(score[:, number], information[:, number], np.concatenate(squares))
        for number, channels in enumerate(CHANNEL_GROUPS)
        if is_seen[channels.is_tracker]
    }


def _gauss_newton_step(score: Array, information: Array, squares: Array) -> ClockOffset:
    total = max(float(np.sum(information)), np.finfo(float).tiny)
    step = -float(np.sum(score)) / total
    # Deviation of each block's own step, weighted by its information.
    blocks = np.array_split(np.arange(len(score)), JACKKNIFE_BLOCKS)
    block_deviations = np.array([-(np.sum(score[part]) + step * np.sum(information[part])) / total for part in blocks])
    deviation = float(np.sqrt(np.sum(block_deviations**2) * JACKKNIFE_BLOCKS / (JACKKNIFE_BLOCKS - 1) + 1.0 / total))
    variance_before = float(np.mean(squares))
    return ClockOffset(step, deviation, variance_before, variance_before - step**2 * total / len(squares))


def _output_rates(likelihood: Likelihood, segment: LinearisedSegment) -> Array:
    """Rates (K, m) of the predicted outputs along a segment of the filter's run."""
    model, count, indices = likelihood.model, likelihood.cable_count, likelihood.model.indices
    expression = casadi.vertcat(model.outputs[:3], model.outputs[indices.tensions], model.outputs[indices.pose][3:])
    outputs = casadi.Function("outputs", [model.states, model.inputs], [expression])
    speeds = np.vstack([segment.speeds, np.zeros((model.inputs.numel() - count, segment.speeds.shape[1]))])
    values = np.array(outputs(segment.states, speeds))
    # After the last sample of a recording the step is zero.
    time = np.append(0.0, np.cumsum(np.where(segment.step > 0.0, segment.step, 1.0)))
    rates: Array = np.gradient(values, time, axis=1)[:, :-1].T
    motion = segment.states[indices.twist, :-1].T
    rates[:, :3], rates[:, 3 + count :] = motion[:, :3], motion[:, 3:]
    return rates


def shifted(recording: Recording, seconds: float, channels: ChannelGroup) -> Recording:
    """The recording with some outputs as they were measured ``seconds`` later; NaN where they were not.

    Interpolates by a windowed sinc, which leaves white noise white.

    Raises RecordingError where samples are uneven or too sparse.
    """
    interval = float(np.median(np.diff(recording.time)))
    sample_positions = (recording.time - recording.time[0]) / interval
    grid_rows = np.round(sample_positions).astype(int)
    description = f"{channels.name} are {1e3 * seconds:.3g} ms behind the winch speeds"
    if (
        np.max(np.abs(sample_positions - grid_rows))
        > UNIFORM_SAMPLING_TOLERANCE * max(1.0, float(grid_rows[-1])) ** 0.5
    ):
        raise RecordingError(
            recording.path, f"{description}, and the sampling is not uniform", "synchronise the clocks"
        )
    measured = np.hstack([recording.measured(), recording.orientation])
    columns = channels.columns(recording.cable_count, measured.shape[1])
    whole_steps = int(np.round(seconds / interval))
    kernel = np.sinc(np.arange(-TAPS_PER_SIDE, TAPS_PER_SIDE + 1) - (seconds / interval - whole_steps)) * np.kaiser(
        2 * TAPS_PER_SIDE + 1, KAISER_BETA
    )
    margin = TAPS_PER_SIDE + abs(whole_steps)
    for column in columns:
        padded = np.full(int(grid_rows[-1]) + 1 + 2 * margin, np.nan)
        padded[margin + grid_rows] = measured[:, column]
        measured[:, column] = np.correlate(padded, kernel / np.sum(kernel), mode="valid")[
            abs(whole_steps) + whole_steps + grid_rows
        ]
    if not np.isfinite(measured[:, columns]).any():
        raise RecordingError(
            recording.path, f"{description}, and are too sparse to be resampled", "synchronise the clocks"
        )
    position, tension, quaternions = np.split(measured, [3, 3 + recording.cable_count], axis=1)
    lengths = np.linalg.norm(quaternions, axis=1, keepdims=True)
    return replace(recording, position=position, tension=tension, orientation=quaternions / lengths)
