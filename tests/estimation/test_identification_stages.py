"""Stages of an identification: what each makes of what is known so far."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tautwire.estimation import identification_stages
from tautwire.estimation.explained_shares import ExplainedShares
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.identification_context import IdentificationContext, no_progress
from tautwire.estimation.identification_stages import (
    _is_far_likelier,
    drop_least_evident_effects,
    select,
    select_beside_disturbance,
    select_with_other_interpolation,
)
from tautwire.estimation.identification_state import Identification
from tautwire.estimation.parameter_fit import Fit, NoFitError
from tautwire.estimation.policy import DEFAULT_POLICY
from tautwire.estimation.selection_result import SelectionResult
from tautwire.estimation.time_limit import TimeLimit
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.robots import example

ROBOT = example("three")


@dataclass(frozen=True)
class ContextWithPolicy:
    """As much of a context as decides whether effects matter."""

    policy: Any = DEFAULT_POLICY
    progress: Any = no_progress
    robot: Any = ROBOT
    fitter: Any = None
    split: Any = None
    time_limit: Any = None


def with_effects(*names: str, **spreads: float) -> Identification:
    """A state whose effects, the most evident first, have these spreads over stretches."""
    hypotheses = tuple(Hypothesis(BY_NAME[name], (1, 2, 3)) for name in names)
    evidence = tuple(1000.0 / (1 + rank) for rank in range(len(names)))
    selection = SelectionResult(hypotheses, evidence, Fit.without_parameters(ROBOT), (), ())
    context = cast("IdentificationContext", ContextWithPolicy())
    return replace(
        Identification(context, cast("Any", None), (), selection, ROBOT), shares=shares_of(selection, spreads)
    )


def shares_of(selection: SelectionResult, spreads: dict[str, float], share: float = 0.6) -> ExplainedShares:
    count = len(selection.accepted)
    by_effect = tuple(spreads[hypothesis.effect.name] for hypothesis in selection.accepted)
    return ExplainedShares((share,) * count, (20.0,) * count, by_effect, (0.0,) * count, 1.0 - share, 30.0, 20.0, 0.0)


@pytest.mark.parametrize(
    ("alone", "share", "names"),
    [
        ({"modulus": 0.4, "relaxation": 0.9, "slack": 0.5}, 0.6, ["modulus", "relaxation", "slack"]),
        ({"modulus": 0.1, "relaxation": 0.9, "slack": 0.5}, 0.6, ["modulus"]),
        ({"modulus": 0.1, "relaxation": 0.2, "slack": 0.5}, 0.6, ["modulus", "relaxation"]),
        ({"modulus": 0.1, "relaxation": 0.2, "slack": 0.5}, 0.2, ["modulus", "relaxation", "slack"]),
    ],
)
def test_the_least_evident_go_until_one_is_steady_and_explains_enough(
    alone: dict[str, float], share: float, names: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def without_last(context: object, selection: SelectionResult) -> tuple[object, SelectionResult]:
        return context, replace(selection, accepted=selection.accepted[:-1], evidence=selection.evidence[:-1])

    def explained(state: Identification) -> Identification:
        last = state.selection.accepted[-1].effect.name
        spreads = dict.fromkeys(alone, 0.9) | {last: alone[last]}
        return replace(state, shares=shares_of(state.selection, spreads, share))

    monkeypatch.setattr(identification_stages, "without_least_evident", without_last)
    monkeypatch.setattr(identification_stages, "_explained_beside_disturbance", explained)
    state = with_effects("modulus", "relaxation", "slack", **dict.fromkeys(alone, 0.9))
    fewer = drop_least_evident_effects(state)
    assert [hypothesis.effect.name for hypothesis in fewer.selection.accepted] == names
    assert len(names) < 3 or fewer is state


def test_a_selection_of_which_one_effect_is_steady_stays_as_it_is() -> None:
    state = with_effects("modulus", "relaxation", modulus=0.1, relaxation=0.9)
    assert drop_least_evident_effects(state) is state


def test_a_selection_whose_others_cannot_be_fitted_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_last(context: object, selection: SelectionResult) -> tuple[object, SelectionResult]:
        raise NoFitError(np.array([0.0]))

    monkeypatch.setattr(identification_stages, "without_least_evident", without_last)
    state = with_effects("modulus", "relaxation", modulus=0.9, relaxation=0.9)
    assert drop_least_evident_effects(state) is state


def test_the_declared_robot_is_localised_whatever_uncertain_numbers_would_take_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    submitted: list[tuple[Any, ...]] = []
    workers = SimpleNamespace(submit=lambda *call: submitted.append(call))
    context: Any = SimpleNamespace(
        robot=ROBOT, workers=workers, fitter=SimpleNamespace(noise="noise"), policy=DEFAULT_POLICY
    )
    prepared: Any = SimpleNamespace(data_sets=(), split=SimpleNamespace(estimation="FIT as recorded"))
    monkeypatch.setattr(identification_stages, "start_cosimulations", lambda *_: [])
    state = with_effects()
    identification_stages.start_side_runs(replace(state, context=context, prepared=prepared))
    assert [call[1:4] for call in submitted] == [(ROBOT, "FIT as recorded", "noise")]


@pytest.mark.parametrize(("size", "is_answer"), [(50.0, True), (200.0, False)])
def test_effects_that_nearly_cancel_are_no_answer_beside_a_disturbance(
    size: float, is_answer: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    white = with_effects("modulus", "relaxation", modulus=0.1, relaxation=0.1)
    beside = with_effects("slack", slack=0.1)
    assert beside.shares is not None
    shares = replace(beside.shares, effects=(0.95,), sizes=(size,), left=0.05, size_missed=30.0)
    beside = replace(beside, shares=shares)
    prepared: Any = SimpleNamespace(fitter=None, split=None)
    monkeypatch.setattr(identification_stages, "_is_explained_by_few_effects", lambda state: False)
    monkeypatch.setattr(identification_stages, "with_disturbance", lambda *_: prepared)
    monkeypatch.setattr(identification_stages, "select", lambda state: replace(beside, unexplained=state.unexplained))
    for stage in ("separate_cables", "confirm_effects"):
        monkeypatch.setattr(identification_stages, stage, lambda state: state)
    answer = select_beside_disturbance(white)
    assert (answer is not white) == is_answer


@pytest.mark.parametrize("is_cut_short", [False, True])
def test_a_second_search_counts_only_when_it_is_complete(monkeypatch: pytest.MonkeyPatch, is_cut_short: bool) -> None:
    first, second, limit = (
        with_effects("modulus", modulus=0.1),
        with_effects("payload", payload=0.1).selection,
        TimeLimit(),
    )
    context = replace(cast("Any", first.context), fitter=SimpleNamespace(has_disturbance=True), time_limit=limit)
    first = replace(first, context=context)

    def select(state: Identification) -> Identification:
        if is_cut_short:
            limit.leave_untried("There was no time for effects.")
        return replace(state, selection=second)

    prepared = SimpleNamespace(fitter=context.fitter)
    for name, stand_in in {
        "split_with_other_interpolation": lambda split: "other data",
        "with_other_interpolation": lambda *_: prepared,
        "_is_far_likelier": lambda *_: True,
        "start_side_runs": lambda state: state,
        "select": select,
    }.items():
        monkeypatch.setattr(identification_stages, name, stand_in)
    result = select_with_other_interpolation(first)
    assert result is first if is_cut_short else result.selection is second
    assert is_cut_short or (result.prepared, result.context.split) == (prepared, "other data")


def test_a_selection_with_speeds_interpolated_otherwise_brings_its_data(monkeypatch: pytest.MonkeyPatch) -> None:
    state = with_effects("modulus", modulus=0.1)
    selection = replace(with_effects("damping", damping=0.1).selection, split=cast("Any", "other data"))
    prepared, started = SimpleNamespace(fitter="fitter of these"), []

    def side_runs(state: Identification) -> Identification:
        started.append(state.prepared)
        return state

    for name, stand_in in {
        "select_effects": lambda context: selection,
        "with_other_interpolation": lambda *_: prepared,
        "start_side_runs": side_runs,
    }.items():
        monkeypatch.setattr(identification_stages, name, stand_in)
    result = select(state)
    assert (result.selection, result.prepared, started) == (selection, prepared, [prepared])
    assert (result.context.split, result.context.fitter) == ("other data", "fitter of these")


@pytest.mark.parametrize(
    ("as_they_are", "refitted", "explains", "has_disturbance", "misfit", "is_likelier"),
    [
        (30.0, 30.0, True, False, 100.0, True),
        (-500.0, 30.0, False, False, 100.0, True),
        (-500.0, 30.0, False, False, 1000.0, False),
        (-500.0, 30.0, True, True, 1000.0, True),
        (-500.0, 30.0, True, False, 100.0, False),
        (-500.0, 10.0, False, False, 100.0, False),
        (10.0, 30.0, False, False, 100.0, False),
    ],
)
def test_other_speeds_are_judged_with_effects_fitted_anew_unless_the_residual_is_white(
    monkeypatch: pytest.MonkeyPatch,
    as_they_are: float,
    refitted: float,
    explains: bool,
    has_disturbance: bool,
    misfit: float,
    is_likelier: bool,
) -> None:
    """Gains in nats before and after the effects are fitted to the other data, of 20 or a tenth of what is missed."""
    state = with_effects("modulus", modulus=0.1)
    now, other = (SimpleNamespace(estimation=SimpleNamespace(name=name, rows=None)) for name in ("now", "other"))
    robot = replace(ROBOT, name="refitted")

    def log_likelihood(robot: Any, chosen: object, data: Any) -> float:
        return 1000.0 + (refitted if robot.name == "refitted" else as_they_are)

    innovations = SimpleNamespace(log_likelihood=lambda rows: 1000.0, misfit=lambda rows: misfit)
    fitter = SimpleNamespace(
        has_disturbance=has_disturbance,
        judged=lambda *_: innovations,
        log_likelihood=log_likelihood,
        fit_from=lambda *_: SimpleNamespace(robot=robot),
    )
    state = replace(state, context=replace(cast("Any", state.context), fitter=fitter, split=now))
    monkeypatch.setattr(Identification, "selection_explains", explains)
    assert _is_far_likelier(state, cast("Any", other)) == is_likelier
