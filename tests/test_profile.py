"""Ends of intervals against sums of squares that are minimised here, by another method."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from tautwire.tracer.data import Sample, split
from tautwire.tracer.fit import Fit, Fitter
from tautwire.tracer.hypotheses import Hypothesis
from tautwire.tracer.preparation.noise import noise_of
from tautwire.tracer.profile import WITHIN, intervals
from tautwire_fmu.laws.effects import BY_NAME
from tests.recordings import recorded
from tests.robots import example

Made = tuple[Fitter, list[Hypothesis], Sample, Fit]


def fitted(effect: str, truth: dict[str, dict[str, float]], form: tuple[str, ...] = ()) -> Made:
    """The fit of one effect, on all cables, to a recording of a truth."""
    robot, recording = example("three"), recorded("three", 3, truth)
    known = BY_NAME[effect]
    chosen = [Hypothesis(known, robot.cable_numbers if known.component == "cable" else (), form or known.forms[0])]
    noise = noise_of(robot, recording)
    sample, fitter = split(robot, noise, recording, None).fit, Fitter(noise)
    return fitter, chosen, sample, fitter.fit(robot.with_effect(chosen[0].setting(robot)), chosen, sample)


def left_at(made: Made, values: list[float]) -> float:
    """Sum of squares of all innovations."""
    fitter, chosen, sample, fit = made
    likelihood, _ = fitter.likelihood(fit.robot, chosen, sample)
    found = likelihood.innovations(sample.recording, values)
    return float(np.nansum(found.values[sample.rows] ** 2))


def test_a_round_surface_keeps_the_curvatures_interval() -> None:
    fitter, chosen, sample, fit = fitted("damping", {"damping": {"damping": 8e8}})
    assert intervals(fitter, fit, chosen, sample) == [fit.interval(0)]


def test_ends_leave_as_much_as_the_level_says_with_the_other_parameter_at_its_best() -> None:
    made = fitted("relaxation", {"relaxation": {"modulus": 2e9, "time": 5.0}})
    fitter, chosen, sample, fit = made
    least = left_at(made, list(fit.values))
    found = intervals(fitter, fit, chosen, sample)
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
            assert best.fun - least == pytest.approx(WITHIN, rel=0.02)
    assert bent > 0


def test_an_interval_ends_where_the_parameter_does() -> None:
    fitter, chosen, sample, fit = fitted("payload", {})
    ((low, high),) = intervals(fitter, fit, chosen, sample)
    assert low == fit.interval(0)[0] or low == chosen[0].parameters[0].minimum
    assert low < fit.values[0] < high
    fitter, chosen, sample, fit = fitted("hysteresis", {})
    (low, high), _ = intervals(fitter, fit, chosen, sample)
    assert low == 0.0
    assert high > fit.values[0]
