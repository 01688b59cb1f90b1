"""The result of a selection, changed by one of its effects."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import pytest

from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter
from tautwire.estimation.selection_result import (
    SelectionResult,
    with_damping_for_fast_relaxations,
    without_least_evident,
)
from tautwire.robot.schema import EffectSetting
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example


@pytest.mark.parametrize("has_disturbance", [False, True])
def test_the_effect_with_the_least_evidence_goes_and_the_others_are_fitted_anew(has_disturbance: bool) -> None:
    robot, recording = example("three"), recorded("three", 5, {"payload": {"mass": 6.0}}).first(401)
    noise = estimate_noise(robot, recording)
    if has_disturbance:
        noise = replace(noise, disturbance=disturbance_prior(robot, noise).median)
    split = split_data(robot, noise, recording, None)
    payload = Hypothesis(BY_NAME["payload"], ())
    modulus = [Hypothesis(BY_NAME["modulus"], (cable,)) for cable in (1, 2)]
    chosen = [modulus[0], payload, modulus[1]]
    start = robot
    for hypothesis in chosen:
        start = start.with_effect(hypothesis.setting(robot))
    fitter = Fitter(noise)
    fit = fitter.fit_from([start], chosen, split.estimation, -inf)
    alike = (("modulus", "creep"), ("payload", "drag"))
    found = SelectionResult(tuple(chosen), (9.0, 500.0, 8.0), fit, (), alike)
    context, fewer = without_least_evident(IdentificationContext(robot, fitter, split), found)
    assert fewer.accepted == (payload,) and fewer.evidence == (500.0,) and fewer.confusable == (alike[1],)
    assert [setting.name for setting in fewer.fit.robot.effects] == ["payload"]
    assert fewer.fit.values == pytest.approx([6.0], rel=0.05)
    assert fewer.disturbance == context.fitter.noise.disturbance and bool(fewer.disturbance) is has_disturbance


@pytest.mark.parametrize(
    ("time", "others", "names"),
    [
        (1e-3, (), ["damping"]),
        (0.1, (), ["relaxation"]),
        (1e-3, ("damping",), ["relaxation", "damping"]),
    ],
)
def test_a_relaxation_that_a_fit_made_faster_than_a_sample_is_damping(
    time: float, others: tuple[str, ...], names: list[str]
) -> None:
    robot, recording = example("three"), recorded("three", 5, {"damping": {"damping": 5e9}}).first(401)
    noise = estimate_noise(robot, recording)
    noise = replace(noise, disturbance=disturbance_prior(robot, noise).median)
    context = IdentificationContext(robot, Fitter(noise), split_data(robot, noise, recording, recording))
    cables = robot.cable_numbers
    accepted = [Hypothesis(BY_NAME[name], cables) for name in ("relaxation", *others)]
    modulus = (5e9 - robot.cables[0].damping) / 1e-3
    relaxed = robot.with_effect(EffectSetting("relaxation", {"modulus": modulus, "time": time}, cables))
    fit = Fit.without_parameters(relaxed)
    _, chosen, chosen_fit = with_damping_for_fast_relaxations(context, accepted, fit)
    assert [hypothesis.effect.name for hypothesis in chosen] == names
    if names == ["damping"]:
        assert [each.name for each in chosen_fit.robot.effects] == names
        assert chosen_fit.values == pytest.approx([5e9], rel=0.05)
    else:
        assert chosen_fit is fit


def test_a_relaxation_within_a_sample_stays_where_damping_explains_less() -> None:
    robot, recording = example("three"), recorded("three", 5, {"relaxation": {"modulus": 2e11, "time": 0.015}})
    noise = estimate_noise(robot, recording)
    noise = replace(noise, disturbance=disturbance_prior(robot, noise).median)
    context = IdentificationContext(robot, Fitter(noise), split_data(robot, noise, recording, recording))
    relaxation = Hypothesis(BY_NAME["relaxation"], robot.cable_numbers)
    true = robot.with_effect(EffectSetting("relaxation", {"modulus": 2e11, "time": 0.015}, robot.cable_numbers))
    _, chosen, _ = with_damping_for_fast_relaxations(context, [relaxation], Fit.without_parameters(true))
    assert chosen == [relaxation]
