"""Identification of what a robot's model lacks: from recordings to a better robot, through FMUs both times."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from operator import attrgetter

import numpy as np
from threadpoolctl import threadpool_limits

from ..errors import ArgumentError, NumericalError
from ..process_signals import defer_interrupts
from ..recordings.recording import Recording, require_outputs
from ..robot.schema import Robot, validate_robot
from ..robot.uncertain_parameters import uncertain_parameters
from ..validation import NumberRule, validate_callable, validate_instance, validate_integer, validate_number
from .confusable_models import replace_by_confusable_models
from .cosimulation_validation import (
    compare_cosimulations,
    start_cosimulations,
    validate_by_cosimulation,
)
from .declared_start import with_declared_start
from .discovery.unexplained_residual import explain_residual
from .effect_estimates import effects_by_size, estimated_effects, parameter_correlations
from .explained_shares import ExplainedShares, explained_shares, remaining_error, sensor_noise_floor
from .identifiability import analyse_identifiability
from .identification_context import IdentificationContext, Progress, no_progress
from .identification_state import Identification
from .localisation.component_localisation import localise_residual
from .localisation.component_residuals import FaultLocalisation
from .parameter_fit import Fitter
from .policy import DEFAULT_POLICY, IdentificationPolicy, TimeLimitPolicy
from .preprocessing import calibrated_estimation_data, prepare_data
from .residual_analysis import largest_autocorrelations
from .smoothed_states import calibrate, initial_state_note, with_initial_state
from .stepwise_selection import nothing_selected, select_effects
from .time_limit import OutOfTimeError, TimeLimit
from .trace_result import Trace
from .verdict import confirmed_formula, verdict_beside_disturbance, verdict_of, verdict_of_ended_search
from .worker_pool import WorkerPool

FALSE_ALARM_RATE_RULE = NumberRule("a false-alarm rate below 1, such as 0.01", "", positive=True)


def validate_trace_arguments(
    robot: Robot,
    fit: Recording,
    check: Recording | None,
    progress: Progress | None,
    alpha: float,
    processes: int,
) -> None:
    """Validate the arguments of a trace.

    Raises RecordingError where a recording has no measured output, ArgumentError for all else.
    """
    validate_robot("trace: robot", robot)
    validate_callable("trace: progress", progress)
    validated_false_alarm_rate("trace: alpha", alpha)
    validate_integer("trace: processes", processes, 1, "give the number of worker processes")
    recordings = {"fit": fit} | ({} if check is None else {"check": check})
    for name, recording in recordings.items():
        argument = f"trace: {name}"
        validate_instance(argument, recording, Recording, "give what read_recording returns")
        if recording.cable_count != robot.cable_count:
            problem = f"has winch speeds of {recording.cable_count} cables, the robot has {robot.cable_count}"
            raise ArgumentError(argument, recording, problem, "give a recording of this robot")
        require_outputs(recording)


def validated_false_alarm_rate(argument: str, value: object) -> float:
    """The false-alarm rate, above 0 and below 1; raises ArgumentError."""
    rate = validate_number(argument, value, FALSE_ALARM_RATE_RULE)
    if rate >= 1.0:
        raise ArgumentError(argument, value, f"is {rate!r}, must be below 1", FALSE_ALARM_RATE_RULE.hint())
    return rate


def start_side_runs(state: Identification) -> Identification:
    """Co-simulate the declared robot, and localise its error in a component, beside all that follows."""
    context, prepared = state.context, state.prepared
    runs = start_cosimulations(context.workers, context.fitter, context.robot, prepared.data_sets)
    robot, data = calibrated_estimation_data(prepared, context.robot)
    localisation = context.workers.submit(
        localise_residual, robot, data, context.fitter.noise, context.policy.localisation
    )
    return replace(state, pending_runs=tuple(runs), pending_localisation=(localisation,))


def select(state: Identification) -> Identification:
    """Select effects in the recordings as they are."""
    state = replace(state, selection=select_effects(state.context))
    if state.selection.disturbance:
        fitter = state.context.fitter.with_disturbance(state.selection.disturbance)
        state = replace(state, context=replace(state.context, fitter=fitter))
    return state


def select_with_clocks_corrected(state: Identification) -> Identification:
    """Select effects in the recordings with their clocks corrected, where none explain them as recorded."""
    for prepared in state.clock_corrected:
        if not state.selection_explains:
            state.context.time_limit.check()
            context = replace(state.context, fitter=prepared.fitter, split=prepared.split)
            state = start_side_runs(replace(state, context=context, prepared=prepared))
            state = replace(state, selection=select_effects(context))
    return state


def try_confusable_models(state: Identification) -> Identification:
    """Replace the selection by a model that is easily confused with it, where that explains more.

    Not beside a disturbance, which would make up for the form of any of them.
    """
    if state.context.fitter.has_disturbance:
        return state
    return replace(state, selection=replace_by_confusable_models(state.context, state.selection))


def try_declared_start(state: Identification) -> Identification:
    """Replace the selection by a sensor offset that explains as much of recordings that seem to start elsewhere."""
    context, selection = with_declared_start(state.context, state.selection)
    if selection is state.selection:
        return state
    split = context.split
    data_sets = (split.estimation, split.validation)[: len(state.prepared.data_sets)]
    prepared = replace(state.prepared, split=split, data_sets=data_sets)
    return replace(state, context=context, prepared=prepared, selection=selection)


def cosimulate_before(state: Identification) -> Identification:
    """Compare the declared robot's co-simulations with the recordings."""
    context = state.context
    context.progress("co-simulating before", 0.0)
    runs = tuple(run.result() for run in state.pending_runs)
    comparisons, floors = compare_cosimulations(context.robot, context.fitter, state.prepared.data_sets, runs, runs)
    return replace(state, runs_before=runs, comparisons=comparisons, noise_floors=tuple(floors))


def confirm_effects(state: Identification) -> Identification:
    """Confirm by co-simulation the effects that leave white noise, or the calibrated robot where nothing is lacking."""
    robot = state.context.robot
    state.context.progress("co-simulating after", 0.0)
    if state.context.fitter.has_disturbance:
        return _explained_beside_disturbance(state)
    if state.selection_explains:
        confirmed = _confirmed(state, state.selection.fit.robot)
        return state if confirmed is None else replace(confirmed, effects_hold=True)
    if _nothing_lacks(state) and uncertain_parameters(robot):
        return _confirmed(state, robot) or state
    return state


def explain_by_formula(state: Identification) -> Identification:
    """Look for a formula, confirmed by co-simulation, or resonances, where effects do not explain the residual."""
    if state.effects_hold or _nothing_lacks(state) or state.shares:
        return state
    unexplained = explain_residual(state.context, state.selection)
    state = replace(state, unexplained=unexplained)
    confirmed = _confirmed(state, unexplained.discovery.robot) if unexplained.discovery else None
    return state if confirmed is None else replace(confirmed, discovery=unexplained.discovery)


def judge(state: Identification) -> Identification:
    """Put the verdict in words."""
    if state.shares:
        return _judged_beside_disturbance(state, state.shares)
    verdict = verdict_of(
        state.context.robot, state.selection, state.effects_hold, state.discovery, state.is_white_before
    )
    return replace(state, verdict=verdict_of_ended_search(verdict, state.context.time_limit))


def estimate_intervals(state: Identification) -> Identification:
    """Estimate the confirmed effects' parameters with intervals."""
    state.context.progress("intervals", 0.0)
    if not state.effects_hold and not (state.shares and state.selection.accepted):
        return state
    effects = estimated_effects(state.context, state.selection)
    if state.shares is None:
        return replace(state, effects=effects)
    large, small = effects_by_size(effects, state.shares, state.context.policy.size)
    if not state.effects_hold:
        large, small = (), (*large, *small)
    return replace(state, effects=large, small_effects=small)


def analyse_detectability(state: Identification) -> Identification:
    """Tell what the recordings could have shown, where the model leaves white noise."""
    if not (state.effects_hold or state.verdict[0] == "none"):
        return state
    state.context.progress("identifiability", 0.0)
    selection = state.selection
    return replace(
        state, identifiability=analyse_identifiability(state.context, selection.fit.robot, selection.accepted)
    )


STAGES: tuple[Callable[[Identification], Identification], ...] = (
    start_side_runs,
    select,
    select_with_clocks_corrected,
    try_confusable_models,
    try_declared_start,
    cosimulate_before,
    confirm_effects,
    explain_by_formula,
    judge,
    estimate_intervals,
    analyse_detectability,
)

# Stages that are searches, with what is left untried where one has no time left.
SEARCHES: Mapping[Callable[[Identification], Identification], tuple[Callable[[TimeLimitPolicy], float], str]] = {
    select: (attrgetter("selection"), "effects"),
    select_with_clocks_corrected: (attrgetter("selection"), "correcting clocks that seem to be apart"),
    try_confusable_models: (attrgetter("selection"), "models that are easily confused with the effects found"),
    try_declared_start: (attrgetter("selection"), "trying a sensor's offset in place of another start"),
    explain_by_formula: (attrgetter("discovery"), "formulas and resonances"),
    estimate_intervals: (attrgetter("refinement"), "estimates of the parameters"),
    analyse_detectability: (attrgetter("refinement"), "telling what the recordings could have shown"),
}


def policy_within(seconds: float, policy: IdentificationPolicy = DEFAULT_POLICY) -> IdentificationPolicy:
    """The policy with as many samples as a time limit (s) allows."""
    limits = policy.time_limit
    count = int(min(policy.preprocessing.max_samples, max(limits.min_samples, limits.samples_per_second * seconds)))
    return replace(policy, preprocessing=replace(policy.preprocessing, max_samples=count))


@contextmanager
def limited_search(stage: Callable[[Identification], Identification], context: IdentificationContext) -> Iterator[None]:
    """Context manager for a stage; a search that is out of time ends, and what it leaves untried is told."""
    if stage not in SEARCHES:
        yield
        return
    share_of, untried = SEARCHES[stage]
    try:
        with context.time_limit.searching(share_of(context.policy.time_limit)):
            yield
    except OutOfTimeError:
        context.leave_untried(untried)


def trace(
    robot: Robot,
    fit: Recording,
    check: Recording | None = None,
    progress: Progress | None = None,
    alpha: float = DEFAULT_POLICY.selection.false_alarm_rate,
    processes: int = 1,
    time_limit: TimeLimit | None = None,
) -> Trace:
    """Identify what a robot's model lacks, and show by co-simulating its FMUs what adding it does to the error.

    What fits ``fit`` is judged on ``check``; without one, on the second half of ``fit``. Of recordings of more than
    100,000 samples (200,000 of the only one) the beginning is traced, and a note says so; of fewer where ``time_limit``
    is short. Searches end within it, by default ten minutes, and ``untried`` of the result tells what they left.
    ``progress`` gets what is being done, and the share of it that is done. ``alpha`` bounds the probability of naming
    an effect where there is none. For more ``processes`` than one the calling program's main module has to be guarded,
    see :class:`tautwire.estimation.worker_pool.WorkerPool`.

    Raises RecordingError where a recording has no measured output, is too short or cannot be this robot's,
    UnreachableError where the cables cannot hold the platform where a recording starts, NumericalError where the model
    has no finite numbers, ArgumentError where an argument is none of these.
    """
    validate_trace_arguments(robot, fit, check, progress, alpha, processes)
    limit = time_limit or TimeLimit()
    # BLAS rounds differently with several threads, which the worker processes could not reproduce.
    with (
        _numerical_errors_raised(),
        defer_interrupts() as raise_interrupt,
        threadpool_limits(1, "blas"),
        WorkerPool(processes, _calling(raise_interrupt, limit.check)) as workers,
    ):
        workers.warm_up()

        policy = policy_within(limit.seconds)
        prepared, *clock_corrected = prepare_data(robot, fit, check, workers, policy)
        context = IdentificationContext(
            robot, prepared.fitter, prepared.split, alpha, progress or no_progress, workers, policy, limit
        )
        state = Identification(context, prepared, tuple(clock_corrected), nothing_selected(robot), robot)
        for stage in STAGES:
            with limited_search(stage, state.context):
                state = stage(state)
        return _result(state)


@contextmanager
def _numerical_errors_raised() -> Iterator[None]:
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise NumericalError(str(error)) from error


def _calling(*functions: Callable[[], None]) -> Callable[[], None]:
    """A function that calls some functions in turn."""

    def call_all() -> None:
        for function in functions:
            function()

    return call_all


def _explained_beside_disturbance(state: Identification) -> Identification:
    """The state with the shares of the selected effects, and what the robot with them leaves in co-simulation."""
    context, selection = state.context, state.selection
    identified = calibrate(context.fitter, selection.fit.robot, context.split.estimation).calibrated_robot(
        selection.fit.robot
    )
    state = _with_final_robot(state, context.fitter, identified)
    data, after = state.prepared.data_sets[-1], state.comparisons[-1]
    shares = explained_shares(context, state.prepared.fitter, identified, selection.accepted, data, after)
    return replace(state, shares=shares)


def _with_final_robot(state: Identification, fitter: Fitter, robot: Robot) -> Identification:
    """The state with a robot as the final one, and what its co-simulations leave, near noise or not."""
    context, data_sets = state.context, state.prepared.data_sets
    runs = [run.result() for run in start_cosimulations(context.workers, fitter, robot, data_sets)]
    comparisons, _ = compare_cosimulations(robot, fitter, data_sets, state.runs_before, runs)
    floors = tuple(sensor_noise_floor(fitter, robot, data) for data in data_sets)
    return replace(state, final_robot=robot, comparisons=comparisons, noise_floors=floors)


def _judged_beside_disturbance(state: Identification, shares: ExplainedShares) -> Identification:
    """The state with its verdict; without an effect that matters, with the declared robot as the final one."""
    context, declared = state.context, state.prepared.fitter
    remaining = remaining_error(state.comparisons[-1].recording, state.comparisons[-1].after, state.noise_floors[-1])
    verdict = verdict_beside_disturbance(context, state.selection.accepted, shares, remaining.sentence)
    verdict = verdict_of_ended_search(verdict, context.time_limit)
    state = replace(state, verdict=verdict, effects_hold=verdict[0] == "effects")
    if verdict[0] == "none":
        max_sigmas = context.policy.size.max_calibration_sigmas
        calibration = calibrate(declared, context.robot, context.split.estimation).clipped(max_sigmas)
        return _with_final_robot(state, declared, calibration.calibrated_robot(context.robot))
    if verdict[0] == "unexplained":
        comparisons = tuple(replace(c, after=c.before, errors_after=c.errors_before) for c in state.comparisons)
        return replace(state, final_robot=context.robot, comparisons=comparisons)
    return state


def _nothing_lacks(state: Identification) -> bool:
    return not state.selection.accepted and state.is_white_before


def _confirmed(state: Identification, robot: Robot) -> Identification | None:
    """The state with a better robot whose co-simulations leave no more than noise; None where they do."""
    context, data_sets = state.context, state.prepared.data_sets
    calibrated_robot = calibrate(context.fitter, robot, context.split.estimation).calibrated_robot(robot)
    policy = context.policy.cosimulation
    validation = validate_by_cosimulation(
        calibrated_robot, context.fitter, data_sets, state.runs_before, context.workers, policy
    )
    if validation is None:
        return None
    comparisons, floors = validation
    return replace(state, final_robot=calibrated_robot, comparisons=comparisons, noise_floors=tuple(floors))


def _result(state: Identification) -> Trace:
    context, prepared, final, effects = state.context, state.prepared, state.final_robot, state.effects
    validation = prepared.split.validation
    innovations = context.fitter.innovations(final, validation)
    verdict, sentence = state.verdict
    calibration_notes = [] if verdict == "unexplained" else _calibration_notes(state)
    localisation = _localisation(state)
    white_before = state.is_white_before
    return Trace(
        verdict=verdict,
        sentence=sentence,
        robot_before=context.robot,
        robot_after=final,
        effects=effects,
        correlations=parameter_correlations(state.selection.fit, effects),
        also_possible=state.selection.confusable if state.effects_hold else (),
        candidates=state.selection.candidates,
        formula=confirmed_formula(context.robot, state.selection, state.effects_hold, state.discovery),
        comparisons=state.comparisons,
        noise_floor=state.noise_floors[-1],
        noise_before=white_before,
        noise_after=state.is_white_after,
        normalised_innovation_variance=innovations.mean_square(validation.rows),
        autocorrelations=largest_autocorrelations(innovations, validation.rows, context.policy.residual_analysis),
        identifiability=state.identifiability,
        components=localisation,
        resonances=state.unexplained.resonances,
        alpha=context.alpha,
        notes=(
            *prepared.notes,
            *state.unexplained.notes,
            *_disturbance_notes(state),
            *_initial_state_notes(state),
            *calibration_notes,
        ),
        seconds=context.time_limit.elapsed,
        disturbance=context.fitter.noise.disturbance,
        left_share=state.shares.left if state.shares else None,
        small_effects=state.small_effects,
        untried=context.time_limit.untried,
    )


def _localisation(state: Identification) -> FaultLocalisation:
    (pending,), context = state.pending_localisation, state.context
    try:
        with context.time_limit.searching(context.policy.time_limit.refinement):
            context.time_limit.check()
            return pending.result()
    except OutOfTimeError:
        context.leave_untried("telling which component errs")
        return FaultLocalisation(np.zeros(0), (), "", "There was no time to test the components one by one.", ())


def _disturbance_notes(state: Identification) -> list[str]:
    """Notes on the disturbance that was assumed, and on effects too small to matter."""
    disturbance = state.context.fitter.noise.disturbance
    if disturbance is None:
        return []
    small = [f"{each.name} ({100.0 * (each.share or 0.0):.1f} % of what is missed)" for each in state.small_effects]
    return [disturbance.sentence, *([f"established, but too small to matter: {', '.join(small)}"] if small else [])]


def _calibration_notes(state: Identification) -> list[str]:
    """Notes on declared numbers that the robot file calls uncertain, as the recordings have them."""
    final_robot = state.selection.fit.robot if state.discovery is None else state.discovery.robot
    return [
        note
        for data in state.prepared.data_sets
        for note in calibrate(state.context.fitter, final_robot, data).notes(final_robot, data.recording.path)
    ]


def _initial_state_notes(state: Identification) -> list[str]:
    """Notes on the smoothed initial state of each recording under the final model."""
    starts = [
        (with_initial_state(state.context.fitter, state.final_robot, data), data.recording.path)
        for data in state.prepared.data_sets
    ]
    return [note for start, path in starts for note in initial_state_note(start, path)]
