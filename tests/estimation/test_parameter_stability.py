"""Intervals that hold what stretches of a recording, both recordings, and disturbances of other sizes disagree on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.disturbance import Disturbance, OrnsteinUhlenbeck
from tautwire.estimation.effect_estimates import estimated_effects
from tautwire.estimation.estimation_data import DataSet, DataSplit
from tautwire.estimation.hypotheses import hypotheses
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import NORMAL_QUANTILE_95, Fit, Fitter, parameter_scales
from tautwire.estimation.parameter_stability import (
    FORM,
    RECORDINGS,
    SMALLER_FORCE,
    STRETCHES,
    Intervals,
    half_widths_of_stretches,
    stable_intervals,
)
from tautwire.estimation.parameter_stability import NOISE as BY_NOISE
from tautwire.estimation.policy import DEFAULT_POLICY, StabilityPolicy
from tautwire.estimation.selection_result import SelectionResult
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
NOISE = estimate_noise(ROBOT, recorded("three", 1))
FITTER = Fitter(
    replace(
        NOISE,
        disturbance=Disturbance(
            OrnsteinUhlenbeck(0.5, 1.0),
            OrnsteinUhlenbeck(0.3 * NOISE.position, 1.0),
            OrnsteinUhlenbeck(0.3 * NOISE.tension, 1.0),
            NOISE.position,
            NOISE.tension,
        ),
    )
)
DRUM = next(h for h in hypotheses(ROBOT) if h.effect.name == "drum" and h.cables == ROBOT.cable_numbers)
NEUTRAL = np.ones(1)


def turned(seed: int, *ratios: float) -> DataSet:
    """A recording whose ropes move by these ratios of what encoders say, one after the other."""
    recording = recorded("three", seed).first(600)
    by_sample = np.repeat(ratios, int(np.ceil(600 / len(ratios))))[: len(recording.time)]
    recording = replace(recording, winch_speed=recording.winch_speed / by_sample[:, None])
    return DataSet(recording, ROBOT.platform.start, np.ones(len(recording.time), dtype=bool))


def fit_to(data: DataSet, fitter: Fitter = FITTER) -> Fit:
    return fitter.fit_from([ROBOT.with_effect(DRUM.setting(ROBOT))], (DRUM,), data)


def half_width(fit: Fit, data: DataSet) -> float:
    innovations, units = FITTER.judged(fit.robot, (DRUM,), data), parameter_scales(fit.robot, fit.free)
    return float(half_widths_of_stretches(innovations, data.rows, units, DEFAULT_POLICY.stability.stretches)[0])


def intervals(form_tolerance: float, *data_sets: DataSet) -> tuple[float, float, bool]:
    stability = replace(DEFAULT_POLICY.stability, form_tolerance=form_tolerance)
    policy = replace(DEFAULT_POLICY, stability=stability)
    context = IdentificationContext(ROBOT, FITTER, DataSplit(data_sets[0], data_sets[1], ()), policy=policy)
    found, disagree = stable_intervals(context, fit_to(data_sets[0]), (DRUM,), NEUTRAL)
    return float(found.low[0]), float(found.high[0]), bool(disagree[0])


def test_stretches_that_agree_leave_about_the_interval_of_the_curvature() -> None:
    data = turned(1, 0.97)
    fit = fit_to(data)
    ratio = half_width(fit, data) / (NORMAL_QUANTILE_95 * fit.standard_deviations[0])
    assert 0.4 < ratio < 2.5


def test_stretches_that_disagree_widen_the_interval_far_beyond_the_curvatures() -> None:
    data = turned(1, 0.97, 0.975)
    fit = fit_to(data)
    assert 0.969 < fit.values[0] < 0.976
    assert half_width(fit, data) > 5.0 * NORMAL_QUANTILE_95 * fit.standard_deviations[0]


@pytest.mark.validate
def test_an_interval_holds_what_either_recording_shows_by_itself() -> None:
    low, high, disagree = intervals(0.0, turned(1, 0.96), turned(2, 0.97))
    assert low < 0.96 and high > 0.97
    assert disagree


@pytest.mark.validate
def test_recordings_that_agree_are_not_said_to_disagree() -> None:
    low, high, disagree = intervals(0.0, turned(1, 0.97), turned(2, 0.97))
    assert 0.968 < low < 0.97 < high < 0.972
    assert not disagree


@pytest.mark.validate(but=["0.96"])
@pytest.mark.parametrize("ratio_of_check, unstable", [(0.96, ()), (0.98, ("radius_ratio",))])
def test_a_parameter_on_which_recordings_disagree_is_unstable(ratio_of_check: float, unstable: tuple[str, ...]) -> None:
    data_sets = turned(1, 0.96), turned(2, ratio_of_check)
    context = IdentificationContext(ROBOT, FITTER, DataSplit(*data_sets, ()))
    (effect,) = estimated_effects(context, SelectionResult((DRUM,), (100.0,), fit_to(data_sets[0]), (), ()))
    low, high = effect.parameters["radius_ratio"].low, effect.parameters["radius_ratio"].high
    assert effect.unstable == unstable
    assert low is not None and low < min(0.96, ratio_of_check)
    assert high is not None and high > max(0.96, ratio_of_check)


@pytest.mark.validate(but=["0.1", "estimation3"])
@pytest.mark.parametrize(
    ("form_tolerance", "estimation", "validation", "dominant"),
    [
        (0.1, (0.97,), (0.97,), FORM),
        (0.0, (0.96,), (0.97,), RECORDINGS),
        (0.0, (0.97, 0.975), (0.97, 0.975), STRETCHES),
        (0.0, (0.97,), (0.97,), BY_NOISE),
    ],
)
def test_what_accounts_for_most_of_an_intervals_width_is_told(
    form_tolerance: float, estimation: tuple[float, ...], validation: tuple[float, ...], dominant: str
) -> None:
    data_sets = turned(1, *estimation), turned(2, *validation)
    stability = replace(DEFAULT_POLICY.stability, form_tolerance=form_tolerance)
    policy = replace(DEFAULT_POLICY, stability=stability)
    context = IdentificationContext(ROBOT, FITTER, DataSplit(*data_sets, ()), policy=policy)
    (effect,) = estimated_effects(context, SelectionResult((DRUM,), (100.0,), fit_to(data_sets[0]), (), ()))
    assert effect.parameters["radius_ratio"].dominant_uncertainty == dominant


def test_of_two_intervals_the_wider_one_tells_what_makes_their_hull_wide_unless_they_are_far_apart() -> None:
    """The first two overlap, the second two adjoin, the third two leave more between them than either is wide."""
    narrow = Intervals(np.ones(3), np.full(3, 2.0), np.full(3, STRETCHES))
    wide = Intervals(np.array([0.0, 1.9, 5.0]), np.array([2.5, 2.95, 7.0]), np.full(3, FORM))
    for hull in (narrow.hull(wide, SMALLER_FORCE), wide.hull(narrow, SMALLER_FORCE)):
        assert hull.dominant.tolist() == [FORM, FORM, SMALLER_FORCE]
        assert (hull.low.tolist(), hull.high.tolist()) == ([0.0, 1.0, 1.0], [2.5, 2.95, 7.0])


def test_an_effects_form_is_trusted_no_better_than_stated() -> None:
    low, high, _ = intervals(0.1, turned(1, 0.97), turned(2, 0.97))
    assert high - low == pytest.approx(2.0 * 0.1 * 0.03, rel=0.25)


@pytest.mark.validate
@pytest.mark.parametrize("ratio, max_mean_square, widening", [(1.0, 2.0, 1.0), (10.0, 2.0, 2.0), (10.0, 0.0, 1.0)])
def test_an_interval_holds_the_estimate_under_a_random_force_of_another_size(
    ratio: float, max_mean_square: float, widening: float
) -> None:
    """A weight is a load or a random force that hardly changes: how large that may be decides, where it can be."""
    payload = next(h for h in hypotheses(ROBOT) if h.effect.name == "payload")
    recordings = [recorded("three", seed, {"payload": {"mass": 3.0}}).first(400) for seed in (1, 2)]
    data_sets = [DataSet(recording, ROBOT.platform.start, np.ones(400, dtype=bool)) for recording in recordings]
    assert FITTER.noise.disturbance is not None
    fitter = FITTER.with_disturbance(replace(FITTER.noise.disturbance, force=OrnsteinUhlenbeck(3.0, 1e-3)))
    fit = fitter.fit_from([ROBOT.with_effect(payload.setting(ROBOT))], (payload,), data_sets[0])
    context = IdentificationContext(ROBOT, fitter, DataSplit(data_sets[0], data_sets[1], ()))

    def width(smaller_force_ratio: float, max_mean_square: float) -> float:
        stability = StabilityPolicy(
            form_tolerance=0.0, smaller_force_ratio=smaller_force_ratio, max_mean_square=max_mean_square
        )
        policy = replace(DEFAULT_POLICY, stability=stability)
        found, _ = stable_intervals(replace(context, policy=policy), fit, (payload,), np.zeros(1))
        assert found.low[0] < 3.0 < found.high[0]
        return float(found.high[0] - found.low[0])

    widened = width(ratio, max_mean_square) / width(1.0, 2.0)
    assert widened == pytest.approx(1.0, rel=1e-6) if widening == 1.0 else widened > widening
