"""How the estimates of a fit go together: by its covariance, the curvature of the likelihood, and many recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.estimation.effect_estimates import (
    parameter_correlations,
    series_stiffness_notes,
    with_readable_values,
)
from tautwire.estimation.hypotheses import with_values
from tautwire.estimation.parameter_fit import Fit
from tautwire.estimation.trace_result import Estimate, FittedParameter, FoundEffect
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.symbolic_model import FORMULA_INDEX, FreeParameter
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.fits import fitted
from tests.support.robots import example

Array = NDArray[np.float64]

# A heavier platform and load cells that show too much: what is seen of both is nearly their product.
VALUES = np.array([1.5, 1.01])
SEEDS = 12


def effects_of(robot: Robot) -> list[FoundEffect]:
    """The effects that a robot has, as a trace names them."""
    estimate = Estimate(0.0, "", 0.0, 0.0, None)
    return [
        FoundEffect(each.name, BY_NAME[each.name].component, each.cables, dict.fromkeys(each.values, estimate), 1.0)
        for each in robot.effects
    ]


def correlation_of(fit: Fit) -> float:
    """The one between mass and gain."""
    gain = FittedParameter("sensor_gain", (1, 2, 3), "tension_gain")
    effects = [
        FoundEffect("payload", "platform", (), {"mass": Estimate(0.0, "kg", 0.0, 0.0, None)}, 1.0),
        FoundEffect("sensor_gain", "sensor", gain.cables, {gain.parameter: Estimate(0.0, "1", 0.0, 0.0, None)}, 1.0),
    ]
    (found,) = parameter_correlations(fit, effects)
    assert found.between == (FittedParameter("payload", (), "mass"), gain)
    return found.value


def test_fitted_values_have_the_digits_that_their_intervals_are_worth() -> None:
    declared = example("three")
    robot = declared.with_effect(EffectSetting("payload", {"mass": 3.2012345678901234}))
    platform = replace(robot.platform, mass=301.23456789012345, mass_uncertainty=0.09112844503160293)
    first, *others = robot.cables
    cables = (replace(first, modulus_uncertainty=166439269.67097053, anchor_uncertainty=0.0018586813816403576), *others)
    heavier = replace(robot, platform=platform, cables=cables)
    estimate = Estimate(3.2012345678901234, "kg", 3.18, 3.22, None)
    readable = with_readable_values(
        heavier, declared, [FoundEffect("payload", "platform", (), {"mass": estimate}, 9.0)]
    )
    assert readable.effects[0].values["mass"] == 3.20123
    assert (readable.platform.mass, readable.platform.mass_uncertainty) == (301.2345679, 0.09113)
    assert (readable.cables[0].modulus_uncertainty, readable.cables[0].anchor_uncertainty) == (166400000.0, 0.001859)
    assert readable.cables[1:] == declared.cables[1:]
    assert with_readable_values(robot, declared, ()) == robot


def test_correlations_are_those_of_each_two_parameters_beside_what_else_was_fitted() -> None:
    robot = example("three").with_effect(EffectSetting("payload", {"mass": 1.0}))
    robot = robot.with_effect(EffectSetting("damping", {"damping": 1e9}, (2,)))
    robot = robot.with_effect(EffectSetting("damping", {"damping": 2e9}, (1, 3)))
    free = (
        FreeParameter(1, "damping"),
        FreeParameter(FORMULA_INDEX, "k1"),
        FreeParameter(0, "mass"),
        FreeParameter(2, "damping"),
    )
    covariance = np.array([[4e16, 1e8, -1e7, 0.0], [1e8, 1.0, 0.0, 0.0], [-1e7, 0.0, 0.01, 0.0], [0.0, 0.0, 0.0, 0.0]])
    found = parameter_correlations(Fit(robot, free, np.zeros(4), covariance), effects_of(robot))
    # The last one has no deviation, and so no correlation.
    assert [each.between for each in found] == [
        (FittedParameter("payload", (), "mass"), FittedParameter("damping", (2,), "damping"))
    ]
    assert found[0].value == pytest.approx(-1e7 / (2e8 * 0.1))


@pytest.mark.validate
def test_a_correlation_is_that_of_the_curvature_of_the_likelihood() -> None:
    fitter, chosen, sample, fit = fitted(3)

    def log_likelihood(moves: Array) -> float:
        values = fit.values + moves * fit.standard_deviations
        robot = with_values(fit.robot, fit.free, dict(zip(fit.free, values.tolist(), strict=True)))
        return fitter.judged(robot, chosen, sample).log_likelihood(sample.rows)

    steps = 0.5 * np.eye(2)
    curvature = [
        [sum(u * v * log_likelihood(u * a + v * b) for u in (-1, 1) for v in (-1, 1)) for b in steps] for a in steps
    ]
    covariance = np.linalg.inv(-np.array(curvature))
    expected = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert correlation_of(fit) == pytest.approx(expected, abs=0.01)
    assert expected < -0.9


@pytest.mark.validate
def test_a_correlation_is_that_of_fits_to_many_recordings() -> None:
    fits = [fitted(seed)[3] for seed in range(SEEDS)]
    errors = np.array([(fit.values - VALUES) / fit.standard_deviations for fit in fits])
    spread = float(np.corrcoef(errors.T)[0, 1])
    reported = float(np.mean([correlation_of(fit) for fit in fits]))
    # Fisher's transformation makes the spread of a correlation that of a normal variable.
    assert abs(np.arctanh(spread) - np.arctanh(reported)) < 3.0 / np.sqrt(SEEDS - 3)
    assert np.arctanh(reported) < -4.0 / np.sqrt(SEEDS - 3)
    # By both together: a sum of squares of 2 per recording, which correlated errors weighed apart would not give.
    squares = sum(float(e @ np.linalg.inv(fit.covariance) @ e) for fit in fits for e in [fit.values - VALUES])
    assert 0.35 < squares / (2 * SEEDS) < 2.2


@pytest.mark.parametrize(
    ("cables", "high", "is_told"), [((1, 2, 3), 9.5e10, True), ((1, 2), 9.5e10, False), ((1, 2, 3), 1.1e11, False)]
)
def test_softer_ropes_everywhere_may_be_mounts(cables: tuple[int, ...], high: float, is_told: bool) -> None:
    softer = {"modulus": Estimate(9.3e10, "Pa", 9.2e10, high, 1.022e11)}
    notes = series_stiffness_notes([FoundEffect("modulus", "cable", cables, softer, 100.0)], 3)
    assert any("in series with the ropes" in note for note in notes) == is_told
