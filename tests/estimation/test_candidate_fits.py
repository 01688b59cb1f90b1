"""Fits of a selection's candidates: where they begin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.candidate_fits import (
    ValidatedFit,
    coarse_validation_likelihood,
    fit_at_another_optimum,
    fit_candidates,
    fit_model,
)
from tautwire.estimation.candidate_proposals import FitTask
from tautwire.estimation.disturbance import OrnsteinUhlenbeck
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import hypotheses
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter, NoFitError
from tautwire.estimation.policy import SelectionPolicy
from tautwire.estimation.worker_pool import WorkerPool
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1).first(400)
HYSTERESIS = next(h for h in hypotheses(ROBOT) if h.effect.name == "hysteresis" and h.cables == ROBOT.cable_numbers)
# A hundred billion newtons for a strain of one: more than the steps of a filter made for 20 N in 1e-4 can follow.
TOO_STIFF = replace(HYSTERESIS.setting(ROBOT), values={**HYSTERESIS.setting(ROBOT).values, "force": 1e7})


def test_a_fit_whose_start_has_no_finite_output_begins_at_the_default_values() -> None:
    """As where a stiff effect loses the soft one that it was fitted beside."""
    noise = estimate_noise(ROBOT, RECORDING)
    context = IdentificationContext(ROBOT, Fitter(noise), split_data(ROBOT, noise, RECORDING, None))
    from_default_values = fit_model(context, [HYSTERESIS])
    start = ROBOT.with_effect(TOO_STIFF)
    with pytest.raises(NoFitError):
        context.fitter.fit_from([start], [HYSTERESIS], context.split.estimation, -np.inf)
    fit = fit_model(context, [HYSTERESIS], start)
    assert np.all(np.isfinite(fit.values))
    assert fit.values == pytest.approx(from_default_values.values)
    likelihood = coarse_validation_likelihood(context.fitter, start, [HYSTERESIS], context.split.validation)
    assert np.isfinite(likelihood)


def with_hysteresis(force: float, yield_strain: float) -> Robot:
    values = {"force": force, "yield_strain": yield_strain}
    return ROBOT.with_effect(EffectSetting("hysteresis", values, ROBOT.cable_numbers))


@pytest.mark.validate
@pytest.mark.parametrize(("fitted", "is_astray"), [((10.0, 7e-5), True), ((1e4, 1e-3), True), ((300.0, 1.2e-4), False)])
def test_a_hysteresis_that_a_large_disturbance_led_astray_is_found_at_its_own_optimum(
    fitted: tuple[float, float], is_astray: bool
) -> None:
    recording = recorded("three", 3, {"hysteresis": {"force": 300.0, "yield_strain": 1.2e-4}}).first(600)
    noise = estimate_noise(ROBOT, recording)
    median = disturbance_prior(ROBOT, noise).median
    large = replace(median, force=OrnsteinUhlenbeck(100.0, 1.0), position=OrnsteinUhlenbeck(0.01, 1.0))
    fitter = Fitter(replace(noise, disturbance=large))
    data = split_data(ROBOT, noise, recording, recording).estimation
    task = FitTask((HYSTERESIS,), (with_hysteresis(*fitted),), -np.inf, 1e-4)
    robot = fit_at_another_optimum(fitter, task, data, SelectionPolicy())
    assert (robot is not None) == is_astray
    if robot is not None:
        assert robot.effects[0].values["force"] == pytest.approx(300.0, rel=0.1)
        assert robot.effects[0].values["yield_strain"] == pytest.approx(1.2e-4, rel=0.1)


def test_an_optimum_that_cannot_be_reached_from_anywhere_is_none() -> None:
    noise = estimate_noise(ROBOT, RECORDING)
    fitter = Fitter(replace(noise, disturbance=disturbance_prior(ROBOT, noise).median))
    data = split_data(ROBOT, noise, RECORDING, RECORDING).estimation
    payload = next(h for h in hypotheses(ROBOT) if h.effect.name == "payload")
    weightless = ROBOT.with_effect(EffectSetting("payload", {"mass": -2.0 * ROBOT.platform.mass}, ()))
    task = FitTask((payload,), (weightless,), -np.inf, 1e-4)
    assert fit_at_another_optimum(fitter, task, data, SelectionPolicy()) is None


@pytest.mark.parametrize("ending", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_the_first_fit_that_leaves_noise_is_enough_whichever_ends_first(
    ending: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second of three leaves noise, and the third, which a quicker machine might not have begun."""
    noise = estimate_noise(ROBOT, RECORDING)
    context = IdentificationContext(ROBOT, Fitter(noise), split_data(ROBOT, noise, RECORDING, None))
    tried = hypotheses(ROBOT)[:3]
    fit = Fit.without_parameters(ROBOT)
    validated = [ValidatedFit(fit, 10.0, mean_square, np.nan) for mean_square in (9.0, 1.0, 1.0)]
    monkeypatch.setattr(WorkerPool, "map_unordered", lambda *_: ((k, validated[k]) for k in ending))
    tasks = {h: FitTask((h,), (ROBOT,), -np.inf, 1e-4) for h in tried}
    scores = fit_candidates(context, "round 1", tasks, context.split.estimation, 0.0, stop_at_first=True)
    assert list(scores) == list(tried[:2])
