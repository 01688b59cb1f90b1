import pickle

import pytest

from tautwire.estimation import parameter_fit
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.kalman_filter import Noise
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.policy import FitPolicy
from tautwire.robot.schema import EffectSetting
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example


@pytest.mark.validate(only=["1.0"])
@pytest.mark.parametrize("begin", [1.0, 0.0, -1e-15, 40.0])
def test_a_fit_arrives_wherever_it_begins(begin: float) -> None:
    robot = example("caroca").with_effect(EffectSetting("payload", {"mass": begin}))
    recording = recorded("caroca", 3, {"payload": {"mass": 1.5}})
    noise = estimate_noise(robot, recording)
    sample = split_data(robot, noise, recording, None).estimation
    fit = Fitter(noise).fit_from([robot], [Hypothesis(BY_NAME["payload"], ())], sample)
    assert abs(fit.values[0] - 1.5) < 4.5 * fit.standard_deviations[0]
    assert fit.standard_deviations[0] < 0.05


@pytest.mark.validate
def test_a_relaxation_is_found_that_is_quicker_than_where_the_fit_begins() -> None:
    truth = {"modulus": 3e10, "time": 0.003}
    robot, recording = example("three"), recorded("three", 3, {"relaxation": truth})
    noise = estimate_noise(robot, recording)
    sample = split_data(robot, noise, recording, None).estimation
    true, begin = (EffectSetting("relaxation", {**truth, "time": time}, (1, 2, 3)) for time in (0.003, 0.03))
    fit = Fitter(noise).fit_from([robot.with_effect(begin)], [Hypothesis(BY_NAME["relaxation"], (1, 2, 3))], sample)
    found, at_truth = (
        Fitter(noise).innovations(known, sample).log_likelihood(sample.rows)
        for known in (fit.robot, robot.with_effect(true))
    )
    assert at_truth - 0.1 < found < at_truth + 10.0


def test_a_fitter_sent_to_a_process_twice_is_one_fitter_there() -> None:
    sent = pickle.dumps(Fitter(Noise(1e-3, 1.0, 1e-4, 0.0), policy=FitPolicy(max_evaluations=7)))
    first, second = pickle.loads(sent), pickle.loads(sent)
    assert first is second
    assert (first.noise.position, first.policy.max_evaluations) == (1e-3, 7)


def test_likelihoods_are_forgotten_where_they_take_too_much_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, recording = example("three"), recorded("three", 1).first(50)
    noise = estimate_noise(robot, recording)
    sample = split_data(robot, noise, recording, None).estimation
    fitter = Fitter(noise)
    robots = [robot.with_effect(EffectSetting("payload", {"mass": mass})) for mass in (1.0, 2.0, 3.0)]
    for each in robots:
        fitter.innovations(each, sample)
    assert len(fitter._compiled) == 3
    size = next(iter(fitter._compiled.values())).instruction_count
    monkeypatch.setattr(parameter_fit, "MAX_KEPT_INSTRUCTIONS", 2 * size + 1)
    fitter.innovations(robot, sample)
    assert len(fitter._compiled) == 2
    monkeypatch.setattr(parameter_fit, "MAX_KEPT_INSTRUCTIONS", 1)
    fitter.innovations(robots[0], sample)
    assert len(fitter._compiled) == 1
