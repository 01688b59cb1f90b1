"""Identification of what a robot's model lacks: from recordings to a better robot, through FMUs both times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

from threadpoolctl import threadpool_limits

from tautwire_fmu.laws.effects import UNLISTED

from ..cosimulation.robot_cosimulation import CosimulationResult
from ..errors import ArgumentError
from ..process_signals import defer_interrupts
from ..recordings.recording import Recording, require_outputs
from ..robot.schema import Robot, validate_robot
from ..robot.uncertain_parameters import uncertain_parameters
from ..validation import NumberRule, validate_callable, validate_instance, validate_integer, validate_number
from .candidate_scores import setting_of
from .confusable_models import replace_by_confusable_models
from .cosimulation_validation import compare_cosimulations, start_cosimulations, validate_by_cosimulation
from .discovery.candidate_terms import effects_text, formula_text
from .discovery.formula_discovery import Discovery
from .discovery.unexplained_residual import UnexplainedResidual, explain_residual
from .effect_estimates import estimated_effects, parameter_correlations
from .hypotheses import Hypothesis
from .identifiability import analyse_identifiability
from .localisation.component_localisation import FaultLocalisation, localise_residual
from .preprocessing import PreparedData, all_residuals_white, calibrated_estimation_data, innovations_of, prepare_data
from .residual_analysis import largest_autocorrelations
from .smoothed_states import calibrate, initial_state_note, with_initial_state
from .stepwise_selection import SelectionResult, select_effects
from .trace_result import Comparison, Errors, Identifiability, Trace, Verdict
from .worker_pool import PendingResult, WorkerPool

FALSE_ALARM_RATE_RULE = NumberRule("a rate of false alarms below 1, such as 0.01", "", positive=True)


def validate_trace_arguments(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Callable[[str, float], None] | None,
    alpha: float,
    processes: int,
) -> None:
    """Validate the arguments of a trace.

    Raises RecordingError where a recording has no measured output, ArgumentError for all else.
    """
    validate_robot("trace: robot", robot)
    validate_callable("trace: progress", progress)
    validated_false_alarm_rate("trace: alpha", alpha)
    validate_integer("trace: processes", processes, 1, "give how many processes may work at a time")
    recordings = {"fit": fit} | ({} if check is None else {"check": check})
    for name, recording in recordings.items():
        argument = f"trace: {name}"
        validate_instance(argument, recording, Recording, "give what read_recording returns")
        if recording.cable_count != robot.cable_count:
            problem = f"has winch speeds of {recording.cable_count} cables, the robot has {robot.cable_count}"
            raise ArgumentError(argument, recording, problem, "give robot and recording that belong together")
        require_outputs(recording)


def validated_false_alarm_rate(argument: str, value: object) -> float:
    """The false-alarm rate, above 0 and below 1; raises ArgumentError."""
    rate = validate_number(argument, value, FALSE_ALARM_RATE_RULE)
    if rate >= 1.0:
        raise ArgumentError(argument, value, f"is {rate!r}, must be below 1", FALSE_ALARM_RATE_RULE.hint())
    return rate


Progress = Callable[[str, float], None]

SIGNIFICANCE_LEVEL = 0.01
IS_WHITE = "the residual is white noise"


def trace(
    robot: Robot,
    fit: Recording,
    check: Recording | None = None,
    progress: Progress | None = None,
    alpha: float = SIGNIFICANCE_LEVEL,
    processes: int = 1,
) -> Trace:
    """Identify what a robot's model lacks, and show by co-simulating its FMUs what adding it does to the error.

    What fits ``fit`` is judged on ``check``; without one, on the second half of ``fit``. Of recordings of more than
    100,000 samples (200,000 of the only one) the beginning is traced, and a note says so. ``progress`` gets what is
    being done, and the share of it that is done. ``alpha`` bounds the probability of naming an effect where there is
    none. For more ``processes`` than one the calling program's main module has to be guarded, see
    :class:`tautwire.estimation.worker_pool.WorkerPool`.

    Raises RecordingError where a recording has no measured output, is too short or cannot be this robot's,
    UnreachableError where the cables cannot hold the platform where a recording starts, ArgumentError where an
    argument is none of these.
    """
    validate_trace_arguments(robot, fit, check, progress, alpha, processes)
    # BLAS rounds differently with several threads, which the worker processes could not reproduce.
    with (
        defer_interrupts() as raise_interrupt,
        threadpool_limits(1, "blas"),
        WorkerPool(processes, raise_interrupt) as workers,
    ):
        return _trace(robot, fit, check, progress or _no_progress, alpha, workers)


def _no_progress(label: str, share: float) -> None:
    """Discards the progress."""


@dataclass(frozen=True)
class _Outcome:
    """Outcome of an identification: the effects or the formula that the FMUs confirm; else the unexplained residual.

    ``robot`` is the best validated model, with uncertain numbers as FIT has them.
    """

    robot: Robot
    selection: SelectionResult
    effects_hold: bool
    discovery: Discovery | None
    unexplained: UnexplainedResidual
    comparisons: tuple[Comparison, ...]
    noise_floors: Sequence[Errors]


def _trace(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Progress,
    alpha: float,
    workers: WorkerPool,
) -> Trace:
    start_time = perf_counter()
    workers.warm_up()
    selected = _select(robot, fit, check, progress, alpha, workers)
    prepared, selection = selected.prepared, selected.selection
    white_before = all_residuals_white(prepared.innovations, prepared.split)
    outcome = _outcome(robot, prepared, selection, selected.runs_before, white_before, alpha, progress, workers)
    final, effects_hold = outcome.robot, outcome.effects_hold
    verdict, sentence = _verdict(robot, outcome, white_before)
    calibration_notes = [] if verdict == "unexplained" else _calibration_notes(prepared, outcome)
    progress("intervals", 0.0)
    effects = (
        estimated_effects(robot, selection, prepared.fitter, prepared.split.estimation, workers) if effects_hold else ()
    )
    validation = prepared.split.validation
    innovations = prepared.fitter.innovations(final, validation)
    identifiability = Identifiability((), ())
    if effects_hold or verdict == "none":
        progress("what these recordings could show", 0.0)
        identifiability = analyse_identifiability(
            selection.fit.robot, robot, selection.accepted, prepared.fitter, validation, alpha
        )
    return Trace(
        verdict=verdict,
        sentence=sentence,
        robot_before=robot,
        robot_after=final,
        effects=effects,
        correlations=parameter_correlations(selection.fit, effects),
        also_possible=selection.confusable if effects_hold else (),
        candidates=selection.candidates,
        formula=_formula(robot, outcome),
        comparisons=outcome.comparisons,
        noise_floor=outcome.noise_floors[-1],
        noise_before=white_before,
        noise_after=effects_hold or outcome.discovery is not None or white_before,
        normalised_innovation_variance=innovations.mean_square(validation.rows),
        autocorrelations=largest_autocorrelations(innovations, validation.rows),
        identifiability=identifiability,
        components=selected.components.result(),
        resonances=outcome.unexplained.resonances,
        alpha=alpha,
        notes=(*prepared.notes, *outcome.unexplained.notes, *_release_notes(prepared, final), *calibration_notes),
        seconds=perf_counter() - start_time,
    )


@dataclass(frozen=True)
class _Selected:
    """Result of the selection with its data, the co-simulations before, and the component residuals."""

    prepared: PreparedData
    selection: SelectionResult
    runs_before: Sequence[CosimulationResult]
    components: PendingResult[FaultLocalisation]


def _select(
    robot: Robot, fit: Recording, check: Recording | None, progress: Progress, alpha: float, workers: WorkerPool
) -> _Selected:
    """Select effects in the recordings as they are; with clocks corrected where no effects explain those."""
    prepared, *others = prepare_data(robot, fit, check, workers)
    runs, components = _start_side_runs(prepared, robot, workers)
    selection = select_effects(robot, prepared.fitter, prepared.split, alpha, progress, workers)
    if others and not (selection.accepted and _leaves_white_residuals(prepared, selection)):
        prepared = others[0]
        runs, components = _start_side_runs(prepared, robot, workers)
        selection = select_effects(robot, prepared.fitter, prepared.split, alpha, progress, workers)
    selection = replace_by_confusable_models(robot, selection, prepared.fitter, prepared.split, alpha, progress)
    progress("co-simulating before", 0.0)
    return _Selected(prepared, selection, [run.result() for run in runs], components)


def _start_side_runs(
    prepared: PreparedData, robot: Robot, workers: WorkerPool
) -> tuple[list[PendingResult[CosimulationResult]], PendingResult[FaultLocalisation]]:
    runs = start_cosimulations(workers, prepared.fitter, robot, prepared.data_sets)
    return runs, workers.submit(localise_residual, *calibrated_estimation_data(prepared, robot), prepared.fitter.noise)


def _leaves_white_residuals(prepared: PreparedData, selection: SelectionResult) -> bool:
    return all_residuals_white(innovations_of(prepared.fitter, selection.fit.robot, prepared.split), prepared.split)


def _outcome(
    robot: Robot,
    prepared: PreparedData,
    selection: SelectionResult,
    runs_before: Sequence[CosimulationResult],
    white_before: bool,
    alpha: float,
    progress: Progress,
    workers: WorkerPool,
) -> _Outcome:
    """The effects if they leave white noise, in the filter and in the FMUs; else a formula that does."""
    fitter, data_sets = prepared.fitter, prepared.data_sets

    def validated(candidate: Robot) -> tuple[Robot, tuple[Comparison, ...], Sequence[Errors]] | None:
        calibrated_robot = calibrate(fitter, candidate, prepared.split.estimation).calibrated_robot(candidate)
        validation = validate_by_cosimulation(calibrated_robot, fitter, data_sets, runs_before, workers)
        return None if validation is None else (calibrated_robot, *validation)

    unchanged = robot, *compare_cosimulations(robot, fitter, data_sets, runs_before, runs_before)
    progress("co-simulating after", 0.0)
    if selection.accepted and _leaves_white_residuals(prepared, selection):
        improved = validated(selection.fit.robot)
        if improved is not None:
            return _outcome_of(improved, selection, True, None, UnexplainedResidual())
    if not selection.accepted and white_before:
        improved = validated(robot) if uncertain_parameters(robot) else None
        return _outcome_of(improved or unchanged, selection, False, None, UnexplainedResidual())
    unexplained = explain_residual(robot, selection, fitter, prepared.split, alpha, progress, workers)
    improved = validated(unexplained.discovery.robot) if unexplained.discovery else None
    return _outcome_of(
        improved or unchanged, selection, False, unexplained.discovery if improved else None, unexplained
    )


def _outcome_of(
    validated: tuple[Robot, tuple[Comparison, ...], Sequence[Errors]],
    selection: SelectionResult,
    effects_hold: bool,
    discovery: Discovery | None,
    unexplained: UnexplainedResidual,
) -> _Outcome:
    robot, comparisons, noise_floors = validated
    return _Outcome(robot, selection, effects_hold, discovery, unexplained, comparisons, noise_floors)


def _calibration_notes(prepared: PreparedData, outcome: _Outcome) -> list[str]:
    """Notes on declared numbers that the robot file calls uncertain, as the recordings have them."""
    final_robot = outcome.selection.fit.robot if outcome.discovery is None else outcome.discovery.robot
    return [
        note
        for sample in prepared.data_sets
        for note in calibrate(prepared.fitter, final_robot, sample).notes(final_robot, sample.recording.path)
    ]


def _release_notes(prepared: PreparedData, final: Robot) -> list[str]:
    """Notes on the smoothed initial state of each recording under the final model."""
    starts = [
        (with_initial_state(prepared.fitter, final, sample), sample.recording.path) for sample in prepared.data_sets
    ]
    return [note for start, path in starts for note in initial_state_note(start, path)]


def _verdict(robot: Robot, outcome: _Outcome, white_before: bool) -> tuple[Verdict, str]:
    selection, discovery = outcome.selection, outcome.discovery
    names = " and ".join(h.label(robot) for h in selection.accepted)
    lacks = f"The model lacks {names}; with {'it' if len(selection.accepted) == 1 else 'them'}, {IS_WHITE}."
    if outcome.effects_hold and _unlisted_hypotheses(outcome):
        return "discovered", f"{lacks} This effect is not on the list of known ones: {_formula(robot, outcome)}."
    if outcome.effects_hold:
        return "effects", lacks
    if discovery:
        sentence = f"No known effect explains the residual; a formula does: {formula_text(robot, discovery.formulas)}."
        return "discovered", f"{sentence} With it, {IS_WHITE}."
    if not selection.accepted and white_before:
        return "none", f"{IS_WHITE.capitalize()}: this recording shows nothing that the model lacks."
    closest = f"; {names} comes closest but does not make it white" if selection.accepted else ""
    return "unexplained", f"The residual is not white noise, and no known effect explains it{closest}."


def _unlisted_hypotheses(outcome: _Outcome) -> list[Hypothesis]:
    """Accepted effects that are not on the list."""
    return [hypothesis for hypothesis in outcome.selection.accepted if hypothesis.effect in UNLISTED]


def _formula(robot: Robot, outcome: _Outcome) -> str | None:
    """Formula of what is not on the list; None where there is none."""
    if outcome.discovery:
        return formula_text(robot, outcome.discovery.formulas)
    unlisted = _unlisted_hypotheses(outcome) if outcome.effects_hold else []
    return effects_text([(h.label(robot), setting_of(outcome.selection.fit.robot, h)) for h in unlisted]) or None
