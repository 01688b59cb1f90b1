"""Versions of winch speeds: linear or cubic between samples, or those of the encoders behind them with their errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..recordings.central_differences import may_be_central_differences, with_speeds_between_samples
from ..recordings.recording import Recording
from ..recordings.rope_length_smoothing import LengthSmoothing, with_smoothed_lengths
from ..recordings.speed_interpolation import with_linear_speeds, with_spline_speeds
from ..robot.schema import Robot
from .disturbance import OrnsteinUhlenbeck
from .disturbance_fit import with_fitted_disturbance
from .estimation_data import DataSplit
from .kalman_filter import Noise
from .parameter_fit import Fitter
from .preprocessing_policy import PreprocessingPolicy


def split_with_other_interpolation(split: DataSplit) -> DataSplit | None:
    """The data with winch speeds cubic between samples in place of linear, or the other way round.

    None where the speeds are an encoder's: see :func:`speed_versions` for these.
    """
    fit, check = split.estimation.recording, split.validation.recording
    if split.has_speeds_between_samples or may_be_central_differences(fit):
        return None
    interpolated = with_spline_speeds if fit.winch_acceleration is None else with_linear_speeds
    other = interpolated(fit)
    return replace(
        split,
        estimation=replace(split.estimation, recording=other),
        validation=replace(split.validation, recording=other if check is fit else interpolated(check)),
    )


def speed_versions(
    fitter: Fitter,
    robot: Robot,
    split: DataSplit,
    smoothing: Sequence[LengthSmoothing | None],
    policy: PreprocessingPolicy,
) -> list[tuple[Fitter, DataSplit, tuple[str, ...]]]:
    """The data with winch speeds as recorded or, where FIT is far likelier so, as taken from the encoders' lengths.

    Each under its own disturbance, with notes. Counts that are coarse add more noise than the motion that is taken
    back. Where the model is far off, its errors decide on the likelihood: unless speeds explain a share of them, those
    of rope lengths come in both versions. Where CHECK lacks a length, none is smoothed: one noise is of both.
    """
    as_recorded = (fitter, split, ())
    recorded, check = split.estimation.recording, split.validation.recording
    if not may_be_central_differences(recorded):
        return [as_recorded]
    are_of_both = all(each is None or known for each, known in zip(smoothing, _has_lengths(check), strict=True))
    noise, with_speeds, description = _speeds_from_encoders(fitter.noise, smoothing if are_of_both else ())
    estimation = replace(split.estimation, recording=with_speeds(recorded))
    other = fitter if noise == fitter.noise else Fitter(noise, fitter.poll_interrupts, fitter.policy)
    other = with_fitted_disturbance(other, robot, (), estimation)
    rows, before = split.estimation.rows, fitter.innovations(robot, split.estimation)
    gain = other.log_likelihood(robot, (), estimation) - before.log_likelihood(rows)
    decisive_gain = policy.decisive_gain(before.misfit(rows))
    is_undecided = decisive_gain > policy.min_speed_gain and not fitter.has_disturbance and recorded.rope_lengths
    if gain < decisive_gain and not is_undecided:
        return [as_recorded]
    is_shared = check is recorded
    validation = replace(split.validation, recording=estimation.recording if is_shared else with_speeds(check))
    size = float(np.max(np.std(estimation.recording.winch_speed - recorded.winch_speed, axis=0)))
    paths = recorded.path if is_shared else f"{recorded.path} and {check.path}"
    note = f"{paths}: winch speeds are {description} differ by {size:.2g} m/s (rms), were used"
    data = DataSplit(estimation, validation, split.notes, has_speeds_between_samples=True)
    corrected = (other, data, (note,))
    return [corrected] if gain >= decisive_gain else [as_recorded, corrected]


def _has_lengths(check: Recording) -> list[bool]:
    """Whether each cable's speed in CHECK is a length's rate, or zero: those of others drift, which errors do not."""
    stands = ~np.any(check.winch_speed, axis=0)
    return [bool(stands[cable - 1]) or cable in check.rope_lengths for cable in range(1, check.cable_count + 1)]


def _speeds_from_encoders(
    noise: Noise, smoothing: Sequence[LengthSmoothing | None]
) -> tuple[Noise, Callable[[Recording], Recording], str]:
    """Noise, winch speeds, and words for them where an encoder's lengths or counts are behind those recorded."""
    if not any(smoothing):
        return noise, with_speeds_between_samples, "central differences of counts; those between samples, which"
    rms = max(each.rms for each in smoothing if each)
    description = f"rates of rope lengths; those of smoothing splines, left with errors of {rms:.2g} m (rms), which"
    absent = OrnsteinUhlenbeck(0.0, 1.0)
    errors = tuple(OrnsteinUhlenbeck(each.rms, each.bandwidth) if each else absent for each in smoothing)
    return (
        replace(noise, rope_lengths=errors),
        lambda recording: with_smoothed_lengths(recording, smoothing),
        description,
    )
