"""Scores of a round against its baseline, and which candidates it fits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from tautwire.estimation import candidate_scoring
from tautwire.estimation.candidate_proposals import FitTask, SearchRound
from tautwire.estimation.candidate_scores import CandidateScore
from tautwire.estimation.disturbance import OrnsteinUhlenbeck
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter
from tautwire.estimation.score_test import PredictedGain
from tautwire.robot.schema import Robot
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example


def of_one_recording() -> IdentificationContext:
    robot, recording = example("three"), recorded("three", 1)
    noise = estimate_noise(robot, recording)
    return IdentificationContext(robot, Fitter(noise), split_data(robot, noise, recording, None))


@pytest.mark.parametrize(("evidence", "expected"), [(5.0, 5.0), (50.0, 10.0), (5000.0, 5000.0)])
def test_a_coarse_baseline_is_made_exact_where_it_decides(
    evidence: float, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = of_one_recording()
    robot = context.robot
    hypothesis = Hypothesis(BY_NAME["drag"], ())
    score = CandidateScore(hypothesis, Fit.without_parameters(robot), evidence, 1.0)
    monkeypatch.setattr(candidate_scoring, "maximised_validation_likelihood", lambda *_: 1040.0)
    search_round = SearchRound(1, robot, (), None, is_white=True, has_disturbance=False)
    scores = candidate_scoring._with_exact_baseline(context, search_round, 1000.0, {hypothesis: score})
    assert scores[hypothesis].evidence == expected


@pytest.mark.parametrize(
    ("best_on_fit", "evidence", "accepted", "is_refitted"),
    [
        ("payload", {"payload": 950.0, "relaxation": 1000.0}, (), False),
        ("relaxation", {"payload": 950.0, "relaxation": 1000.0}, (), True),
        ("payload", {"payload": 950.0, "drag": 2000.0}, (), True),
        ("payload", {"payload": 3.0, "drag": 2.0}, (), True),
        ("relaxation", {"relaxation": 1000.0, "payload": 600.0}, (), True),
        ("relaxation", {"relaxation": 1000.0, "payload": 600.0}, (Hypothesis(BY_NAME["sag"], (1,)),), False),
        ("relaxation", {"relaxation": 1000.0, "payload": 400.0}, (), False),
        ("payload", {"relaxation": 600.0, "payload": 1000.0}, (), False),
    ],
)
def test_candidates_get_own_disturbances_unless_fit_and_check_agree_on_the_best_without_a_simpler_rival(
    best_on_fit: str,
    evidence: dict[str, float],
    accepted: tuple[Hypothesis, ...],
    is_refitted: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot, recording = example("three"), recorded("three", 1)
    noise = estimate_noise(robot, recording)
    split = split_data(robot, noise, recording, None)
    scores: dict[Hypothesis, CandidateScore] = {}
    refitted: list[Hypothesis] = []
    context = IdentificationContext(robot, Fitter(noise), split)
    for name, nats in evidence.items():
        hypothesis = Hypothesis(BY_NAME[name], (1, 2, 3) if name == "relaxation" else ())
        fit = Fit.without_parameters(robot.with_effect(hypothesis.setting(robot)))
        scores[hypothesis] = CandidateScore(hypothesis, fit, nats, 1.0, explained=float(name == best_on_fit))
    monkeypatch.setattr(candidate_scoring, "fit_candidates", lambda _, __, tasks, *___: refitted.extend(tasks) or {})
    candidate_scoring._refitted_beside_own_disturbance(context, "round 1", accepted, scores, 0.0)
    assert [each.effect.name for each in refitted] == ([best_on_fit, *(set(evidence) - {best_on_fit})] * is_refitted)


@pytest.mark.parametrize(
    ("evidence", "misses_much", "refit_evidence", "is_better"),
    [(3.0, True, 900.0, True), (3.0, True, 2.0, False), (1000.0, True, 1100.0, False), (3.0, False, 900.0, False)],
)
def test_what_is_likeliest_beside_a_small_disturbance_is_fitted_beside_it_if_nothing_else_explains_what_is_missed(
    evidence: float, misses_much: bool, refit_evidence: float, is_better: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = of_one_recording()
    robot, names = context.robot, ("drum", "payload", "drag")
    large = replace(disturbance_prior(robot, context.fitter.noise).median, force=OrnsteinUhlenbeck(100.0, 0.05))
    context = replace(context, fitter=context.fitter.with_disturbance(large))
    drum, payload, drag = (Hypothesis(BY_NAME[name], (1, 2, 3) if name == "drum" else ()) for name in names)
    ratios = [replace(drum.setting(robot), values={"radius_ratio": ratio}) for ratio in (1.01, 1.05)]
    starts = {h: (robot.with_effect(h.setting(robot)),) for h in (payload, drag)}
    starts[drum] = tuple(robot.with_effect(setting) for setting in ratios)
    scores = {
        h: CandidateScore(h, Fit.without_parameters(robots[0]), evidence, 1.0, explained=7.0)
        for h, robots in starts.items()
    }
    likelihoods = {starts[drum][1]: 500.0, starts[payload][0]: 400.0}
    tried: list[tuple[Robot, bool]] = []

    def log_likelihood(fitter: Fitter, robot: Robot, *_: object) -> float:
        assert fitter.noise.disturbance == disturbance_prior(robot, fitter.noise).median
        return likelihoods.get(robot, 300.0)

    def fitted(beside: IdentificationContext, _: str, tasks: dict[Hypothesis, FitTask], *__: object) -> object:
        tried.extend((task.starts[0], beside.fitter.noise.disturbance == large) for task in tasks.values())
        return {h: replace(scores[h], evidence=refit_evidence, explained=8.0) for h in tasks}

    monkeypatch.setattr(candidate_scoring, "_misses_much", lambda _: misses_much)
    monkeypatch.setattr(candidate_scoring, "finite_log_likelihood", log_likelihood)
    monkeypatch.setattr(candidate_scoring, "fit_candidates", fitted)
    refits = candidate_scoring._refitted_beside_small_disturbance(context, "round 1", starts, scores, 0.0)
    better = {h: replace(scores[h], evidence=refit_evidence) for h in (drum, payload)}
    assert refits == (better if is_better else {})
    is_tried = evidence < 1000.0 and misses_much
    assert tried == ([(starts[drum][1], False), (starts[payload][0], False)] if is_tried else [])


@pytest.mark.parametrize(("effects", "misses_much"), [(None, False), ({"payload": {"mass": 30.0}}, True)], ids=str)
def test_a_robot_misses_much_if_its_sensors_show_it(effects: dict[str, Any] | None, misses_much: bool) -> None:
    robot, recording = example("three"), recorded("three", 1, effects)
    noise = estimate_noise(robot, recording)
    fitter = Fitter(replace(noise, disturbance=disturbance_prior(robot, noise).median))
    context = IdentificationContext(robot, fitter, split_data(robot, noise, recording, None))
    assert candidate_scoring._misses_much(context) == misses_much


@pytest.mark.parametrize("accepted", [(), (Hypothesis(BY_NAME["sag"], (1,)),)], ids=["first round", "later"])
def test_other_disturbances_and_optima_are_tried_in_the_first_round_alone(
    accepted: tuple[Hypothesis, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    context, tried = of_one_recording(), list[str]()
    search_round = SearchRound(1, context.robot, accepted, None, is_white=True, has_disturbance=True)
    monkeypatch.setattr(Fitter, "log_likelihood", lambda *_: 0.0)
    monkeypatch.setattr(candidate_scoring, "coarse_validation_likelihood", lambda *_: 0.0)
    monkeypatch.setattr(candidate_scoring, "fit_candidates", lambda *_: {})
    for name in ("_refitted_beside_small_disturbance", "_refitted_at_other_optima"):
        monkeypatch.setattr(candidate_scoring, name, lambda *_, name=name: tried.append(name) or {})
    candidate_scoring._scores_beside_disturbance(context, "round 1", search_round, {})
    assert len(tried) == (0 if accepted else 2)


@pytest.mark.parametrize(
    ("is_astray", "refit_evidence", "is_replaced"),
    [(True, 900.0, True), (True, 700.0, False), (False, 900.0, False)],
)
def test_a_rival_that_was_led_astray_replaces_the_best_if_it_explains_more_at_its_own_optimum(
    is_astray: bool, refit_evidence: float, is_replaced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = of_one_recording()
    robot = context.robot
    best, rival = (Hypothesis(BY_NAME[name], (1, 2, 3)) for name in ("relaxation", "hysteresis"))
    starts = {h: (robot.with_effect(h.setting(robot)),) for h in (best, rival)}
    fits = {h: Fit.without_parameters(robots[0]) for h, robots in starts.items()}
    scores = {h: CandidateScore(h, fits[h], e, 1.0) for h, e in ((best, 500.0), (rival, 300.0))}
    refits = {h: CandidateScore(h, fits[h], e, 1.0) for h, e in ((best, 800.0), (rival, refit_evidence))}
    elsewhere = robot.with_effect(replace(rival.setting(robot), values={"force": 99.0, "yield_strain": 1e-3}))
    begun: list[Robot] = []

    def optimum(_: Fitter, task: FitTask, *__: object) -> Robot | None:
        return elsewhere if is_astray and task.chosen == (rival,) else None

    def fitted(_: object, __: str, tasks: dict[Hypothesis, FitTask], *___: object) -> dict[Hypothesis, CandidateScore]:
        begun.extend(task.starts[0] for task in tasks.values())
        return refits

    monkeypatch.setattr(candidate_scoring, "fit_at_another_optimum", optimum)
    monkeypatch.setattr(candidate_scoring, "fit_candidates", fitted)
    assert candidate_scoring._refitted_at_other_optima(context, "round 1", starts, scores, 0.0) == (
        refits if is_replaced else {}
    )
    assert begun == ([starts[best][0], elsewhere] if is_astray else [])


@pytest.mark.validate
def test_an_effect_that_a_large_disturbance_takes_up_is_a_candidate() -> None:
    """A slow force as large as the load leaves nothing of it to the score test."""
    robot, recording = example("three"), recorded("three", 1, {"payload": {"mass": 3.0}}).first(400)
    noise = estimate_noise(robot, recording)
    small = disturbance_prior(robot, noise).median
    large = replace(small, force=OrnsteinUhlenbeck(100.0, 0.05))
    fitter = Fitter(replace(noise, disturbance=large))
    context = IdentificationContext(robot, fitter, split_data(robot, noise, recording, None))
    payload = Hypothesis(BY_NAME["payload"], ())
    search_round = SearchRound(1, robot, (), None, is_white=True, has_disturbance=True)
    under_large, under_small = candidate_scoring._predict_gains(context, search_round)
    assert under_small[payload].gain > 10.0 * max(under_large[payload].gain, 1.0)
    assert under_small[payload].values["mass"] == pytest.approx(3.0, rel=0.2)


@pytest.mark.validate
def test_a_long_delay_is_predicted_although_the_slope_asks_for_a_short_one() -> None:
    robot, recording = example("three"), recorded("three", 1, {"sensor_delay": {"seconds": 0.17}}).first(600)
    noise = estimate_noise(robot, recording)
    fitter = Fitter(replace(noise, disturbance=disturbance_prior(robot, noise).median))
    context = IdentificationContext(robot, fitter, split_data(robot, noise, recording, None))
    late = Hypothesis(BY_NAME["sensor_delay"], (1, 2, 3), ("tension_delay",))
    search_round = SearchRound(1, robot, (), None, is_white=True, has_disturbance=True)
    for predictions in candidate_scoring._predict_gains(context, search_round):
        assert predictions[late].values["tension_delay"] == pytest.approx(0.17, abs=0.011)


@pytest.mark.validate
def test_fits_beside_a_disturbance_begin_where_runs_of_the_model_explain_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slopes ask for a delay of a few milliseconds where it is longer than half a period of a mode."""
    robot, recording = example("three"), recorded("three", 1, {"sensor_delay": {"seconds": 0.17}}).first(600)
    noise = estimate_noise(robot, recording)
    fitter = Fitter(replace(noise, disturbance=disturbance_prior(robot, noise).median))
    context = IdentificationContext(robot, fitter, split_data(robot, noise, recording, None))
    late = Hypothesis(BY_NAME["sensor_delay"], (1, 2, 3), ("tension_delay",))
    predictions = {late: PredictedGain(100.0, {"tension_delay": 0.002})}
    begun: dict[Hypothesis, tuple[Robot, ...]] = {}
    monkeypatch.setattr(candidate_scoring, "_predict_gains", lambda *_: (dict(predictions), {}))
    monkeypatch.setattr(candidate_scoring, "_scores_beside_disturbance", lambda *asked: begun.update(asked[3]) or {})
    search_round = SearchRound(1, robot, (), None, is_white=True, has_disturbance=True)
    candidate_scoring.score_candidates(context, search_round)
    assert begun[late][0].effects[0].values["tension_delay"] == pytest.approx(0.17, abs=0.011)


@pytest.mark.parametrize("has_disturbance", [True, False])
def test_a_round_beside_a_disturbance_has_the_shortlist_for_it(
    has_disturbance: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, recording = example("three"), recorded("three", 1)
    noise = estimate_noise(robot, recording)
    fitter: Any = SimpleNamespace(has_disturbance=has_disturbance)
    context = IdentificationContext(robot, fitter, split_data(robot, noise, recording, None))
    gains = {(1, 2, 3): 90.0, (1,): 80.0, (2,): 70.0, (3,): 60.0}
    slack = {Hypothesis(BY_NAME["slack"], cables): gain for cables, gain in gains.items()}
    predictions = {hypothesis: PredictedGain(gain, {"softness": 100.0}) for hypothesis, gain in slack.items()}
    begun: list[Hypothesis] = []
    for name in ("_scores_beside_disturbance", "_scores_beside_noise"):
        monkeypatch.setattr(candidate_scoring, name, lambda *asked: begun.extend(asked[3]) or {})
    monkeypatch.setattr(candidate_scoring, "_predict_gains", lambda *_: (dict(predictions), {}))
    monkeypatch.setattr(candidate_scoring, "grid_search", lambda *_: {})
    candidate_scoring.score_candidates(context, SearchRound(1, robot, (), None, True, has_disturbance))
    assert len(begun) == (2 if has_disturbance else 3)


@pytest.mark.parametrize(
    ("mean_square", "evidence_otherwise", "has_other", "is_otherwise"),
    [
        (1.2, 1030.0, True, True),
        (1.2, 1010.0, True, False),
        (9.0, 1030.0, True, False),
        (1.2, None, True, False),
        (1.0, 1030.0, True, False),
        (1.2, 1030.0, False, False),
    ],
)
def test_winch_speeds_are_interpolated_otherwise_where_the_best_effects_are_far_likelier_so(
    monkeypatch: pytest.MonkeyPatch,
    mean_square: float,
    evidence_otherwise: float | None,
    has_other: bool,
    is_otherwise: bool,
) -> None:
    context = of_one_recording()
    robot = context.robot
    other = replace(context.split, notes=("cubic",))
    fit = Fit.without_parameters(robot)
    names = ("relaxation", "relaxation", "damping", "creep", "slack", "friction")
    evidence = (1000.0, 900.0, 500.0, 400.0, 0.0, 300.0)
    scores = [
        CandidateScore(Hypothesis(BY_NAME[name], (number,)), fit, nats, mean_square if nats else float("nan"))
        for number, (name, nats) in enumerate(zip(names, evidence, strict=True))
    ]

    def refitted(
        context: IdentificationContext, label: str, tasks: dict[Hypothesis, FitTask], data: object, baseline: float
    ) -> dict[Hypothesis, CandidateScore]:
        assert [h.effect.name for h in tasks] == ["relaxation", "damping", "creep"]
        assert context.split is other
        likeliest = [h for h in tasks if h.effect.name == "damping" and evidence_otherwise]
        return {h: CandidateScore(h, fit, evidence_otherwise or 0.0, 1.0) for h in likeliest}

    monkeypatch.setattr(candidate_scoring, "fit_candidates", refitted)
    monkeypatch.setattr(candidate_scoring, "split_with_other_interpolation", lambda split: other if has_other else None)
    assert candidate_scoring.likelier_interpolation(context, scores) is (other if is_otherwise else None)
