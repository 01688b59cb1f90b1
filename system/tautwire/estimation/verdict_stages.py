"""Stages of an identification that answer: verdict, intervals, shares, and what could have been seen."""

from __future__ import annotations

from dataclasses import replace

from .effect_estimates import effects_by_evidence, effects_by_size, effects_with_shares, estimated_effects
from .explained_shares import ExplainedShares, explained_shares, remaining_error
from .identifiability import analyse_identifiability
from .identification_state import Identification, with_final_robot
from .smoothed_states import calibrate, calibrate_beside_effects
from .time_limit import OutOfTimeError
from .verdict import verdict_beside_disturbance, verdict_of, verdict_of_ended_search


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


def _judged_beside_disturbance(state: Identification, shares: ExplainedShares) -> Identification:
    """The state with its verdict; without an effect that matters, with the declared robot as the final one."""
    context, declared = state.context, state.prepared.fitter
    comparison, floor = state.comparisons[-1], state.noise_floors[-1]
    missed, remaining = (
        remaining_error(comparison.recording, run, floor).sentence for run in (comparison.before, comparison.after)
    )
    has_resonance = bool(state.unexplained.resonances)
    verdict = verdict_beside_disturbance(context, state.selection, shares, missed, remaining, has_resonance)
    verdict = verdict_of_ended_search(verdict, context.time_limit, state.selection.has_tried_each)
    state = replace(state, verdict=verdict, effects_hold=verdict[0] in ("effects", "discovered"))
    if verdict[0] == "none":
        max_sigmas = context.policy.size.max_calibration_sigmas
        calibration = calibrate(declared, context.robot, context.split.estimation).clipped(max_sigmas)
        return with_final_robot(state, declared, calibration.calibrated_robot(context.robot))
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
