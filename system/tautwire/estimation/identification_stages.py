"""Stages of an identification, in order: each takes what is known so far, and gives that with what it adds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from operator import attrgetter

from ..robot.schema import Robot
from ..robot.uncertain_parameters import uncertain_parameters
from .cable_values import with_values_of_cables
from .confusable_models import replace_by_confusable_models
from .cosimulation_validation import (
    compare_cosimulations,
    start_cosimulations,
    validate_by_cosimulation,
)
from .declared_start import with_declared_start
from .discovery.unexplained_residual import UnexplainedResidual, explain_residual, resonances_beside_disturbance
from .effect_estimates import effects_by_evidence, effects_by_size, effects_with_shares, estimated_effects
from .explained_shares import ExplainedShares, explained_shares, remaining_error, sensor_noise_floor
from .identifiability import analyse_identifiability
from .identification_state import Identification
from .localisation.component_localisation import localise_residual
from .parameter_fit import Fitter
from .policy import TimeLimitPolicy
from .preprocessing import calibrated_estimation_data, with_disturbance
from .smoothed_states import calibrate, calibrate_beside_effects, calibrated_robot
from .stepwise_selection import select_effects
from .time_limit import OutOfTimeError
from .verdict import verdict_beside_disturbance, verdict_of, verdict_of_ended_search


def start_side_runs(state: Identification) -> Identification:
    """Co-simulate the declared robot, and localise its error in a component, beside all that follows."""
    context, prepared = state.context, state.prepared
    runs = start_cosimulations(context.workers, context.fitter, context.robot, prepared.data_sets)
    robot, data = calibrated_estimation_data(prepared, context.robot)
    localisation = context.workers.submit(
        localise_residual, robot, data, context.fitter.noise, context.policy.localisation
    )
    return replace(state, pending_runs=tuple(runs), pending_localisation=(localisation,))


def begin_localisation(state: Identification) -> Identification:
    """Localise the declared robot's error before a search that may take all the time, where no process does."""
    for localisation in state.pending_localisation:
        localisation.begin()
    return state


def select(state: Identification) -> Identification:
    """Select effects in the recordings as they are."""
    state = replace(state, selection=select_effects(state.context))
    if state.selection.disturbance:
        fitter = state.context.fitter.with_disturbance(state.selection.disturbance)
        state = replace(state, context=replace(state.context, fitter=fitter))
    return state


def select_in_corrected_recordings(state: Identification) -> Identification:
    """Select effects in the recordings with clocks or winch speeds corrected, where none explain them as recorded."""
    for prepared in state.corrected:
        if not state.selection_explains:
            state.context.time_limit.check()
            context = replace(state.context, fitter=prepared.fitter, split=prepared.split)
            state = start_side_runs(replace(state, context=context, prepared=prepared))
            state = replace(state, selection=select_effects(context))
    return state


def try_confusable_models(state: Identification) -> Identification:
    """Replace the selection by a model that is easily confused with it, where that explains more."""
    context, selection = replace_by_confusable_models(state.context, state.selection)
    return replace(state, context=context, selection=selection)


def try_declared_start(state: Identification) -> Identification:
    """Replace the selection by a sensor offset that explains as much of recordings that seem to start elsewhere."""
    context, selection = with_declared_start(state.context, state.selection)
    if selection is state.selection:
        return state
    split = context.split
    data_sets = (split.estimation, split.validation)[: len(state.prepared.data_sets)]
    prepared = replace(state.prepared, split=split, data_sets=data_sets)
    return replace(state, context=context, prepared=prepared, selection=selection)


def separate_cables(state: Identification) -> Identification:
    """Give each cable a value of its own where the selected effects differ by cable.

    Only beside a disturbance: without one a model that leaves white noise needs no more numbers.
    """
    if not state.context.fitter.has_disturbance:
        return state
    state.context.progress("values of single cables", 0.0)
    context, selection = with_values_of_cables(state.context, state.selection)
    return replace(state, context=context, selection=selection)


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
    if state.shares:
        return replace(state, unexplained=resonances_beside_disturbance(state.context, state.shares))
    if state.effects_hold or _nothing_lacks(state):
        return state
    unexplained = explain_residual(state.context, state.selection)
    state = replace(state, unexplained=unexplained)
    confirmed = _confirmed(state, unexplained.discovery.robot) if unexplained.discovery else None
    return state if confirmed is None else replace(confirmed, discovery=unexplained.discovery)


def select_beside_disturbance(state: Identification) -> Identification:
    """Select effects beside a disturbance, for which what an inexact form leaves may pass.

    Where neither a formula nor a few effects leave white noise. Not where an oscillator is hidden: that is no form.
    """
    if state.discovery or state.unexplained.resonances or _is_explained_by_few_effects(state):
        return state
    policy = state.context.policy.size
    prepared = with_disturbance(state.prepared, state.context.robot)
    context = replace(state.context, fitter=prepared.fitter, split=prepared.split)
    note = "few effects leave more than white noise: the forms of those named are not quite nature's"
    beside = replace(state, context=context, prepared=prepared, unexplained=UnexplainedResidual(notes=(note,)))
    for stage in (select, separate_cables, confirm_effects):
        beside = stage(beside)
    shares = beside.shares
    if shares is None or not beside.selection.accepted:
        return state
    is_form = shares.left <= policy.max_left_share_of_form and shares.size_missed > policy.max_size_of_disturbance
    has_fewer = not state.effects_hold or len(beside.selection.accepted) < len(state.selection.accepted)
    return beside if is_form and has_fewer else state


def judge(state: Identification) -> Identification:
    """Put the verdict in words."""
    if state.shares:
        return _judged_beside_disturbance(state, state.shares)
    substantial = state.selection.substantial(state.context.policy.selection)
    verdict = verdict_of(
        state.context.robot, state.selection, substantial, state.effects_hold, state.discovery, state.is_white_before
    )
    return replace(state, verdict=verdict_of_ended_search(verdict, state.context.time_limit))


def estimate_intervals(state: Identification) -> Identification:
    """Estimate the confirmed effects' parameters with intervals, and the uncertain numbers beside them."""
    state.context.progress("intervals", 0.0)
    if not state.effects_hold and not (state.shares and state.selection.accepted):
        return state
    effects = estimated_effects(state.context, state.selection)
    if state.shares is None:
        large, small = effects_by_evidence(effects, state.selection.substantial(state.context.policy.selection))
    else:
        size = state.context.policy.size
        large, small = effects_by_size(effects, state.selection.accepted, state.shares, size)
    if not state.effects_hold:
        return replace(state, effects=(), small_effects=(*large, *small))
    return _with_calibrations(replace(state, effects=large, small_effects=small))


def share_out_what_was_missed(state: Identification) -> Identification:
    """Give effects of exact form their shares too, which decide nothing there."""
    if not state.effects_hold or state.shares:
        return state
    state.context.progress("shares", 0.0)
    selection, data, after = state.selection, state.prepared.data_sets[-1], state.comparisons[-1]
    fit = replace(selection.fit, robot=state.final_robot)
    shares = explained_shares(state.context, state.prepared.fitter, fit, selection.accepted, data, after)
    effects, small_effects = (
        effects_with_shares(each, selection.accepted, shares) for each in (state.effects, state.small_effects)
    )
    return replace(state, shares=shares, effects=effects, small_effects=small_effects)


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
    begin_localisation,
    select,
    select_in_corrected_recordings,
    begin_localisation,
    try_confusable_models,
    try_declared_start,
    separate_cables,
    cosimulate_before,
    confirm_effects,
    explain_by_formula,
    select_beside_disturbance,
    judge,
    estimate_intervals,
    share_out_what_was_missed,
    analyse_detectability,
)


# Stages that are searches, with what is left untried where one has no time left.
SEARCHES: Mapping[Callable[[Identification], Identification], tuple[Callable[[TimeLimitPolicy], float], str]] = {
    select: (attrgetter("selection"), "effects"),
    select_in_corrected_recordings: (attrgetter("selection"), "correcting clocks or winch speeds"),
    try_confusable_models: (attrgetter("selection"), "models that are easily confused with the effects found"),
    try_declared_start: (attrgetter("selection"), "trying a sensor's offset in place of another start"),
    separate_cables: (attrgetter("values_of_cables"), "values of single cables"),
    explain_by_formula: (attrgetter("discovery"), "formulas and resonances"),
    select_beside_disturbance: (attrgetter("second_search"), "effects whose form is not quite nature's"),
    estimate_intervals: (attrgetter("refinement"), "estimates of the parameters"),
    share_out_what_was_missed: (attrgetter("refinement"), "shares of what was missed"),
    analyse_detectability: (attrgetter("refinement"), "telling what the recordings could have shown"),
}


def _explained_beside_disturbance(state: Identification) -> Identification:
    """The state with the shares of the selected effects, and what the robot with them leaves in co-simulation."""
    context, selection = state.context, state.selection
    identified = calibrated_robot(context.fitter, selection.fit.robot, context.split.estimation)
    state = _with_final_robot(state, context.fitter, identified)
    data, after = state.prepared.data_sets[-1], state.comparisons[-1]
    fit = replace(selection.fit, robot=identified)
    shares = explained_shares(context, state.prepared.fitter, fit, selection.accepted, data, after)
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
    comparison, floor = state.comparisons[-1], state.noise_floors[-1]
    missed, remaining = (
        remaining_error(comparison.recording, run, floor).sentence for run in (comparison.before, comparison.after)
    )
    has_resonance = bool(state.unexplained.resonances)
    verdict = verdict_beside_disturbance(context, state.selection, shares, missed, remaining, has_resonance)
    verdict = verdict_of_ended_search(verdict, context.time_limit)
    state = replace(state, verdict=verdict, effects_hold=verdict[0] in ("effects", "discovered"))
    if verdict[0] == "none":
        max_sigmas = context.policy.size.max_calibration_sigmas
        calibration = calibrate(declared, context.robot, context.split.estimation).clipped(max_sigmas)
        return _with_final_robot(state, declared, calibration.calibrated_robot(context.robot))
    if verdict[0] == "unexplained":
        comparisons = tuple(replace(c, after=c.before, errors_after=c.errors_before) for c in state.comparisons)
        return replace(state, final_robot=context.robot, comparisons=comparisons)
    return state


def _with_calibrations(state: Identification) -> Identification:
    """The state with its effects, and the uncertain numbers of its final robot no better known than these let them."""
    context, selection = state.context, state.selection
    robot, effects = selection.fit.robot, (*state.effects, *state.small_effects)
    try:
        calibrations = [
            calibrate_beside_effects(context.fitter, robot, selection.accepted, effects, data)
            for data in state.prepared.data_sets
        ]
    except OutOfTimeError:
        context.leave_untried("what the effects' intervals mean for uncertain numbers: their deviations are too small")
        return state
    return replace(state, final_robot=calibrations[0].calibrated_robot(robot), calibrations=tuple(calibrations))


def _is_explained_by_few_effects(state: Identification) -> bool:
    """Whether effects of exact form are the answer: a few that leave white noise, or none where nothing lacks."""
    if state.context.fitter.has_disturbance or _nothing_lacks(state):
        return True
    few = len(state.selection.accepted) < state.context.policy.selection.min_suspicious_effects
    return few and state.selection_explains


def _nothing_lacks(state: Identification) -> bool:
    return not state.selection.accepted and state.is_white_before


def _confirmed(state: Identification, robot: Robot) -> Identification | None:
    """The state with a better robot whose co-simulations leave no more than noise; None where they do."""
    context, data_sets = state.context, state.prepared.data_sets
    final_robot = calibrated_robot(context.fitter, robot, context.split.estimation)
    validation = validate_by_cosimulation(
        final_robot, context.fitter, data_sets, state.runs_before, context.workers, context.policy.cosimulation
    )
    if validation is None:
        return None
    comparisons, floors = validation
    return replace(state, final_robot=final_robot, comparisons=comparisons, noise_floors=tuple(floors))
