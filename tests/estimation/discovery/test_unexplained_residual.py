"""Hidden oscillators beside a disturbance are looked for where much is missed, and effects explain little of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.discovery.unexplained_residual import resonances_beside_disturbance
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.explained_shares import ExplainedShares
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
SWING = {"unlisted_swing": {"mass": 20.0, "length": 2.0}}
MUCH = ExplainedShares((), (), (), (), left=0.95, size_missed=20.0, size_left=20.0, size_together=0.0)


def context() -> IdentificationContext:
    """Under a large random force, which takes up the swing."""
    fit, check = recorded("three", 3, SWING), recorded("three", 53, SWING)
    noise = estimate_noise(ROBOT, fit)
    usual = disturbance_prior(ROBOT, noise).median
    large = replace(usual, force=replace(usual.force, rms=100.0 * usual.force.rms))
    return IdentificationContext(ROBOT, Fitter(replace(noise, disturbance=large)), split_data(ROBOT, noise, fit, check))


@pytest.mark.validate
def test_a_swinging_load_that_the_disturbance_has_taken_up_is_told() -> None:
    found = resonances_beside_disturbance(context(), MUCH)
    assert [each.frequency for each in found.resonances] == pytest.approx(
        [np.sqrt(9.81 / 2.0) / (2.0 * np.pi)], rel=0.06
    )
    assert found.notes == tuple(each.sentence for each in found.resonances)


@pytest.mark.validate(but=["explained"])
@pytest.mark.parametrize(
    "shares", [replace(MUCH, size_missed=5.0), replace(MUCH, left=0.3)], ids=["little", "explained"]
)
def test_none_is_looked_for_in_little_or_beside_effects_that_explain_much(shares: ExplainedShares) -> None:
    said: list[str] = []
    watched = replace(context(), progress=lambda what, share: said.append(what))
    assert resonances_beside_disturbance(watched, shares).resonances == ()
    assert said == []
