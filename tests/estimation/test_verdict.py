"""The verdict beside a disturbance: sizes decide, and the largest effect is named first."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tautwire.estimation.disturbance import NEUTRAL, OrnsteinUhlenbeck
from tautwire.estimation.effect_estimates import effects_by_size
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.explained_shares import ExplainedShares
from tautwire.estimation.hypotheses import Hypothesis, hypotheses
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter
from tautwire.estimation.selection_result import SelectionResult
from tautwire.estimation.time_limit import TimeLimit
from tautwire.estimation.trace_result import FoundEffect, Verdict
from tautwire.estimation.verdict import verdict_beside_disturbance, verdict_of, verdict_of_ended_search
from tautwire.robot.schema import EffectSetting, Robot
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT, RECORDING = example("three"), recorded("three", 1)
NOISE = estimate_noise(ROBOT, RECORDING)
CONTEXT = IdentificationContext(ROBOT, Fitter(NOISE), split_data(ROBOT, NOISE, RECORDING, None))
MISSED = "90 N in tension_1, where noise leaves 2 N; it is strongest at 0.5 Hz"
REMAINING = "40 N in tension_2, where noise leaves 2 N; it is strongest at 1.2 Hz"


def hypothesis(name: str) -> Hypothesis:
    return next(each for each in hypotheses(ROBOT) if each.effect.name == name)


def shares(left: float, missed: float, **of_effects: tuple[float, float]) -> ExplainedShares:
    """Shares with (share, size) of each effect; what is left has its part of the mean square of what is missed."""
    parts, sizes = ([pair[k] for pair in of_effects.values()] for k in (0, 1))
    none = (0.0,) * len(parts)
    return ExplainedShares(tuple(parts), tuple(sizes), none, none, left, missed, missed * left**0.5, 0.0)


def selected(*accepted: Hypothesis, robot: Robot = ROBOT) -> SelectionResult:
    evidence, fit = (50.0,) * len(accepted), Fit.without_parameters(robot)
    return SelectionResult(accepted, evidence, fit, (), ())


def verdict(of: ExplainedShares, *names: str) -> tuple[str, str]:
    return verdict_beside_disturbance(CONTEXT, selected(*map(hypothesis, names)), of, MISSED, REMAINING)


def test_what_a_small_random_force_would_leave_lacks_nothing() -> None:
    word, sentence = verdict(shares(0.9, 4.0, drag=(0.1, 2.0)), "drag")
    assert word == "none"
    assert "Drag may act, too small to matter." in sentence


@pytest.mark.parametrize(
    ("force_to_weight", "error", "share", "word"),
    [
        (0.006, 2.0, 0.1, "none"),
        (0.02, 2.0, 0.1, "unexplained"),
        (0.006, 8.0, 0.1, "unexplained"),
        (0.006, 2.0, 0.4, "unexplained"),
    ],
)
def test_what_a_disturbance_of_usual_size_takes_up_lacks_nothing_however_well_it_is_seen(
    force_to_weight: float, error: float, share: float, word: str
) -> None:
    force = OrnsteinUhlenbeck(force_to_weight * ROBOT.platform.mass * ROBOT.gravity, 1.0)
    position, tension = (OrnsteinUhlenbeck(error * noise, 1.0) for noise in (NOISE.position, NOISE.tension))
    fitter = Fitter(replace(NOISE, disturbance=replace(NEUTRAL, force=force, position=position, tension=tension)))
    of = replace(shares(1.0 - share, 15.0, payload=(share, 8.0)), spreads=(0.5,))
    context, selection = replace(CONTEXT, fitter=fitter), selected(hypothesis("payload"))
    said, sentence = verdict_beside_disturbance(context, selection, of, MISSED, REMAINING)
    assert said == word
    assert MISSED in sentence
    assert verdict_beside_disturbance(context, selection, of, MISSED, REMAINING, True)[0] == "unexplained"


def test_an_effect_is_named_that_explains_a_good_part_of_little() -> None:
    word, sentence = verdict(shares(0.12, 6.0, drum=(0.27, 5.0)), "drum")
    assert word == "effects"
    remains = "12 % remains, in all no more than 8 standard deviations of one sample's noise."
    assert f"drum (27 % of what is missed); {remains}" in sentence
    assert sentence.endswith("The error is then 40 N in tension_2, where noise leaves 2 N; it is strongest at 1.2 Hz.")


def test_what_uncertain_numbers_explain_beside_the_one_effect_is_told() -> None:
    robot = replace(ROBOT, platform=replace(ROBOT.platform, mass_uncertainty=0.1))
    of = shares(0.12, 6.0, drum=(0.27, 5.0))
    _, sentence = verdict_beside_disturbance(
        replace(CONTEXT, robot=robot), selected(hypothesis("drum")), of, MISSED, REMAINING
    )
    assert "missed); 61 % lies within stated uncertainties, and 12 % remains, in all" in sentence


def test_shares_that_are_not_all_or_nothing_are_not_called_that() -> None:
    _, sentence = verdict(shares(0.002, 100.0, damping=(0.998, 99.0)), "damping")
    assert "damping (more than 99 % of what is missed); less than 1 % remains" in sentence


def test_the_largest_effect_is_named_first_with_its_share() -> None:
    both = shares(0.05, 60.0, damping=(0.2, 20.0), friction=(0.8, 50.0))
    word, sentence = verdict(both, "damping", "friction")
    assert word == "effects"
    assert sentence.index("friction (80 % of what is missed)") < sentence.index("damping (20 % of what is missed)")


def test_an_effect_is_named_although_more_than_noise_remains_and_that_is_said() -> None:
    word, sentence = verdict(shares(0.4, 60.0, friction=(0.6, 50.0)), "friction")
    assert word == "effects"
    assert f"40 % remains. The error is then {REMAINING}." in sentence


@pytest.mark.parametrize("names", [(), ("modulus",)])
def test_a_listed_effect_gets_no_credit_for_what_is_not_on_the_list(names: tuple[str, ...]) -> None:
    word, sentence = verdict(shares(0.9, 120.0, **dict.fromkeys(names, (0.1, 40.0))), *names)
    assert word == "unexplained"
    assert MISSED in sentence and REMAINING not in sentence
    assert all(name in sentence for name in names)


def test_what_is_not_on_the_list_is_discovered_with_its_share() -> None:
    frame = Hypothesis(BY_NAME["frame"], ROBOT.cable_numbers)
    robot = ROBOT.with_effect(EffectSetting("frame", {"compliance": 1e-5}, ROBOT.cable_numbers))
    of = shares(0.02, 60.0, frame=(0.98, 50.0))
    word, sentence = verdict_beside_disturbance(CONTEXT, selected(frame, robot=robot), of, MISSED, REMAINING)
    assert word == "discovered"
    assert "frame (98 % of what is missed); 2 % remains" in sentence
    assert "This effect is not on the list of known ones: frame: compliance = 1e-05 m/N." in sentence


@pytest.mark.parametrize(
    ("of_friction", "of_stiffening", "expected", "is_told"),
    [(0.3, 0.65, "discovered", True), (0.65, 0.3, "effects", True), (0.94, 0.01, "effects", False)],
)
def test_the_largest_effect_decides_whether_the_verdict_is_of_the_list(
    of_friction: float, of_stiffening: float, expected: str, is_told: bool
) -> None:
    stiffening = Hypothesis(BY_NAME["stiffening"], ROBOT.cable_numbers)
    robot = ROBOT.with_effect(EffectSetting("stiffening", {"quadratic": 114.2}, ROBOT.cable_numbers))
    of = shares(0.05, 60.0, friction=(of_friction, 50.0), stiffening=(of_stiffening, 50.0))
    selection = selected(hypothesis("friction"), stiffening, robot=robot)
    word, sentence = verdict_beside_disturbance(CONTEXT, selection, of, MISSED, REMAINING)
    assert word == expected
    assert ("not on the list of known ones: stiffening: quadratic = 114.2." in sentence) == is_told


def test_an_effect_whose_size_changes_from_stretch_to_stretch_gets_no_name() -> None:
    of = shares(0.45, 60.0, payload=(0.55, 40.0))
    assert verdict(of, "payload")[0] == "effects"
    word, sentence = verdict(replace(of, spreads=(0.47,)), "payload")
    assert word == "unexplained"
    assert "Of it 55 % would go to payload, which would have to change from stretch to stretch." in sentence


def test_an_effect_whose_time_constant_does_not_show_gets_no_name_and_leaves_the_others_theirs() -> None:
    of = shares(0.05, 60.0, relaxation=(0.9, 40.0))
    assert verdict(replace(of, time_deviations=(0.45,)), "relaxation")[0] == "effects"
    word, sentence = verdict(replace(of, time_deviations=(0.7,)), "relaxation")
    assert word == "unexplained"
    assert "would go to relaxation, whose time constant these recordings do not determine." in sentence
    both = replace(shares(0.05, 60.0, relaxation=(0.6, 40.0), drum=(0.4, 30.0)), time_deviations=(0.7, 0.0))
    word, sentence = verdict(both, "relaxation", "drum")
    assert word == "effects"
    assert "drum" in sentence and "relaxation" not in sentence


@pytest.mark.parametrize(("share", "size"), [(0.01, 9.0), (0.04, 9.0), (0.3, 0.5)])
def test_effects_of_a_small_share_or_below_noise_are_listed_apart(share: float, size: float) -> None:
    effects = [FoundEffect(name, "cable", (), {}, 50.0) for name in ("damping", "friction")]
    of = shares(0.05, 60.0, damping=(share, size), friction=(0.9, 50.0))
    accepted = [Hypothesis(BY_NAME[name], ()) for name in ("damping", "friction")]
    large, small = effects_by_size(effects, accepted, of, CONTEXT.policy.size)
    assert [(each.name, each.share) for each in large] == [("friction", 0.9)]
    assert [(each.name, each.share) for each in small] == [("damping", share)]
    word, sentence = verdict(of, "damping", "friction")
    assert word == "effects" and "damping" not in sentence


@pytest.mark.parametrize(("evidence", "is_small"), [(5_000.0, True), (20_000.0, False)])
def test_without_a_disturbance_an_effect_of_little_evidence_is_what_the_form_of_another_leaves(
    evidence: float, is_small: bool
) -> None:
    accepted = (hypothesis("friction"), hypothesis("sensor_gain"))
    selection = SelectionResult(accepted, (1e6, evidence), Fit.without_parameters(ROBOT), (), ())
    large = selection.substantial(CONTEXT.policy.selection)
    word, sentence = verdict_of(ROBOT, selection, large, True, None, False)
    assert word == "effects"
    assert ("The model lacks friction; with it and sensor_gain, too small to matter" in sentence) == is_small
    assert ("friction and sensor_gain; with them, the residual" in sentence) == (not is_small)


@pytest.mark.parametrize(
    ("evidence", "expected", "is_told"),
    [((2e4, 1e6), "discovered", True), ((1e6, 2e4), "effects", True), ((1e6, 5e3), "effects", False)],
)
def test_without_a_disturbance_the_effect_of_most_evidence_decides_whether_the_verdict_is_of_the_list(
    evidence: tuple[float, float], expected: str, is_told: bool
) -> None:
    frame = Hypothesis(BY_NAME["frame"], ROBOT.cable_numbers)
    robot = ROBOT.with_effect(EffectSetting("frame", {"compliance": 1e-5}, ROBOT.cable_numbers))
    selection = SelectionResult((hypothesis("friction"), frame), evidence, Fit.without_parameters(robot), (), ())
    large = selection.substantial(CONTEXT.policy.selection)
    word, sentence = verdict_of(ROBOT, selection, large, True, None, False)
    assert word == expected
    assert ("not on the list of known ones: frame: compliance = 1e-05 m/N." in sentence) == is_told


def test_effects_that_nearly_cancel_each_other_get_no_name() -> None:
    of = shares(0.03, 44.0, payload=(0.97, 170.0), sensor_offset=(0.97, 170.0))
    assert verdict(of, "payload", "sensor_offset")[0] == "effects"
    word, sentence = verdict(replace(of, sizes=(415.0, 380.0)), "payload", "sensor_offset")
    assert word == "unexplained"
    assert "would go to payload and sensor_offset" in sentence
    assert sentence.endswith(", which would nearly cancel each other.")


def test_an_effect_that_uncertain_numbers_imitate_well_cancels_none() -> None:
    of = shares(0.02, 28.0, payload=(0.98, 121.0))
    assert verdict(of, "payload")[0] == "unexplained"
    assert verdict(replace(of, size_together=121.0), "payload")[0] == "effects"


@pytest.mark.parametrize(
    ("word", "is_little_missed", "told", "sentence"),
    [
        ("none", False, "unexplained", "The search ended at its time limit of 600 s; until then nothing was found"),
        ("none", True, "none", "Little is missed. The search ended at its time limit of 600 s, before all was tried."),
        (
            "unexplained",
            True,
            "unexplained",
            "The search ended at its time limit of 600 s. Until then: little is missed",
        ),
        ("effects", True, "effects", "Little is missed. The search ended at its time limit of 600 s, before all was"),
    ],
)
def test_a_search_that_ended_early_says_none_only_of_what_is_little_after_each_effect_was_tried(
    word: Verdict, is_little_missed: bool, told: str, sentence: str
) -> None:
    limit, verdict = TimeLimit(600.0), (word, "Little is missed.")
    assert verdict_of_ended_search(verdict, limit, is_little_missed) == verdict
    limit.leave_untried("There was no time for effects.")
    shown = verdict_of_ended_search(verdict, limit, is_little_missed)
    assert shown[0] == told and shown[1].startswith(sentence)
