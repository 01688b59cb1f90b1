"""Recordings made ready for judging: what is done to them, the plain model's innovations, and notes of it all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..errors import RecordingError
from ..recordings.recording import Recording
from ..robots.robot import Robot
from .adequacy import FEWEST, enough_samples, is_noise
from .data import Evidence, Sample, split
from .fit import Fitter
from .likelihood import Innovations
from .preparation.calibration import calibrated
from .preparation.clock import with_clocks_set
from .preparation.length import shortened
from .preparation.preparation import prepare
from .workers import Workers


@dataclass(frozen=True)
class Ready:
    """Recordings made fit for judging, the plain model's innovations on them, and what was done to them."""

    evidence: Evidence
    samples: tuple[Sample, ...]
    fitter: Fitter
    plain: tuple[Innovations, Innovations]
    notes: tuple[str, ...]


def readings(robot: Robot, fit: Recording, check: Recording | None, workers: Workers) -> tuple[Ready, ...]:
    """The recordings made ready; twice where clocks seem to be apart but more is wrong.

    First as they are then: an effect that explains all of it goes before a clock that explains a part.
    """
    fit, check, short = shortened(fit, check)
    prepared = prepare(robot, fit, check)
    evidence = split(robot, prepared.noise, prepared.fit, prepared.check)
    fitter = Fitter(prepared.noise, workers.between)
    plain = innovations_of(fitter, robot, evidence)
    _require_samples(plain, evidence)

    def ready(evidence: Evidence, plain: tuple[Innovations, Innovations], clocks: tuple[str, ...]) -> Ready:
        samples = (evidence.fit,) if check is None else (evidence.fit, evidence.judge)
        notes = (*short, *prepared.notes, *clocks, *_notes(evidence, samples))
        return Ready(evidence, samples, fitter, plain, notes)

    as_they_are = ready(evidence, plain, ())
    if all_noise(plain, evidence):
        return (as_they_are,)
    evidence, clocks = with_clocks_set(fitter, robot, evidence)
    if not clocks:
        return (as_they_are,)
    plain = innovations_of(fitter, robot, evidence)
    with_clocks = ready(evidence, plain, clocks)
    return (with_clocks,) if all_noise(plain, evidence) else (as_they_are, with_clocks)


def innovations_of(fitter: Fitter, robot: Robot, evidence: Evidence) -> tuple[Innovations, Innovations]:
    """Those of a robot as it is, where models are fitted and where they are judged."""
    return fitter.innovations(robot, evidence.fit), fitter.innovations(robot, evidence.judge)


def all_noise(innovations: Sequence[Innovations], evidence: Evidence) -> bool:
    """Whether nothing but noise is left, where the model was fitted as where it is judged."""
    samples = (evidence.fit, evidence.judge)
    return all(is_noise(found, sample.rows) for found, sample in zip(innovations, samples, strict=True))


def calibrated_fit(ready: Ready, robot: Robot) -> tuple[Robot, Sample]:
    """Robot and FIT with uncertain numbers as FIT has them: what is within their bounds is no component's residual."""
    sample = ready.evidence.fit
    numbers = calibrated(ready.fitter, robot, sample)
    return numbers.robot(robot), replace(sample, recording=numbers.recording(sample.recording))


def _require_samples(innovations: tuple[Innovations, Innovations], evidence: Evidence) -> None:
    for found, sample in zip(innovations, (evidence.fit, evidence.judge), strict=True):
        if not enough_samples(found, sample.rows):
            mend = f"record at least {FEWEST} samples, {2 * FEWEST} where there is no check recording"
            raise RecordingError(sample.recording.path, "too few samples to tell noise from more", mend)


def _notes(evidence: Evidence, samples: tuple[Sample, ...]) -> tuple[str, ...]:
    unknown = tuple(
        f"{s.recording.path}: columns not used: {', '.join(s.recording.unknown_columns)}"
        for s in samples
        if s.recording.unknown_columns
    )
    return (*evidence.notes, *unknown)
