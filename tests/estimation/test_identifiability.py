"""What a recording could have shown, held to what fits of recordings with something in them really gain."""

from math import inf, sqrt

import numpy as np
import pytest

from tautwire.estimation import identifiability
from tautwire.estimation.effect_sensitivities import SensitivityColumn
from tautwire.estimation.estimation_data import DataSplit, split_data
from tautwire.estimation.hypotheses import Hypothesis, hypotheses
from tautwire.estimation.identifiability import analyse_identifiability, column_indices, separation_nats
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.score_test import ScoreStatistics
from tautwire.estimation.trace_result import Detectable, Identifiability
from tautwire.robot.schema import Robot
from tautwire_fmu.laws.effects import DAMPING, DRUM, MODULUS, PAYLOAD, RELAXATION, SLACK
from tests.support.recordings import recorded
from tests.support.robots import example

THREE = example("three")
ALL = (1, 2, 3)


def shown_by(
    robot: Robot, effects: dict[str, dict[str, float]], seed: int
) -> tuple[Identifiability, Fitter, DataSplit]:
    fit, check = recorded("three", seed, effects), recorded("three", seed + 50, effects)
    noise = estimate_noise(robot, fit)
    evidence, fitter = split_data(robot, noise, fit, check), Fitter(noise)
    return analyse_identifiability(IdentificationContext(robot, fitter, evidence), robot, ()), fitter, evidence


def size_of(found: Identifiability, name: str, parameter: str) -> Detectable:
    return next(d for d in found.detectable if (d.name, d.parameter) == (name, parameter) and d.cables in ((), ALL))


@pytest.mark.validate
def test_an_effect_of_that_size_gains_what_the_threshold_asks_for() -> None:
    hypothesis = Hypothesis(PAYLOAD, ())
    found, _, _ = shown_by(THREE, {}, 11)
    size = size_of(found, "payload", "mass")
    threshold = np.log(len(hypotheses(THREE)) / 0.01)
    gains = []
    for seed in (12, 13, 14, 15):
        _, fitter, evidence = shown_by(THREE, {"payload": {"mass": size.size}}, seed)
        start = THREE.with_effect(hypothesis.setting(THREE))
        fit = fitter.fit_from([start], [hypothesis], evidence.estimation)
        whole = fitter.judged(fit.robot, [hypothesis], evidence.validation).log_likelihood(evidence.validation.rows)
        without = fitter.innovations(THREE, evidence.validation).log_likelihood(evidence.validation.rows)
        gains.append(whole - without)
    # 1.28 standard deviations of sqrt(2 gain) above the threshold on average, which is the power asked for.
    expected = sqrt(2.0 * threshold) + 1.28
    assert np.mean(np.sqrt(2.0 * np.array(gains))) == pytest.approx(expected, abs=1.3)


@pytest.mark.validate
def test_sizes_are_given_for_every_effect_and_never_beyond_its_bounds() -> None:
    found, _, _ = shown_by(THREE, {}, 11)
    assert {d.name for d in found.detectable} == {h.effect.name for h in hypotheses(THREE)}
    assert all(d.size > 0.0 for d in found.detectable)
    assert size_of(found, "payload", "mass").size < 1.0


def separation_beside(hypothesis: Hypothesis, value: float) -> Identifiability:
    """Of recordings that hide an effect of one parameter, by the model that has it."""
    (name,) = hypothesis.form
    fit, check = (recorded("three", seed, {hypothesis.effect.name: {name: value}}) for seed in (3, 53))
    noise = estimate_noise(THREE, fit)
    robot = THREE.with_effect(hypothesis.setting(THREE, {name: value}))
    context = IdentificationContext(THREE, Fitter(noise), split_data(THREE, noise, fit, check))
    return analyse_identifiability(context, robot, [hypothesis])


@pytest.mark.validate
def test_relaxation_that_is_fast_looks_like_damping_and_payload_does_not() -> None:
    found = separation_beside(Hypothesis(DAMPING, ALL), 9e8)
    alike = {(each.other, each.other_cables): each for each in found.confusable}
    assert alike[RELAXATION.name, ALL].cosine > 0.95
    assert (PAYLOAD.name, ()) not in alike
    assert (DAMPING.name, ALL) not in alike
    assert all(0.9 <= each.cosine <= 1.0 and each.nats >= 0.0 for each in found.confusable)


@pytest.mark.validate
def test_slow_relaxation_can_hardly_be_told_from_modulus() -> None:
    found = separation_beside(Hypothesis(MODULUS, ALL), 1.12e11)
    assert found.confusable[0].other == RELAXATION.name
    assert found.confusable[0].cosine > 0.999


@pytest.mark.validate
def test_a_size_that_slopes_cannot_see_is_found_by_runs() -> None:
    found, _, _ = shown_by(THREE, {}, 11)
    size = size_of(found, "slack", "softness").size
    hypothesis = Hypothesis(SLACK, ALL)
    threshold = np.log(len(hypotheses(THREE)) / 0.01)
    gains = []
    for share in (1.0, 0.5):
        _, fitter, evidence = shown_by(THREE, {"slack": {"softness": share * size}}, 12)
        without = fitter.innovations(THREE, evidence.validation).log_likelihood(evidence.validation.rows)
        true = THREE.with_effect(hypothesis.setting(THREE, {"softness": share * size}))
        gains.append(
            fitter.judged(true, [hypothesis], evidence.validation).log_likelihood(evidence.validation.rows) - without
        )
    assert gains[0] > threshold > 5.0 * gains[1]


def test_several_steps_are_separated_from_an_effect_at_once() -> None:
    damping, payload = Hypothesis(DAMPING, ALL), Hypothesis(PAYLOAD, ())
    columns = tuple(SensitivityColumn(h.effect.name, h.cables, h.form[0], 0) for h in (damping, payload))
    statistics = ScoreStatistics(columns, np.zeros(2), np.array([[2.0, 1.0], [1.0, 2.0]]), np.zeros(2))
    steps = np.array([[1.0, 0.0, 2.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
    assert separation_nats(statistics, steps, payload) == pytest.approx([0.75, 0.0, 3.0, 0.0])


def test_columns_of_an_effect_are_found_in_whatever_order_the_robot_has_them() -> None:
    drum = Hypothesis(DRUM, ALL, ("radius_ratio", "slip"))
    columns = [SensitivityColumn("drum", ALL, name, 0) for name in drum.form]
    columns += [SensitivityColumn("payload", (), "mass", 0), SensitivityColumn("damping", ALL, "damping", 0)]
    statistics = ScoreStatistics(tuple(columns), np.zeros(4), np.eye(4), np.zeros(4))
    assert column_indices(statistics, [Hypothesis(PAYLOAD, ()), drum]) == [[2], [0, 1]]


@pytest.mark.parametrize("parameter", ["position_delay", "tension_time_constant", "tension_delay"])
def test_a_size_that_is_found_by_runs_is_that_of_its_own_form(parameter: str, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[Hypothesis] = []

    def value(_: object, __: object, ___: object, hypothesis: Hypothesis, *____: object) -> float:
        tried.append(hypothesis)
        return 0.5

    monkeypatch.setattr(identifiability, "detectable_value", value)
    unseen = Detectable("sensor_delay", ALL, parameter, inf, "s", {})
    found = identifiability._detectable_by_simulation(None, THREE, (), unseen, 1.0)  # type: ignore[arg-type]
    assert found.size == 0.5 and [hypothesis.form for hypothesis in tried] == [(parameter,)]
