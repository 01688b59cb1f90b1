"""Which prospects are worth a fit, and which of the fitted is the simplest."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.estimation.candidate_proposals import shortlist
from tautwire.estimation.candidate_scores import (
    CandidateScore,
    load_before_offsets,
    misfitted_rival,
    most_parsimonious,
    unfitted_score,
    without_fast_relaxations,
)
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.parameter_fit import Fit
from tautwire.estimation.policy import ScoreTestPolicy, SelectionPolicy
from tautwire.estimation.score_test import PredictedGain
from tautwire.robot.schema import EffectSetting
from tautwire_fmu.laws.effects import ALL, BY_NAME
from tests.support.robots import example

ROBOT = example("three")
ONE_OF_EACH = [Hypothesis(effect, (1,)) for effect in ALL]


def promised(ranked: list[Hypothesis], best: float = 100.0) -> dict[Hypothesis, PredictedGain]:
    """Prospects that gain less, the later they are in the list."""
    return {hypothesis: PredictedGain(best - place, {}) for place, hypothesis in enumerate(ranked)}


def test_the_best_are_fitted_and_no_more() -> None:
    assert shortlist(promised(ONE_OF_EACH)) == ONE_OF_EACH[: ScoreTestPolicy.max_fits]


def test_no_effect_takes_all_places() -> None:
    damping = [Hypothesis(BY_NAME["damping"], (cable,)) for cable in (1, 2, 3)]
    damping.append(Hypothesis(BY_NAME["damping"], (1, 2, 3)))
    worth = shortlist(promised([*damping, Hypothesis(BY_NAME["payload"], ())]))
    assert worth == [*damping[: ScoreTestPolicy.max_fits_per_effect], Hypothesis(BY_NAME["payload"], ())]


def test_beside_a_disturbance_and_all_cables_few_single_ones_of_an_effect_are_fitted() -> None:
    slack = [Hypothesis(BY_NAME["slack"], cables) for cables in ((1, 2, 3), (2,), (3,), (1,))]
    sag = Hypothesis(BY_NAME["sag"], (1, 2, 3))
    assert shortlist(promised([*slack, sag])) == [*slack[:3], sag]
    assert shortlist(promised([*slack, sag]), has_disturbance=True) == [*slack[:2], sag]
    singles = [Hypothesis(BY_NAME["anchor"], (cable,)) for cable in (2, 1, 3)]
    assert shortlist(promised([*singles, sag]), has_disturbance=True) == [*singles, sag]


def test_what_has_next_to_no_score_is_not_fitted() -> None:
    first, second, third = ONE_OF_EACH[:3]
    assert shortlist(
        {first: PredictedGain(1e4, {}), second: PredictedGain(100.0, {}), third: PredictedGain(300.0, {})}
    ) == [
        first,
        third,
    ]
    assert shortlist({first: PredictedGain(3.0, {})}) == []


def test_another_look_puts_its_best_in_the_place_of_the_last() -> None:
    beside = [*reversed(ONE_OF_EACH)]
    worth = shortlist(promised(ONE_OF_EACH), promised(beside))
    assert len(worth) == ScoreTestPolicy.max_fits
    assert worth == [*ONE_OF_EACH[: ScoreTestPolicy.max_fits - 3], *beside[:3]]


def test_another_look_at_the_same_changes_nothing() -> None:
    assert shortlist(promised(ONE_OF_EACH), promised(ONE_OF_EACH)) == ONE_OF_EACH[: ScoreTestPolicy.max_fits]


def test_the_policy_says_how_many_are_fitted() -> None:
    policy = ScoreTestPolicy(max_fits=3, max_rough_fits=1, min_predicted_gain=99.5)
    assert shortlist(promised(ONE_OF_EACH), policy=policy) == ONE_OF_EACH[:1]
    assert shortlist(promised(ONE_OF_EACH, 1000.0), policy=policy) == ONE_OF_EACH[:3]


def test_of_those_alike_the_one_with_fewest_parameters_is_simplest() -> None:
    fit = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0)))
    relaxation, damping = (Hypothesis(BY_NAME[name], (1,)) for name in ("relaxation", "damping"))
    better = CandidateScore(relaxation, fit, 100.0, 1.0)
    policy = SelectionPolicy()
    near, far = (CandidateScore(damping, fit, 100.0 - share * policy.tie_nats, 1.0) for share in (0.5, 2.0))
    assert most_parsimonious([better, near], policy) is near
    assert most_parsimonious([better, far], policy) is better
    assert most_parsimonious([], policy) is None


def test_beside_a_disturbance_no_form_is_exact_so_that_a_tenth_of_the_evidence_ties() -> None:
    fit = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0)))
    relaxation, damping = (Hypothesis(BY_NAME[name], (1,)) for name in ("relaxation", "damping"))
    better = CandidateScore(relaxation, fit, 1000.0, 1.0)
    near, far = (CandidateScore(damping, fit, evidence, 1.0) for evidence in (910.0, 890.0))
    assert most_parsimonious([better, near], SelectionPolicy(), has_disturbance=True) is near
    assert most_parsimonious([better, far], SelectionPolicy(), has_disturbance=True) is better
    assert most_parsimonious([better, near], SelectionPolicy()) is better


def test_of_those_alike_one_of_the_list_is_taken() -> None:
    fit = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0)))
    load, payload = (Hypothesis(BY_NAME[name], ()) for name in ("hanging_load", "payload"))
    better = CandidateScore(load, fit, 1000.0, 1.0)
    near, far = (CandidateScore(payload, fit, evidence, 1.0) for evidence in (910.0, 890.0))
    assert most_parsimonious([better, near], SelectionPolicy(), has_disturbance=True) is near
    assert most_parsimonious([better, far], SelectionPolicy(), has_disturbance=True) is better


def test_a_rival_that_may_be_misfitted_is_nonlinear_strong_and_of_another_effect() -> None:
    fit, policy = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0))), SelectionPolicy()
    evidences = {"relaxation": 1000.0, "modulus": 900.0, "hysteresis": 210.0, "slack": 190.0}
    scores = [CandidateScore(Hypothesis(BY_NAME[name], (1, 2, 3)), fit, e, 1.0) for name, e in evidences.items()]
    relaxation, _, hysteresis, slack = scores
    assert misfitted_rival(relaxation, scores, policy) is hysteresis
    assert misfitted_rival(relaxation, [relaxation, slack], policy) is None
    assert misfitted_rival(hysteresis, scores[:3], policy) is None


@pytest.mark.parametrize("load", ["hanging_load", "payload"])
def test_offsets_of_several_load_cells_have_to_explain_more_than_a_load(load: str) -> None:
    fit, offset = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0))), BY_NAME["sensor_offset"]

    def score(hypothesis: Hypothesis, evidence: float) -> CandidateScore:
        return CandidateScore(hypothesis, fit, evidence, 1.0)

    near, far = (score(Hypothesis(BY_NAME[load], ()), evidence) for evidence in (165.0, 155.0))
    all_cells, one_cell = (score(Hypothesis(offset, cables), 200.0) for cables in ((1, 2, 3), (2,)))
    tracker = score(
        Hypothesis(offset, (1, 2, 3), ("position_offset_x", "position_offset_y", "position_offset_z")), 200.0
    )
    assert load_before_offsets(all_cells, [all_cells, near], 40.0) is near
    assert load_before_offsets(all_cells, [all_cells, far], 40.0) is all_cells
    assert load_before_offsets(one_cell, [one_cell, near], 40.0) is one_cell
    assert load_before_offsets(tracker, [tracker, near], 40.0) is tracker


def test_a_load_that_is_not_significant_takes_no_place() -> None:
    fit = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0)))
    load = CandidateScore(Hypothesis(BY_NAME["hanging_load"], ()), fit, 38.0, 1.0)
    all_cells = CandidateScore(Hypothesis(BY_NAME["sensor_offset"], (1, 2, 3)), fit, 45.0, 1.0)
    assert load_before_offsets(all_cells, [all_cells, load], 40.0) is all_cells


def test_an_effect_is_confusable_with_what_explains_as_much_or_with_more_parameters_more() -> None:
    fit = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0)))
    relaxation, damping = (Hypothesis(BY_NAME[name], (1,)) for name in ("relaxation", "damping"))
    simple, policy = CandidateScore(damping, fit, 100.0, 1.0), SelectionPolicy()
    margins = (-2.0 * policy.tie_nats, -0.5 * policy.tie_nats, 0.5 * policy.tie_nats, 2.0 * policy.tie_nats)
    alike = [CandidateScore(damping, fit, 100.0 + margin, 1.0) for margin in margins]
    larger = [CandidateScore(relaxation, fit, 100.0 + margin, 1.0) for margin in margins]
    assert [simple.is_confusable_with(each, policy) for each in alike] == [False, True, True, True]
    assert [simple.is_confusable_with(each, policy) for each in larger] == [False, False, False, True]


@pytest.mark.parametrize(
    ("time", "evidence_of_damping", "cables_of_damping", "is_damping"),
    [
        (0.004, 600.0, (1, 2, 3), True),
        (0.02, 600.0, (1, 2, 3), False),
        (0.004, 400.0, (1, 2, 3), False),
        (0.004, 600.0, (1,), False),
    ],
)
@pytest.mark.parametrize("is_accepted", [False, True])
def test_a_relaxation_within_a_sample_is_damping(
    time: float, evidence_of_damping: float, cables_of_damping: tuple[int, ...], is_damping: bool, is_accepted: bool
) -> None:
    fit_of_damping = Fit(ROBOT, (), np.zeros(0), np.zeros((0, 0)))
    relaxed = ROBOT.with_effect(EffectSetting("relaxation", {"modulus": 1e12, "time": time}, (1, 2, 3)))
    relaxation = Hypothesis(BY_NAME["relaxation"], (1, 2, 3), ("modulus", "time"))
    fast = CandidateScore(relaxation, Fit(relaxed, (), np.zeros(0), np.zeros((0, 0))), 1000.0, 1.0)
    damping = CandidateScore(
        Hypothesis(BY_NAME["damping"], cables_of_damping), fit_of_damping, evidence_of_damping, 1.0
    )
    robot, scores = ROBOT, [damping, fast]
    if is_accepted:
        robot, scores = ROBOT.with_effect(EffectSetting("damping", {"damping": 1e9}, cables_of_damping)), [fast]
        is_damping = time < 0.01 and cables_of_damping == (1, 2, 3)
    kept = without_fast_relaxations(scores, robot, 0.01, SelectionPolicy())
    assert kept == [score for score in scores if score is not fast or not is_damping]


def test_a_relaxation_that_was_not_fitted_has_no_time() -> None:
    unfitted = unfitted_score(ROBOT, Hypothesis(BY_NAME["relaxation"], (1,)), PredictedGain(0.0, {"time": 0.001}))
    robot = ROBOT.with_effect(EffectSetting("damping", {"damping": 1e9}, (1,)))
    assert without_fast_relaxations([unfitted], robot, 0.01, SelectionPolicy()) == [unfitted]
