"""Fits that several tests look at."""

from __future__ import annotations

from tautwire.estimation.estimation_data import DataSet, split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example

TRUTH = {"payload": {"mass": 1.5}, "sensor_gain": {"gain": 1.01}}


def fitted(seed: int) -> tuple[Fitter, list[Hypothesis], DataSet, Fit]:
    """The fit of both effects to a recording of their truth."""
    robot = example("three")
    chosen = [Hypothesis(BY_NAME["payload"], ()), Hypothesis(BY_NAME["sensor_gain"], robot.cable_numbers)]
    for hypothesis in chosen:
        robot = robot.with_effect(hypothesis.setting(robot))
    recording = recorded("three", seed, TRUTH)
    noise = estimate_noise(robot, recording)
    sample, fitter = split_data(robot, noise, recording, None).estimation, Fitter(noise)
    return fitter, chosen, sample, fitter.fit_from([robot], chosen, sample)
