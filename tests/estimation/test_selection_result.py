"""The result of a selection without one of its effects: the others stand, fitted anew."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import pytest

from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.selection_result import SelectionResult, without_least_evident
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
