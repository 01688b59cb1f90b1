"""Stages of an identification, in order: each takes what is known so far, and gives that with what it adds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf
from operator import attrgetter

from ..errors import UnreachableError
from ..robot.schema import Robot
from ..robot.uncertain_parameters import uncertain_parameters
from .cable_values import with_values_of_cables
from .confusable_models import replace_by_confusable_models
from .cosimulation_validation import compare_cosimulations, start_cosimulations, validate_by_cosimulation
from .declared_start import with_declared_start
from .discovery.unexplained_residual import UnexplainedResidual, explain_residual, resonances_beside_disturbance
from .estimation_data import DataSplit
from .explained_shares import explained_shares
from .identification_state import Identification, with_final_robot
from .localisation.component_localisation import localise_residual
from .parameter_fit import NoFitError
from .policy import TimeLimitPolicy
from .preprocessing import with_disturbance, with_other_interpolation
from .selection_result import without_least_evident
from .smoothed_states import calibrated_robot
from .speed_versions import split_with_other_interpolation
from .stepwise_selection import select_effects
from .verdict_stages import analyse_detectability, estimate_intervals, judge, share_out_what_was_missed


def start_side_runs(state: Identification) -> Identification:
    """Co-simulate the declared robot, and localise its error in a component, beside all that follows."""
    context, prepared = state.context, state.prepared
    runs = start_cosimulations(context.workers, context.fitter, context.robot, prepared.data_sets)
    localisation = context.workers.submit(
        localise_residual, context.robot, prepared.split.estimation, context.fitter.noise, context.policy.localisation
    )
    return replace(state, pending_runs=tuple(runs), pending_localisation=(localisation,))


def begin_localisation(state: Identification) -> Identification:
    """Localise the declared robot's error before a search that may take all the time, where no process does."""
    for localisation in state.pending_localisation:
        localisation.begin()
    return state


def select(state: Identification) -> Identification:
    """Select effects in the recordings as they are, or with winch speeds interpolated otherwise."""
    selection = select_effects(state.context)
    if selection.split is not None:
        state = start_side_runs(_interpolated(state, selection.split))
    if selection.disturbance:
        fitter = state.context.fitter.with_disturbance(selection.disturbance)
        state = replace(state, context=replace(state.context, fitter=fitter))
    return replace(state, selection=selection)


def _interpolated(state: Identification, split: DataSplit) -> Identification:
    """The state with data whose winch speeds are interpolated otherwise."""
    prepared = with_other_interpolation(state.prepared, state.context.robot, split)
    context = replace(state.context, fitter=prepared.fitter, split=split)
    return replace(state, context=context, prepared=prepared)


def select_in_corrected_recordings(state: Identification) -> Identification:
    """Select effects in the recordings with clocks or winch speeds corrected, where none explain them as recorded."""
    for prepared in state.corrected:
        if not state.selection_explains:
            state.context.time_limit.check()
            context = replace(state.context, fitter=prepared.fitter, split=prepared.split)
            state = select(start_side_runs(replace(state, context=context, prepared=prepared)))
    return state


def select_with_other_interpolation(state: Identification) -> Identification:
    """Select effects anew with winch speeds cubic between samples in place of linear, or the other way round.

    Where these are far likelier under the effects selected: before, the largest effect decides which seem so.
    """
    split = split_with_other_interpolation(state.context.split)
    if split is None or not _is_far_likelier(state, split):
        return state
    untried = state.context.time_limit.untried
    other = select(start_side_runs(_interpolated(state, split)))
    # A search that was cut short may have lost what the first one found.
    return other if other.context.time_limit.untried == untried else state


def _is_far_likelier(state: Identification, split: DataSplit) -> bool:
    """Whether other data are far likelier under the selected effects, whose values are fitted anew."""
    fitter, selection, policy = state.context.fitter, state.selection, state.context.policy.preprocessing
    robot, chosen, data = selection.fit.robot, selection.accepted, state.context.split.estimation
    innovations = fitter.judged(robot, chosen, data)
    before = innovations.log_likelihood(data.rows)
    least = policy.min_speed_gain if fitter.has_disturbance else policy.decisive_gain(innovations.misfit(data.rows))
    gain = fitter.log_likelihood(robot, chosen, split.estimation) - before
    # What leaves white noise leaves nothing for other data to explain.
    is_explained = not fitter.has_disturbance and state.selection_explains
    if abs(gain) < least or (gain < 0.0 and is_explained):
        return False
    try:
        fit = fitter.fit_from([robot], chosen, split.estimation, -inf)
    except (NoFitError, UnreachableError):
        return False
    return fitter.log_likelihood(fit.robot, chosen, split.estimation) - before >= least


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


def drop_least_evident_effects(state: Identification) -> Identification:
    """Take out the least evident effects where none is the same on all stretches, if the others then explain enough.

    Beside an effect whose form is not quite nature's another may stand for what is left, and neither keeps its size.
    """
    policy, fewer = state.context.policy.size, state
    if state.shares is None or state.shares.substantial(policy):
        return state
    while len({hypothesis.effect for hypothesis in fewer.selection.accepted}) > 1:
        state.context.progress("fewer effects", 0.0)
        try:
            context, selection = without_least_evident(fewer.context, fewer.selection)
            fewer = _explained_beside_disturbance(replace(fewer, context=context, selection=selection))
        except (NoFitError, UnreachableError):
            return state
        if fewer.shares and fewer.shares.explains(policy):
            return fewer
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
    is_much = shares.size_missed > policy.max_size_of_disturbance
    is_form = is_much and shares.left <= policy.max_left_share_of_form and shares.explains(policy)
    has_fewer = not state.effects_hold or len(beside.selection.accepted) < len(state.selection.accepted)
    return beside if is_form and has_fewer else state


STAGES: tuple[Callable[[Identification], Identification], ...] = (
    start_side_runs,
    begin_localisation,
    select,
    select_in_corrected_recordings,
    select_with_other_interpolation,
    begin_localisation,
    try_confusable_models,
    try_declared_start,
    separate_cables,
    cosimulate_before,
    confirm_effects,
    drop_least_evident_effects,
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
    select_with_other_interpolation: (attrgetter("selection"), "winch speeds interpolated otherwise"),
    try_confusable_models: (attrgetter("selection"), "models that are easily confused with the effects found"),
    try_declared_start: (attrgetter("selection"), "trying a sensor's offset in place of another start"),
    separate_cables: (attrgetter("values_of_cables"), "values of single cables"),
    drop_least_evident_effects: (attrgetter("second_search"), "fewer effects, where none gets a name"),
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
    state = with_final_robot(state, context.fitter, identified)
    data, after = state.prepared.data_sets[-1], state.comparisons[-1]
    fit = replace(selection.fit, robot=identified)
    shares = explained_shares(context, state.prepared.fitter, fit, selection.accepted, data, after)
    return replace(state, shares=shares)


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
