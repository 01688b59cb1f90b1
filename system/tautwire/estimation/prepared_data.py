"""Preprocessed recordings: what is done to them, the declared model's innovations, and notes of it all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..errors import RecordingError
from ..recordings.recording import Recording
from ..robot.schema import Robot
from .clock_offsets import with_clocks_set
from .estimation_data import DataSet, DataSplit, split_data
from .likelihood import Innovations
from .parameter_fit import Fitter
from .recording_preparation import prepare_recordings, shortened
from .residual_analysis import MIN_SAMPLES, has_enough_samples, residuals_are_white
from .smoothed_states import calibrate
from .worker_pool import WorkerPool


@dataclass(frozen=True)
class PreparedData:
    """Preprocessed data, the declared model's innovations on them, and notes on what was done."""

    split: DataSplit
    data_sets: tuple[DataSet, ...]
    fitter: Fitter
    innovations: tuple[Innovations, Innovations]
    notes: tuple[str, ...]


def prepare_data(
    robot: Robot, fit: Recording, check: Recording | None, workers: WorkerPool
) -> tuple[PreparedData, ...]:
    """Preprocess the recordings; in two versions where clocks seem to be apart but more is wrong.

    The first is as recorded then: an effect that explains all of it goes before a clock that explains a part.
    """
    fit, check, truncation_notes = shortened(fit, check)
    prepared = prepare_recordings(robot, fit, check)
    data_split = split_data(robot, prepared.noise, prepared.fit, prepared.check)
    fitter = Fitter(prepared.noise, workers.poll_interrupts)
    innovations = innovations_of(fitter, robot, data_split)
    _require_samples(innovations, data_split)

    def assembled(
        data_split: DataSplit, innovations: tuple[Innovations, Innovations], clock_notes: tuple[str, ...]
    ) -> PreparedData:
        data_sets = (data_split.estimation,) if check is None else (data_split.estimation, data_split.validation)
        all_notes = (*truncation_notes, *prepared.notes, *clock_notes, *_notes(data_split, data_sets))
        return PreparedData(data_split, data_sets, fitter, innovations, all_notes)

    as_recorded = assembled(data_split, innovations, ())
    if all_residuals_white(innovations, data_split):
        return (as_recorded,)
    data_split, clock_notes = with_clocks_set(fitter, robot, data_split)
    if not clock_notes:
        return (as_recorded,)
    innovations = innovations_of(fitter, robot, data_split)
    clock_corrected = assembled(data_split, innovations, clock_notes)
    return (clock_corrected,) if all_residuals_white(innovations, data_split) else (as_recorded, clock_corrected)


def innovations_of(fitter: Fitter, robot: Robot, split: DataSplit) -> tuple[Innovations, Innovations]:
    """Innovations of a robot as it is, on estimation and on validation data."""
    return fitter.innovations(robot, split.estimation), fitter.innovations(robot, split.validation)


def all_residuals_white(innovations: Sequence[Innovations], split: DataSplit) -> bool:
    """Whether the residuals are white noise on both estimation and validation data."""
    data_sets = (split.estimation, split.validation)
    return all(
        residuals_are_white(residuals, data.rows) for residuals, data in zip(innovations, data_sets, strict=True)
    )


def calibrated_estimation_data(prepared: PreparedData, robot: Robot) -> tuple[Robot, DataSet]:
    """Robot and FIT with uncertain numbers as FIT has them: what is within their bounds is no component's residual."""
    data = prepared.split.estimation
    calibration = calibrate(prepared.fitter, robot, data)
    return calibration.calibrated_robot(robot), replace(
        data, recording=calibration.without_sensor_offsets(data.recording)
    )


def _require_samples(innovations: tuple[Innovations, Innovations], split: DataSplit) -> None:
    for residuals, data in zip(innovations, (split.estimation, split.validation), strict=True):
        if not has_enough_samples(residuals, data.rows):
            hint = f"record at least {MIN_SAMPLES} samples, {2 * MIN_SAMPLES} where there is no check recording"
            raise RecordingError(data.recording.path, "too few samples to tell noise from more", hint)


def _notes(split: DataSplit, data_sets: tuple[DataSet, ...]) -> tuple[str, ...]:
    unknown = tuple(
        f"{s.recording.path}: columns not used: {', '.join(s.recording.unknown_columns)}"
        for s in data_sets
        if s.recording.unknown_columns
    )
    return (*split.notes, *unknown)
