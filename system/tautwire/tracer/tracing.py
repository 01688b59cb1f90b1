"""The whole loop: recording in, residual, the effect behind it, a better robot out, through FMUs both times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from ..cosimulation import Motion, cosimulate
from ..errors import RecordingError
from ..interrupt import interrupts_held
from ..packaging import build_fmus
from ..recording import Recording, require_outputs
from ..robot import Robot
from .adequacy import FEWEST, enough_samples, is_noise
from .clock import with_clocks_set
from .components import cut_at_ports
from .data import Evidence, Sample, split
from .discovery import Discovery
from .fit import Fitter
from .hypotheses import declared_value
from .likelihood import Innovations
from .preparation import prepare
from .release import release_note, released
from .search import Found, search
from .separation import separation
from .unexplained import Rest, what_is_left
from .verdict import Comparison, Errors, Estimate, FoundEffect, Separation, Trace, VerdictName
from .workers import Workers
from .written import formula_text

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

ALPHA = 0.01
ROLES = ("fit", "check")
REACHED = 1.5


def trace(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Progress,
    alpha: float = ALPHA,
    processes: int = 1,
) -> Trace:
    """Find what a robot's model lacks, and show by co-simulating its FMUs what adding it does to the error.

    ``alpha`` bounds the probability of naming an effect where there is none. For more ``processes`` than one the
    calling program's main module has to be guarded, see :class:`tautwire.tracer.workers.Workers`.

    Raises RecordingError where a recording has no measured output, UnreachableError where the cables cannot hold
    the platform where a recording starts.
    """
    with interrupts_held() as raise_interrupt, Workers(processes, raise_interrupt) as workers:
        return _trace(robot, fit, check, progress, alpha, workers)


def _trace(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Progress,
    alpha: float,
    workers: Workers,
) -> Trace:
    began = perf_counter()
    for recording in (fit, check):
        if recording is not None:
            require_outputs(recording)
    prepared = prepare(robot, fit, check)
    evidence = split(robot, prepared.noise, prepared.fit, prepared.check)
    fitter = Fitter(prepared.noise, workers.between)
    plain = _innovations(fitter, robot, evidence)
    _require_samples(plain, evidence)
    clocks: tuple[str, ...] = ()
    if not _all_noise(plain, evidence):
        evidence, clocks = with_clocks_set(fitter, robot, evidence)
        plain = _innovations(fitter, robot, evidence) if clocks else plain
    samples = (evidence.fit,) if check is None else (evidence.fit, evidence.judge)
    running = [workers.start(_cosimulated, released(fitter, robot, sample), sample) for sample in samples]
    ports = workers.start(cut_at_ports, robot, evidence.fit, prepared.noise)
    found = search(robot, fitter, evidence, alpha, progress, workers)
    progress("co-simulating before", 0.0)
    before = [run.result() for run in running]
    explained = _innovations(fitter, found.fit.robot, evidence)
    before_is_noise, after_is_noise = _all_noise(plain, evidence), _all_noise(explained, evidence)
    comparisons, floors = _compared(robot, fitter, samples, before, before)
    kept = bool(found.accepted) and after_is_noise
    progress("co-simulating after", 0.0)
    better = _reaching(found.fit.robot, fitter, samples, before, workers) if kept else None
    kept, rest = better is not None, Rest()
    if not kept and (found.accepted or not before_is_noise):
        rest = what_is_left(robot, found, fitter, evidence, alpha, progress)
        better = _reaching(rest.discovery.robot, fitter, samples, before, workers) if rest.discovery else None
    comparisons, floors = better or (comparisons, floors)
    discovered = rest.discovery if better else None
    final = discovered.robot if discovered else (found.fit.robot if kept else robot)
    verdict, sentence = _verdict(robot, found, kept, before_is_noise, discovered)
    begun = [note for s in samples for note in release_note(released(fitter, final, s), s.recording.path)]
    shown = Separation((), ())
    if kept or verdict == "none":
        progress("what these recordings could show", 0.0)
        shown = separation(found.fit.robot, robot, found.accepted, fitter, evidence.judge, alpha)
    return Trace(
        verdict=verdict,
        sentence=sentence,
        robot_before=robot,
        robot_after=final,
        effects=_effects(robot, found) if kept else (),
        also_possible=found.alike if kept else (),
        candidates=found.candidates,
        formula=formula_text(robot, discovered.formulas) if discovered else None,
        comparisons=comparisons,
        noise_floor=floors[-1],
        noise_before=before_is_noise,
        noise_after=better is not None or before_is_noise,
        left=fitter.innovations(final, evidence.judge).mean_square(evidence.judge.rows),
        separation=shown,
        components=ports.result(),
        resonances=rest.resonances,
        alpha=alpha,
        notes=(*prepared.notes, *clocks, *_notes(evidence, samples), *rest.notes, *begun),
        seconds=perf_counter() - began,
    )


def _reaching(
    after: Robot, fitter: Fitter, samples: Sequence[Sample], before: Sequence[Motion], workers: Workers
) -> tuple[tuple[Comparison, ...], list[Errors]] | None:
    """What the co-simulation of a better robot leaves; None where that is more than noise.

    It has the last word: a filter follows what the model itself would not do.
    """
    running = [workers.start(_cosimulated, released(fitter, after, sample), sample) for sample in samples]
    better, lower = _compared(after, fitter, samples, before, [run.result() for run in running])
    reached = all(_reached(c.errors_after, floor) for c, floor in zip(better, lower, strict=True))
    return (better, lower) if reached else None


def _innovations(fitter: Fitter, robot: Robot, evidence: Evidence) -> tuple[Innovations, Innovations]:
    return fitter.innovations(robot, evidence.fit), fitter.innovations(robot, evidence.judge)


def _require_samples(innovations: tuple[Innovations, Innovations], evidence: Evidence) -> None:
    for found, sample in zip(innovations, (evidence.fit, evidence.judge), strict=True):
        if not enough_samples(found, sample.rows):
            mend = f"record at least {FEWEST} samples, {2 * FEWEST} where there is no check recording"
            raise RecordingError(sample.recording.path, "too few samples to tell noise from more", mend)


def _compared(
    robot: Robot,
    fitter: Fitter,
    samples: Sequence[Sample],
    before: Sequence[Motion],
    after: Sequence[Motion],
) -> tuple[tuple[Comparison, ...], list[Errors]]:
    """Both runs beside each recording, and what noise alone would leave there under the later robot."""
    comparisons = tuple(
        Comparison(role, s.recording, b, a, errors(s.recording, b), errors(s.recording, a))
        for role, s, b, a in zip(ROLES, samples, before, after, strict=False)
    )
    return comparisons, [_floor(fitter, robot, sample) for sample in samples]


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


def _cosimulated(robot: Robot, sample: Sample) -> Motion:
    """The run of a robot placed where a recording starts."""
    with TemporaryDirectory(prefix="tautwire-trace-") as folder:
        fmus = build_fmus(robot.as_modelled(), Path(folder))
        return cosimulate(fmus, sample.recording.time, sample.recording.winch_speed)


def _floor(fitter: Fitter, robot: Robot, sample: Sample) -> Errors:
    """What sensors and the recorded winch speeds' noise alone would leave in a simulation of this recording."""
    variances = fitter.open_loop_variances(robot, sample)
    return _root_mean_squares(np.where(np.isfinite(sample.recording.measured()), variances, np.nan))


def _all_noise(innovations: Sequence[Innovations], evidence: Evidence) -> bool:
    """Whether nothing but noise is left, where the model was fitted as where it is judged."""
    samples = (evidence.fit, evidence.judge)
    return all(is_noise(found, sample.rows) for found, sample in zip(innovations, samples, strict=True))


def _reached(after: Errors, floor: Errors) -> bool:
    """Whether a co-simulation errs by no more than half over what noise alone leaves."""
    pairs = ((after.position_rms, floor.position_rms), (after.tension_rms, floor.tension_rms))
    return all(not error > REACHED * least for error, least in pairs)


def _verdict(
    robot: Robot, found: Found, kept: bool, noise_alone: bool, discovered: Discovery | None
) -> tuple[VerdictName, str]:
    names = " and ".join(h.label(robot) for h in found.accepted)
    if kept:
        return "effects", f"The model lacks {names}; with it, what is left is noise."
    if discovered:
        said = f"No known effect explains the residual; a formula does: {formula_text(robot, discovered.formulas)}."
        return "discovered", f"{said} With it, what is left is noise."
    if not found.accepted and noise_alone:
        return "none", "The residual is noise: this recording shows nothing that the model lacks."
    closest = f"; {names} comes closest but leaves too much" if found.accepted else ""
    return "unexplained", f"The residual is more than noise, and no known effect explains it{closest}."


def _effects(robot: Robot, found: Found) -> tuple[FoundEffect, ...]:
    fit = found.fit
    places = {}
    for index, free in enumerate(fit.free):
        setting = fit.robot.effects[free.setting]
        places[setting.name, setting.cables, free.name] = index
    effects = []
    for hypothesis, evidence in zip(found.accepted, found.evidence, strict=True):
        estimates = {}
        for parameter in hypothesis.parameters:
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
