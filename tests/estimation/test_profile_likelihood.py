"""Ends of intervals against sums of squares that are minimised here, by another method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from tautwire.estimation.estimation_data import DataSet, split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter, parameter_bounds
from tautwire.estimation.profile_likelihood import CHI_SQUARED_95, profile_intervals
from tautwire.estimation.worker_pool import WorkerPool
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example

HERE = WorkerPool(1)
Made = tuple[Fitter, list[Hypothesis], DataSet, Fit]


def fitted(effect: str, truth: dict[str, dict[str, float]], form: tuple[str, ...] = ()) -> Made:
    """The fit of one effect, on all cables, to a recording of a truth."""
    robot, recording = example("three"), recorded("three", 3, truth)
    known = BY_NAME[effect]
    chosen = [Hypothesis(known, robot.cable_numbers if known.component == "cable" else (), form or known.forms[0])]
    noise = estimate_noise(robot, recording)
    sample, fitter = split_data(robot, noise, recording, None).estimation, Fitter(noise)
    return fitter, chosen, sample, fitter.fit_from([robot.with_effect(chosen[0].setting(robot))], chosen, sample)


def left_at(made: Made, values: list[float]) -> float:
    """Sum of squares of all innovations."""
    fitter, chosen, sample, fit = made
    likelihood, _ = fitter.likelihood(fit.robot, chosen, sample)
    found = likelihood.innovations(sample.recording, values)
    return float(np.nansum(found.values[sample.rows] ** 2))


@pytest.mark.validate
def test_a_round_surface_keeps_the_curvatures_interval() -> None:
    fitter, chosen, sample, fit = fitted("damping", {"damping": {"damping": 8e8}})
    assert profile_intervals(fitter, fit, chosen, sample, HERE) == [fit.interval(0)]


@pytest.mark.validate
def test_ends_leave_as_much_as_the_level_says_with_the_other_parameter_at_its_best() -> None:
    made = fitted("relaxation", {"relaxation": {"modulus": 2e9, "time": 5.0}})
    fitter, chosen, sample, fit = made
    least = left_at(made, list(fit.values))
    found = profile_intervals(fitter, fit, chosen, sample, HERE)
    bent = 0
    for index, ends in enumerate(found):
        for end, by_curvature in zip(ends, fit.interval(index), strict=True):
            if end == by_curvature:
                continue
            bent += 1
            other = float(fit.values[1 - index])
            best = minimize_scalar(
                lambda value, index=index, end=end: left_at(made, [end, value] if index == 0 else [value, end]),
                bounds=(0.3 * other, 3.0 * other),
                method="bounded",
                options={"xatol": 1e-4 * other},
            )
            assert best.fun - least == pytest.approx(CHI_SQUARED_95, rel=0.02)
    assert bent > 0


def test_an_interval_ends_where_the_parameter_does() -> None:
    fitter, chosen, sample, fit = fitted("payload", {})
    ((low, high),) = profile_intervals(fitter, fit, chosen, sample, HERE)
    assert low == fit.interval(0)[0] or low == chosen[0].parameters[0].minimum
    assert low < fit.values[0] < high
    fitter, chosen, sample, fit = fitted("hysteresis", {})
    (low, high), _ = profile_intervals(fitter, fit, chosen, sample, HERE)
    assert low == 0.0
    assert high > fit.values[0]


def several(names: tuple[str, ...], truth: dict[str, dict[str, float]]) -> Made:
    """The fit of several effects, with all numbers of their smallest forms."""
    robot, recording = example("three"), recorded("three", 3, truth)
    noise = estimate_noise(robot, recording)
    chosen = [Hypothesis(BY_NAME[name], robot.cable_numbers) for name in names]
    for hypothesis in chosen:
        robot = robot.with_effect(hypothesis.setting(robot))
    sample, fitter = split_data(robot, noise, recording, None).estimation, Fitter(noise)
    return fitter, chosen, sample, fitter.fit_from([robot], chosen, sample)


@pytest.mark.validate
@pytest.mark.parametrize("names", [("modulus", "relaxation"), ("relaxation", "hysteresis")], ids="-".join)
def test_intervals_hold_their_values_whatever_the_samples_tell(names: tuple[str, ...]) -> None:
    fitter, chosen, sample, fit = several(names, {"relaxation": {"modulus": 2e9, "time": 5.0}})
    lower, upper = parameter_bounds(fit.robot, fit.free)
    for (low, high), value, least, most in zip(
        profile_intervals(fitter, fit, chosen, sample, HERE), fit.values, lower, upper, strict=True
    ):
        assert least <= low <= value <= high <= most
        assert low < high


@pytest.mark.validate
def test_a_fit_that_is_not_the_best_gets_the_interval_about_the_best() -> None:
    fitter, chosen, sample, fit = fitted("damping", {"damping": {"damping": 8e8}})
    ((low, high),) = profile_intervals(fitter, fit, chosen, sample, HERE)
    beside = replace(fit, values=fit.values + 1.5 * fit.standard_deviations)
    ((found, reached),) = profile_intervals(fitter, beside, chosen, sample, HERE)
    assert (found, reached) == pytest.approx((low, high), abs=0.05 * (high - low))


@pytest.mark.validate
def test_workers_find_the_same_ends() -> None:
    fitter, chosen, sample, fit = fitted("relaxation", {"relaxation": {"modulus": 2e9, "time": 5.0}})
    with WorkerPool(2) as workers:
        apart = profile_intervals(fitter, fit, chosen, sample, workers)
    assert np.array(apart) == pytest.approx(np.array(profile_intervals(fitter, fit, chosen, sample, HERE)), rel=1e-9)
