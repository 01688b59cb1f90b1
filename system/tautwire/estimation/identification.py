"""Identification of what a robot's model lacks: from recordings to a better robot, through FMUs both times."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ..errors import ArgumentError, NumericalError
from ..process_signals import defer_interrupts
from ..recordings.recording import Recording, require_outputs
from ..recordings.recording_notes import drift_notes, kinematic_scale_notes
from ..recordings.shared_samples import require_unseen
from ..robot.schema import Robot, validate_robot
from ..validation import NumberRule, validate_callable, validate_instance, validate_integer, validate_number
from .effect_estimates import parameter_correlations, series_stiffness_notes, with_readable_values
from .identification_context import IdentificationContext, Progress, no_progress
from .identification_stages import SEARCHES, STAGES
from .identification_state import Identification
from .localisation.component_residuals import FaultLocalisation
from .localisation.fault_isolation import numbered, reconciled_with_effects
from .policy import DEFAULT_POLICY, IdentificationPolicy
from .preprocessing import prepare_data
from .residual_analysis import largest_autocorrelations
from .selection_result import nothing_selected
from .smoothed_states import calibrate, initial_state_note, with_initial_state
from .time_limit import OutOfTimeError, TimeLimit
from .trace_result import Comparison, FoundEffect, Trace
from .verdict import confirmed_formula
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

    Raises RecordingError where a recording has no measured output, or both are the same, ArgumentError for all else.
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
    if check is not None:
        require_unseen(fit, check)


def validated_false_alarm_rate(argument: str, value: object) -> float:
    """The false-alarm rate, above 0 and below 1; raises ArgumentError."""
    rate = validate_number(argument, value, FALSE_ALARM_RATE_RULE)
    if rate >= 1.0:
        raise ArgumentError(argument, value, f"is {rate!r}, must be below 1", FALSE_ALARM_RATE_RULE.hint())
    return rate


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
        prepared, *corrected = prepare_data(robot, fit, check, workers, policy)
        context = IdentificationContext(
            robot, prepared.fitter, prepared.split, alpha, progress or no_progress, workers, policy, limit
        )
        state = Identification(context, prepared, tuple(corrected), nothing_selected(robot), robot)
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


def _result(state: Identification) -> Trace:
    context, prepared, final, effects = state.context, state.prepared, state.final_robot, state.effects
    validation = prepared.split.validation
    innovations = context.fitter.innovations(final, validation)
    verdict, sentence = state.verdict
    calibration_notes = [] if verdict == "unexplained" else _calibration_notes(state)
    localisation = reconciled_with_effects(_localisation(state), [(each.name, each.cables) for each in effects])
    white_before = state.is_white_before
    return Trace(
        verdict=verdict,
        sentence=sentence,
        robot_before=context.robot,
        robot_after=with_readable_values(final, context.robot, (*effects, *state.small_effects)),
        effects=effects,
        correlations=parameter_correlations(state.selection.fit, effects),
        also_possible=state.selection.confusable if state.effects_hold else (),
        candidates=state.selection.candidates,
        formula=confirmed_formula(context.robot, state.selection, state.effects_hold, state.discovery),
        comparisons=_with_innovations(state, innovations.values),
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
            *_kinematic_notes(state),
            *series_stiffness_notes(effects, context.robot.cable_count),
            *_initial_state_notes(state),
            *calibration_notes,
        ),
        seconds=context.time_limit.elapsed,
        disturbance=context.fitter.noise.disturbance,
        left_share=state.shares.left if state.shares else None,
        small_effects=state.small_effects,
        untried=context.time_limit.untried,
    )


def _with_innovations(state: Identification, on_validation: NDArray[np.float64]) -> tuple[Comparison, ...]:
    """The comparisons with innovations under the final robot; the last one is that of the validation data."""
    fitter, robot = state.context.fitter, state.final_robot
    earlier = [fitter.innovations(robot, data).values for data in state.prepared.data_sets[:-1]]
    return tuple(
        replace(comparison, innovations=values)
        for comparison, values in zip(state.comparisons, (*earlier, on_validation), strict=True)
    )


def _localisation(state: Identification) -> FaultLocalisation:
    (pending,), context = state.pending_localisation, state.context
    if pending.is_done:
        return pending.result()
    try:
        with context.time_limit.searching(context.policy.time_limit.refinement):
            context.time_limit.check()
            return pending.result()
    except OutOfTimeError:
        context.leave_untried("telling which component errs")
        return FaultLocalisation(np.zeros(0), (), "", "There was no time to test the components one by one.", ())


def _disturbance_notes(state: Identification) -> list[str]:
    """Notes on the disturbance that was assumed, on effects too small to matter, and on values that differ."""
    disturbance, fit = state.context.fitter.noise.disturbance, state.context.split.estimation.recording
    if disturbance is None:
        names = ", ".join(f"{each.name} ({each.evidence:.0f} nats)" for each in state.small_effects)
        return [f"established, but no more than what the form of a larger effect may leave: {names}"] if names else []
    small_effects = () if state.verdict[0] == "unexplained" else state.small_effects
    small = [f"{each.name} ({100.0 * (each.share or 0.0):.1f} % of what is missed)" for each in small_effects]
    unstable = ", ".join(dict.fromkeys(f"{name} of {each.name}" for each in state.effects for name in each.unstable))
    return [
        disturbance.sentence(fit.has_position, fit.has_tension, fit.has_orientation),
        *([f"established, but too small to matter: {', '.join(small)}"] if small else []),
        *([f"the two recordings do not agree on {unstable}; intervals hold what both show"] if unstable else []),
        *_interval_notes(state.effects),
    ]


def _kinematic_notes(state: Identification) -> list[str]:
    """Notes on each winch's scale, where a drum that differs is named, and on its drift where a rope that creeps is.

    A drum's one value may stand for several, and creep for a speed that is off by a constant.
    """
    names = {each.name for each in (*state.effects, *state.small_effects)}
    told = [kinematic_scale_notes] if "drum" in names else []
    told += [drift_notes] if names & {"creep", "thermal", "drum"} else []
    robot, data_sets = state.context.robot, state.prepared.data_sets
    return [note for notes in told for data in data_sets for note in notes(robot, data.recording)]


def _interval_notes(effects: Sequence[FoundEffect]) -> list[str]:
    """A note for each reason that intervals are as wide as they are."""
    parameters: dict[str, list[str]] = {}
    for effect in effects:
        for name, estimate in effect.parameters.items():
            cable = f" ({numbered('cable', effect.cables)})" if len(effect.cables) == 1 else ""
            parameters.setdefault(estimate.dominant_uncertainty, []).append(f"{name} of {effect.name}{cable}")
    return [
        f"the width of the 95 % interval of {' and of '.join(names)} is mostly due to {reason}"
        for reason, names in parameters.items()
        if reason
    ]


def _calibration_notes(state: Identification) -> list[str]:
    """Notes on declared numbers that the robot file calls uncertain, as the recordings have them."""
    data_sets = state.prepared.data_sets
    robot = state.selection.fit.robot if state.discovery is None else state.discovery.robot
    calibrations = state.calibrations or [calibrate(state.context.fitter, robot, data) for data in data_sets]
    return [
        note
        for data, calibration in zip(data_sets, calibrations, strict=True)
        for note in calibration.notes(robot, data.recording.path)
    ]


def _initial_state_notes(state: Identification) -> list[str]:
    """Notes on the smoothed initial state of each recording under the final model."""
    starts = [
        (with_initial_state(state.context.fitter, state.final_robot, data), data.recording.path)
        for data in state.prepared.data_sets
    ]
    return [note for start, path in starts for note in initial_state_note(start, path)]
