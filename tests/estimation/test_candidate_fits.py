"""Fits of a selection's candidates: where they begin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.candidate_fits import coarse_validation_likelihood, fit_model
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import hypotheses
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter, NoFitError
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
