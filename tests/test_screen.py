"""What hypotheses promise, worked out here and by workers."""

import pytest

from tautwire.tracer.data import split
from tautwire.tracer.fit import Fitter
from tautwire.tracer.hypotheses import Hypothesis, hypotheses
from tautwire.tracer.preparation.noise import noise_of
from tautwire.tracer.screen import screen, screened_apart
from tautwire.tracer.workers import Workers
from tautwire_fmu.laws.effects import BY_NAME
from tests.recordings import recorded
from tests.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1, {"payload": {"mass": 0.5}})
NOISE = noise_of(ROBOT, RECORDING)
SAMPLE = split(ROBOT, NOISE, RECORDING, None).fit


def test_what_is_there_promises_most_and_its_values() -> None:
    found = screen(ROBOT, (), hypotheses(ROBOT), Fitter(NOISE), SAMPLE)
    best = max(found, key=lambda hypothesis: found[hypothesis].gain)
    assert best.effect.name == "payload"
    assert found[best].values["mass"] == pytest.approx(0.5, rel=0.05)


def test_workers_promise_the_same() -> None:
    damped = Hypothesis(BY_NAME["damping"], ROBOT.cable_numbers)
    robot, accepted = ROBOT.with_effect(damped.setting(ROBOT)), (damped,)
    others = [h for h in hypotheses(ROBOT) if not h.overlaps(damped)]
    here = screen(robot, accepted, others, Fitter(NOISE), SAMPLE)
    with Workers(2) as workers:
        apart = screened_apart(robot, accepted, others, Fitter(NOISE), SAMPLE, workers)
    assert list(apart) == list(here)
    for hypothesis, prospect in here.items():
        assert apart[hypothesis].gain == pytest.approx(prospect.gain, rel=1e-6, abs=1e-6)
        assert apart[hypothesis].values == pytest.approx(dict(prospect.values), rel=1e-6)
