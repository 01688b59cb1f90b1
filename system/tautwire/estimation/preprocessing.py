"""Preprocessing of recordings, step by step: from what was recorded to data that a filter may trust.

1. Long recordings are truncated (:func:`shortened`).
2. Each alone loses dead channels and outliers, is refused where its units cannot be, and is cut at gaps
   (:data:`CLEANING_STEPS`).
3. The declared noise is tested against all of them; self-stress and motion at the start widen the prior of the initial
   state (:func:`prepare_recordings`).
4. They are split into estimation and validation data; winch speeds that are central differences, and clock offsets,
   are corrected (:func:`prepare_data`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import RecordingError
from ..recordings.consistency import require_plausible
from ..recordings.dead_channels import without_dead_channels
from ..recordings.gaps import without_gaps
from ..recordings.outliers import without_outliers
from ..recordings.recording import Recording, require_outputs
from ..recordings.rope_length_smoothing import LengthSmoothing, length_smoothing
from ..recordings.standing_winches import without_noise_of_standing_winches
from ..robot.schema import Robot
from ..robot.uncertain_parameters import is_surveyed
from .clock_offsets import with_clocks_set
from .disturbance_fit import with_fitted_disturbance
from .disturbance_posterior import disturbance_prior
from .estimation_data import DataSet, DataSplit, split_data
from .initial_state_prior import self_stress_deviation, with_motion_at_start
from .innovations import Innovations
from .integration_steps import require_followable
from .kalman_filter import Noise
from .measurement_noise import check_noise, estimate_noise
from .parameter_fit import Fitter
from .policy import DEFAULT_POLICY, IdentificationPolicy, ResidualAnalysisPolicy
from .preprocessing_policy import PreprocessingPolicy
from .residual_analysis import has_enough_samples, residuals_are_white
from .speed_versions import speed_versions, split_with_other_interpolation
from .worker_pool import WorkerPool


@dataclass(frozen=True)
class PreparedRecordings:
    """Cleaned recordings, their noise, and smoothing of FIT's rope lengths, with notes of every step applied."""

    fit: Recording
    check: Recording | None
    noise: Noise
    smoothing: tuple[LengthSmoothing | None, ...]
    notes: tuple[str, ...]


def _with_outputs(robot: Robot, recording: Recording, policy: PreprocessingPolicy) -> tuple[Recording, tuple[str, ...]]:
    """The recording as it is; raises RecordingError where the steps before left no output."""
    require_outputs(recording)
    return recording, ()


def _plausible(robot: Robot, recording: Recording, policy: PreprocessingPolicy) -> tuple[Recording, tuple[str, ...]]:
    """The recording as it is; raises RecordingError where its units, signs or order seem to be mistaken."""
    require_plausible(robot, recording)
    return recording, ()


def _without_gaps(robot: Robot, recording: Recording, policy: PreprocessingPolicy) -> tuple[Recording, tuple[str, ...]]:
    detectable = detectable_length(robot, estimate_noise(robot, recording), recording)
    return without_gaps(recording, policy.max_length_error_sigmas * detectable, policy.max_step_intervals)


CleaningStep = Callable[[Robot, Recording, PreprocessingPolicy], tuple[Recording, tuple[str, ...]]]

CLEANING_STEPS: tuple[CleaningStep, ...] = (
    lambda robot, recording, policy: without_dead_channels(recording, policy.dead_channels),
    lambda robot, recording, policy: without_outliers(recording, policy.outliers),
    _with_outputs,
    _plausible,
    _without_gaps,
    lambda robot, recording, policy: without_noise_of_standing_winches(robot, recording),
)


def prepare_recordings(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    policy: PreprocessingPolicy = DEFAULT_POLICY.preprocessing,
) -> PreparedRecordings:
    """Clean both recordings, test the declared noise against them, and widen the prior of the initial state.

    Raises RecordingError where a recording has no output that carries information, has samples that are too far apart,
    or is not to be trusted.
    """
    cleaned: list[Recording] = []
    notes: tuple[str, ...] = ()
    for recording in (fit,) if check is None else (fit, check):
        cleaned.append(recording)
        for step in CLEANING_STEPS:
            cleaned[-1], step_notes = step(robot, cleaned[-1], policy)
            notes += step_notes
        require_followable(robot, recording.path, float(np.median(np.diff(recording.time))))
    checked = check_noise(robot, estimate_noise(robot, cleaned[0]), tuple(cleaned), policy.noise_check)
    self_stress, self_stress_notes = self_stress_deviation(robot, tuple(cleaned), policy.initial_state)
    noise = replace(checked.noise, self_stress=self_stress)
    if not any(np.any(recording.winch_speed) for recording in cleaned):
        noise = replace(noise, winch_speed=0.0)
    noise, motion_notes = with_motion_at_start(robot, noise, cleaned, policy.initial_state)
    smoothing = length_smoothing(cleaned[0])
    largest_error = max((each.rms for each in smoothing if each), default=0.0)
    is_length_coloured = largest_error > policy.noticeable_length_error_sigmas * detectable_length(
        robot, noise, cleaned[0]
    )
    if checked.is_coloured or is_length_coloured or is_surveyed(robot):
        noise = replace(noise, disturbance=disturbance_prior(robot, noise).median)
    return PreparedRecordings(
        fit=cleaned[0],
        check=None if check is None else cleaned[1],
        noise=noise,
        smoothing=smoothing,
        notes=(*notes, *checked.notes, *self_stress_notes, *motion_notes),
    )


@dataclass(frozen=True)
class PreparedData:
    """Preprocessed data, the declared model's innovations on them, and notes on what was done."""

    split: DataSplit
    data_sets: tuple[DataSet, ...]
    fitter: Fitter
    innovations: tuple[Innovations, Innovations]
    notes: tuple[str, ...]


def prepare_data(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    workers: WorkerPool,
    policy: IdentificationPolicy = DEFAULT_POLICY,
) -> tuple[PreparedData, ...]:
    """Preprocess the recordings; in several versions where clocks or winch speeds seem to be wrong, and more with them.

    The first is as recorded then: an effect that explains all of it goes before a clock that explains a part.
    """
    fit, check, truncation_notes = shortened(fit, check, policy.preprocessing.max_samples)
    prepared = prepare_recordings(robot, fit, check, policy.preprocessing)
    data_split = split_data(robot, prepared.noise, prepared.fit, prepared.check)
    fitter = Fitter(prepared.noise, workers.poll_interrupts, policy.fit)
    fitter, data_split = _with_likely_interpolation(fitter, robot, data_split, policy.preprocessing)
    _require_samples(innovations_of(fitter, robot, data_split), data_split, policy.residual_analysis)

    def assembled(fitter: Fitter, data_split: DataSplit, notes: tuple[str, ...]) -> PreparedData:
        data_sets = (data_split.estimation,) if check is None else (data_split.estimation, data_split.validation)
        all_notes = (*truncation_notes, *prepared.notes, *notes, *data_split.notes, *_notes_of(data_sets))
        return PreparedData(data_split, data_sets, fitter, innovations_of(fitter, robot, data_split), all_notes)

    versions = speed_versions(fitter, robot, data_split, prepared.smoothing, policy.preprocessing)
    first, *others = (assembled(*version) for version in versions)
    # A disturbance would take up what clocks that are apart leave.
    if fitter.has_disturbance or all_residuals_white(first.innovations, first.split, policy.residual_analysis):
        return (first, *others)
    fitter, data_split, notes = versions[0]
    data_split, clock_notes = with_clocks_set(fitter, robot, data_split, policy.preprocessing.clock_offsets)
    if not clock_notes:
        return (first, *others)
    clock_corrected = assembled(fitter, data_split, (*notes, *clock_notes))
    explained = all_residuals_white(clock_corrected.innovations, data_split, policy.residual_analysis)
    return (clock_corrected,) if explained else (first, *others, clock_corrected)


def _with_likely_interpolation(
    fitter: Fitter, robot: Robot, split: DataSplit, policy: PreprocessingPolicy
) -> tuple[Fitter, DataSplit]:
    """The disturbance fitted to FIT, with winch speeds linear between samples unless cubic ones are far likelier.

    Without a disturbance they have to explain a share of what the model misses, too, which an effect may have left.
    """
    fitter = with_fitted_disturbance(fitter, robot, (), split.estimation)
    smooth = split_with_other_interpolation(split)
    if smooth is None:
        return fitter, split
    innovations, rows = fitter.innovations(robot, split.estimation), split.estimation.rows
    gain = fitter.log_likelihood(robot, (), smooth.estimation) - innovations.log_likelihood(rows)
    misfit = 0.0 if fitter.has_disturbance else innovations.misfit(rows)
    value_count = int(np.sum(innovations.observed[rows]))
    if gain <= max(policy.min_cubic_gain * value_count, policy.min_cubic_gain_to_misfit * misfit):
        return fitter, split
    return with_fitted_disturbance(fitter, robot, (), smooth.estimation), smooth


def with_other_interpolation(prepared: PreparedData, robot: Robot, split: DataSplit) -> PreparedData:
    """The same data with winch speeds interpolated as those of ``split``, and its recordings' notes."""
    fitter = with_fitted_disturbance(prepared.fitter, robot, (), split.estimation)
    data_sets = (split.estimation, split.validation)[: len(prepared.data_sets)]
    others = [note for note in prepared.notes if note not in _notes_of(prepared.data_sets)]
    innovations = innovations_of(fitter, robot, split)
    return PreparedData(split, data_sets, fitter, innovations, (*others, *_notes_of(data_sets)))


def _notes_of(data_sets: Sequence[DataSet]) -> tuple[str, ...]:
    return tuple(note for data in data_sets for note in data.recording.notes)


def with_disturbance(prepared: PreparedData, robot: Robot) -> PreparedData:
    """The same data with a disturbance in the model, fitted to FIT beside the declared robot."""
    fitter, estimation = prepared.fitter, prepared.split.estimation
    noise = replace(fitter.noise, disturbance=disturbance_prior(robot, fitter.noise).median)
    fitter = with_fitted_disturbance(Fitter(noise, fitter.poll_interrupts, fitter.policy), robot, (), estimation)
    return replace(prepared, fitter=fitter)


def innovations_of(fitter: Fitter, robot: Robot, split: DataSplit) -> tuple[Innovations, Innovations]:
    """Innovations of a robot as it is, on estimation and on validation data."""
    return fitter.innovations(robot, split.estimation), fitter.innovations(robot, split.validation)


def all_residuals_white(
    innovations: Sequence[Innovations],
    split: DataSplit,
    policy: ResidualAnalysisPolicy = DEFAULT_POLICY.residual_analysis,
) -> bool:
    """Whether the residuals are white noise on both estimation and validation data."""
    data_sets = (split.estimation, split.validation)
    return all(
        residuals_are_white(residuals, data.rows, policy)
        for residuals, data in zip(innovations, data_sets, strict=True)
    )


def _require_samples(
    innovations: tuple[Innovations, Innovations], split: DataSplit, policy: ResidualAnalysisPolicy
) -> None:
    least = policy.min_samples
    for residuals, data in zip(innovations, (split.estimation, split.validation), strict=True):
        if not has_enough_samples(residuals, data.rows, policy):
            hint = f"record at least {least} samples, {2 * least} without a check recording"
            raise RecordingError(data.recording.path, "too few samples to test for white noise", hint)


def shortened(
    fit: Recording, check: Recording | None, max_samples: int
) -> tuple[Recording, Recording | None, tuple[str, ...]]:
    """Two recordings truncated to ``max_samples``, and notes; a single one, which also validates, to twice as many.

    The beginning is used and not every n-th sample: ropes have memory, so a model has to follow a recording from its
    start.
    """
    if check is None:
        short_fit, notes = _truncated(fit, 2 * max_samples)
        return short_fit, None, notes
    (short_fit, notes), (short_check, check_notes) = _truncated(fit, max_samples), _truncated(check, max_samples)
    return short_fit, short_check, (*notes, *check_notes)


def _truncated(recording: Recording, max_samples: int) -> tuple[Recording, tuple[str, ...]]:
    count = recording.sample_count
    if count <= max_samples:
        return recording, ()
    short = recording.first(max_samples)
    description = (
        f"its first {short.duration:.4g} s, {max_samples:,} of {count:,} samples, were traced; to "
        "trace another part, cut it out"
    )
    return short, (f"{recording.path}: {description}",)


def detectable_length(robot: Robot, noise: Noise, recording: Recording) -> float:
    """Smallest detectable error of rope length, in m: the noise of the best sensor as a length."""
    detectable = [noise.position] if recording.has_position else []
    if recording.has_tension:
        lengths = [float(np.linalg.norm(np.subtract(anchor, robot.platform.start))) for anchor in robot.anchors]
        stiffest = max(c.modulus * c.area / length for c, length in zip(robot.cables, lengths, strict=True))
        detectable.append(noise.tension / stiffest)
    return min(detectable, default=0.0)
