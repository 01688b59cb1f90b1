"""The whole loop: recording in, residual, the effect behind it, a better robot out, through FMUs both times."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import BY_NAME

from ..cosimulation import Motion, cosimulate
from ..packaging import build_fmus
from ..recording import Recording, require_outputs
from ..robot import Robot
from .adequacy import is_noise
from .data import Evidence, Sample, placed, split
from .fit import Fitter
from .hypotheses import declared_value
from .noise import noise_of
from .search import Found, search
from .verdict import Comparison, Errors, Estimate, FoundEffect, Trace, VerdictName

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

ALPHA = 0.01
ROLES = ("fit", "check")


def trace(robot: Robot, fit: Recording, check: Recording | None, progress: Progress, alpha: float = ALPHA) -> Trace:
    """Find what a robot's model lacks, and show by co-simulating its FMUs what adding it does to the error.

    ``alpha`` bounds the probability of naming an effect where there is none.

    Raises RecordingError where a recording has no measured output, UnreachableError where the cables cannot hold
    the platform where a recording starts.
    """
    began = perf_counter()
    for recording in (fit, check):
        if recording is not None:
            require_outputs(recording)
    noise = noise_of(robot, fit)
    evidence = split(robot, noise, fit, check)
    samples = (evidence.fit,) if check is None else (evidence.fit, evidence.judge)
    before = [_cosimulated(robot, s, f"before, {r}", progress) for s, r in zip(samples, ROLES, strict=False)]
    fitter = Fitter(noise)
    judge = evidence.judge
    plain = fitter.innovations(robot, judge)
    found = search(robot, fitter, evidence, alpha, progress)
    explained = fitter.innovations(found.fit.robot, judge)
    enough = is_noise(explained, judge.rows)
    verdict, sentence = _verdict(robot, found, enough, is_noise(plain, judge.rows))
    kept = verdict == "effects"
    after_robot = found.fit.robot if kept else robot
    after = (
        [_cosimulated(after_robot, s, f"after, {r}", progress) for s, r in zip(samples, ROLES, strict=False)]
        if kept
        else before
    )
    comparisons = tuple(
        Comparison(role, s.recording, b, a, errors(s.recording, b), errors(s.recording, a))
        for role, s, b, a in zip(ROLES, samples, before, after, strict=False)
    )
    left = (explained if kept else plain).mean_square(judge.rows)
    return Trace(
        verdict=verdict,
        sentence=sentence,
        robot_before=robot,
        robot_after=after_robot,
        effects=_effects(robot, found) if kept else (),
        also_possible=found.alike if kept else (),
        candidates=found.candidates,
        formula=None,
        comparisons=comparisons,
        noise_floor=_floor(fitter, after_robot, samples[-1]),
        noise_before=is_noise(plain, judge.rows),
        noise_after=enough if kept else is_noise(plain, judge.rows),
        left=left,
        alpha=alpha,
        notes=_notes(evidence, samples),
        seconds=perf_counter() - began,
    )


def errors(recording: Recording, motion: Motion) -> Errors:
    """Root mean squares of measured less co-simulated."""
    return _root_mean_squares((recording.measured() - motion.measured()) ** 2)


def _root_mean_squares(squares: Array) -> Errors:
    return Errors(
        position_rms=_root_mean(squares[:, :3]),
        tension_rms=_root_mean(squares[:, 3:]),
        axes=np.array([_root_mean(column) for column in squares[:, :3].T]),
        cables=np.array([_root_mean(column) for column in squares[:, 3:].T]),
    )


def _root_mean(squares: Array) -> float:
    seen = squares[np.isfinite(squares)]
    return float(np.sqrt(np.mean(seen))) if seen.size else float("nan")


def _cosimulated(robot: Robot, sample: Sample, what: str, progress: Progress) -> Motion:
    here = placed(robot, sample.start)
    recording = sample.recording
    with TemporaryDirectory(prefix="tautwire-trace-") as folder:
        fmus = build_fmus(here, Path(folder))
        return cosimulate(
            fmus,
            recording.time,
            recording.winch_speed,
            progress=lambda done: progress(f"co-simulating {what}", done),
        )


def _floor(fitter: Fitter, robot: Robot, sample: Sample) -> Errors:
    """What sensors and the recorded winch speeds' noise alone would leave in a simulation of this recording."""
    variances = fitter.open_loop_variances(robot, sample)
    return _root_mean_squares(np.where(np.isfinite(sample.recording.measured()), variances, np.nan))


def _verdict(robot: Robot, found: Found, enough: bool, noise_alone: bool) -> tuple[VerdictName, str]:
    names = " and ".join(h.label(robot) for h in found.accepted)
    if found.accepted and enough:
        return "effects", f"The model lacks {names}; with it, what is left is noise."
    if not found.accepted and noise_alone:
        return "none", "The residual is noise: this recording shows nothing that the model lacks."
    closest = f"; {names} comes closest but leaves too much" if found.accepted else ""
    return "unexplained", f"The residual is more than noise, and no known effect explains it{closest}."


def _effects(robot: Robot, found: Found) -> tuple[FoundEffect, ...]:
    fit = found.fit
    places = {}
    index = 0
    for setting in fit.robot.effects:
        for parameter in BY_NAME[setting.name].parameters:
            places[setting.name, setting.cables, parameter.name] = index
            index += 1
    effects = []
    for hypothesis, evidence in zip(found.accepted, found.evidence, strict=True):
        estimates = {}
        for parameter in hypothesis.effect.parameters:
            place = places[hypothesis.effect.name, hypothesis.cables, parameter.name]
            low, high = fit.interval(place)
            declared = declared_value(robot, parameter, hypothesis.cables)
            estimates[parameter.name] = Estimate(float(fit.values[place]), parameter.unit, low, high, declared)
        effects.append(
            FoundEffect(hypothesis.effect.name, hypothesis.effect.component, hypothesis.cables, estimates, evidence)
        )
    return tuple(effects)


def _notes(evidence: Evidence, samples: tuple[Sample, ...]) -> tuple[str, ...]:
    unknown = tuple(
        f"{s.recording.path}: columns not used: {', '.join(s.recording.unknown_columns)}"
        for s in samples
        if s.recording.unknown_columns
    )
    return (*evidence.notes, *unknown)
