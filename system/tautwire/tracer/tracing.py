"""The whole loop: recording in, residual, the effect behind it, a better robot out, through FMUs both times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

from threadpoolctl import threadpool_limits

from tautwire_fmu.laws.effects import UNLISTED

from ..interrupt import interrupts_held
from ..model.uncertain import uncertain_numbers
from ..recordings.recording import Recording
from ..robots.robot import Robot
from ..runs.cosimulation import Motion
from .adequacy import largest_autocorrelations
from .asked import require_asked
from .cosimulated import compared, reaching, started
from .discovery.discovery import Discovery
from .discovery.unexplained import Rest, what_is_left
from .discovery.written import effects_text, formula_text
from .estimates import correlations_of, found_effects
from .hypotheses import Hypothesis
from .preparation.calibration import calibrated
from .preparation.release import release_note, released
from .ready import Ready, all_noise, calibrated_fit, innovations_of, readings
from .rivals import with_rivals
from .search import Found, search
from .separation import separation
from .trials import setting_of
from .verdict import Comparison, Errors, Separation, Trace, VerdictName
from .where.components import Components, cut_at_ports
from .workers import Pending, Workers

Progress = Callable[[str, float], None]

ALPHA = 0.01


def trace(
    robot: Robot,
    fit: Recording,
    check: Recording | None = None,
    progress: Progress | None = None,
    alpha: float = ALPHA,
    processes: int = 1,
) -> Trace:
    """Find what a robot's model lacks, and show by co-simulating its FMUs what adding it does to the error.

    What fits ``fit`` is judged on ``check``; without one, on the second half of ``fit``. Of recordings of more than
    100,000 samples (200,000 of the only one) the beginning is traced, and a note says so. ``progress`` gets what is
    being done, and the share of it that is done. ``alpha`` bounds the probability of naming an effect where there is
    none. For more ``processes`` than one the calling program's main module has to be guarded, see
    :class:`tautwire.tracer.workers.Workers`.

    Raises RecordingError where a recording has no measured output, is too short or cannot be this robot's,
    UnreachableError where the cables cannot hold the platform where a recording starts, ArgumentError where an
    argument is none of these.
    """
    require_asked(robot, fit, check, progress, alpha, processes)
    # What threads of BLAS round differently from one, the workers' processes could not repeat.
    with (
        interrupts_held() as raise_interrupt,
        threadpool_limits(1, "blas"),
        Workers(processes, raise_interrupt) as workers,
    ):
        return _trace(robot, fit, check, progress or _silently, alpha, workers)


def _silently(what: str, done: float) -> None:
    """Tells nobody."""


@dataclass(frozen=True)
class _Answer:
    """The effects or the formula that the FMUs, too, bear out; else neither, and what is left.

    ``robot`` is the best model that holds, with uncertain numbers as FIT has them.
    """

    robot: Robot
    found: Found
    effects_hold: bool
    discovered: Discovery | None
    rest: Rest
    comparisons: tuple[Comparison, ...]
    floors: Sequence[Errors]


def _trace(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Progress,
    alpha: float,
    workers: Workers,
) -> Trace:
    began = perf_counter()
    workers.begin()
    searched = _searched(robot, fit, check, progress, alpha, workers)
    ready, found = searched.ready, searched.found
    noise_alone = all_noise(ready.plain, ready.evidence)
    answer = _answer(robot, ready, found, searched.before, noise_alone, alpha, progress, workers)
    final, kept = answer.robot, answer.effects_hold
    verdict, sentence = _verdict(robot, answer, noise_alone)
    numbers = [] if verdict == "unexplained" else _numbers(ready, answer)
    progress("intervals", 0.0)
    effects = found_effects(robot, found, ready.fitter, ready.evidence.fit, workers) if kept else ()
    judge = ready.evidence.judge
    left = ready.fitter.innovations(final, judge)
    shown = Separation((), ())
    if kept or verdict == "none":
        progress("what these recordings could show", 0.0)
        shown = separation(found.fit.robot, robot, found.accepted, ready.fitter, judge, alpha)
    return Trace(
        verdict=verdict,
        sentence=sentence,
        robot_before=robot,
        robot_after=final,
        effects=effects,
        correlations=correlations_of(found.fit, effects),
        also_possible=found.alike if kept else (),
        candidates=found.candidates,
        formula=_formula(robot, answer),
        comparisons=answer.comparisons,
        noise_floor=answer.floors[-1],
        noise_before=noise_alone,
        noise_after=kept or answer.discovered is not None or noise_alone,
        left=left.mean_square(judge.rows),
        autocorrelations=largest_autocorrelations(left, judge.rows),
        separation=shown,
        components=searched.components.result(),
        resonances=answer.rest.resonances,
        alpha=alpha,
        notes=(*ready.notes, *answer.rest.notes, *_begun(ready, final), *numbers),
        seconds=perf_counter() - began,
    )


@dataclass(frozen=True)
class _Searched:
    """What a search found in which recordings, and what went on beside it: runs before, and the cut at the ports."""

    ready: Ready
    found: Found
    before: Sequence[Motion]
    components: Pending[Components]


def _searched(
    robot: Robot, fit: Recording, check: Recording | None, progress: Progress, alpha: float, workers: Workers
) -> _Searched:
    """In the recordings as they are; with clocks set where no effects explain those."""
    ready, *others = readings(robot, fit, check, workers)
    runs, components = _aside(ready, robot, workers)
    found = search(robot, ready.fitter, ready.evidence, alpha, progress, workers)
    if others and not (found.accepted and _leaves_noise(ready, found)):
        ready = others[0]
        runs, components = _aside(ready, robot, workers)
        found = search(robot, ready.fitter, ready.evidence, alpha, progress, workers)
    found = with_rivals(robot, found, ready.fitter, ready.evidence, alpha, progress)
    progress("co-simulating before", 0.0)
    return _Searched(ready, found, [run.result() for run in runs], components)


def _aside(ready: Ready, robot: Robot, workers: Workers) -> tuple[list[Pending[Motion]], Pending[Components]]:
    runs = started(workers, ready.fitter, robot, ready.samples)
    return runs, workers.start(cut_at_ports, *calibrated_fit(ready, robot), ready.fitter.noise)


def _leaves_noise(ready: Ready, found: Found) -> bool:
    return all_noise(innovations_of(ready.fitter, found.fit.robot, ready.evidence), ready.evidence)


def _answer(
    robot: Robot,
    ready: Ready,
    found: Found,
    before: Sequence[Motion],
    noise_alone: bool,
    alpha: float,
    progress: Progress,
    workers: Workers,
) -> _Answer:
    """Effects if they leave noise, to the filter and in the FMUs; else a formula that does."""
    fitter, samples = ready.fitter, ready.samples

    def borne_out(better: Robot) -> tuple[Robot, tuple[Comparison, ...], Sequence[Errors]] | None:
        after = calibrated(fitter, better, ready.evidence.fit).robot(better)
        reached = reaching(after, fitter, samples, before, workers)
        return None if reached is None else (after, *reached)

    plain = robot, *compared(robot, fitter, samples, before, before)
    progress("co-simulating after", 0.0)
    if found.accepted and _leaves_noise(ready, found):
        better = borne_out(found.fit.robot)
        if better is not None:
            return _answered(better, found, True, None, Rest())
    if not found.accepted and noise_alone:
        better = borne_out(robot) if uncertain_numbers(robot) else None
        return _answered(better or plain, found, False, None, Rest())
    rest = what_is_left(robot, found, fitter, ready.evidence, alpha, progress, workers)
    better = borne_out(rest.discovery.robot) if rest.discovery else None
    return _answered(better or plain, found, False, rest.discovery if better else None, rest)


def _answered(
    shown: tuple[Robot, tuple[Comparison, ...], Sequence[Errors]],
    found: Found,
    effects_hold: bool,
    discovered: Discovery | None,
    rest: Rest,
) -> _Answer:
    robot, comparisons, floors = shown
    return _Answer(robot, found, effects_hold, discovered, rest, comparisons, floors)


def _numbers(ready: Ready, answer: _Answer) -> list[str]:
    """What the recordings say of declared numbers that the robot file calls uncertain."""
    best = answer.found.fit.robot if answer.discovered is None else answer.discovered.robot
    return [
        note
        for sample in ready.samples
        for note in calibrated(ready.fitter, best, sample).notes(best, sample.recording.path)
    ]


def _begun(ready: Ready, final: Robot) -> list[str]:
    """What the last model says of how fast each recording begins."""
    starts = [(released(ready.fitter, final, sample), sample.recording.path) for sample in ready.samples]
    return [note for start, path in starts for note in release_note(start, path)]


def _verdict(robot: Robot, answer: _Answer, noise_alone: bool) -> tuple[VerdictName, str]:
    found, discovered = answer.found, answer.discovered
    names = " and ".join(h.label(robot) for h in found.accepted)
    if answer.effects_hold and _unlisted(answer):
        said = f"The model lacks {names}; with it, what is left is noise."
        return "discovered", f"{said} No kind of the list does it: {_formula(robot, answer)}."
    if answer.effects_hold:
        return "effects", f"The model lacks {names}; with it, what is left is noise."
    if discovered:
        said = f"No known effect explains the residual; a formula does: {formula_text(robot, discovered.formulas)}."
        return "discovered", f"{said} With it, what is left is noise."
    if not found.accepted and noise_alone:
        return "none", "The residual is noise: this recording shows nothing that the model lacks."
    closest = f"; {names} comes closest but leaves too much" if found.accepted else ""
    return "unexplained", f"The residual is more than noise, and no known effect explains it{closest}."


def _unlisted(answer: _Answer) -> list[Hypothesis]:
    """Accepted effects that are no kind of the list."""
    return [hypothesis for hypothesis in answer.found.accepted if hypothesis.effect in UNLISTED]


def _formula(robot: Robot, answer: _Answer) -> str | None:
    """Of what is no kind of the list; None where there is nothing such."""
    if answer.discovered:
        return formula_text(robot, answer.discovered.formulas)
    unlisted = _unlisted(answer) if answer.effects_hold else []
    return effects_text([(h.label(robot), setting_of(answer.found.fit.robot, h)) for h in unlisted]) or None
