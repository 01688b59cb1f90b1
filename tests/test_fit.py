import pytest

from tautwire.robots.robot import EffectSetting
from tautwire.tracer.data import split
from tautwire.tracer.fit import Fitter
from tautwire.tracer.hypotheses import Hypothesis
from tautwire.tracer.preparation.noise import noise_of
from tautwire_fmu.laws.effects import BY_NAME
from tests.recordings import recorded
from tests.robots import example


@pytest.mark.slow
@pytest.mark.parametrize("begin", [1.0, 0.0, -1e-15, 40.0])
def test_a_fit_arrives_wherever_it_begins(begin: float) -> None:
    robot = example("caroca").with_effect(EffectSetting("payload", {"mass": begin}))
    recording = recorded("caroca", 3, {"payload": {"mass": 1.5}})
    noise = noise_of(robot, recording)
    sample = split(robot, noise, recording, None).fit
    fit = Fitter(noise).fit(robot, [Hypothesis(BY_NAME["payload"], ())], sample)
    assert abs(fit.values[0] - 1.5) < 4.5 * fit.deviations[0]
    assert fit.deviations[0] < 0.05
