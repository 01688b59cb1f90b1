"""Effects whose slopes tell nothing are seen by running the model."""

from collections.abc import Sequence

import pytest

from tautwire.errors import UnreachableError
from tautwire.robots.robot import Robot
from tautwire.tracer.data import Sample, split
from tautwire.tracer.fit import Fitter
from tautwire.tracer.hypotheses import Hypothesis
from tautwire.tracer.likelihood import Innovations
from tautwire.tracer.preparation.noise import noise_of
from tautwire.tracer.scan import looked_at, scanned, silent
from tautwire.tracer.screen import Prospect, screen
from tautwire.tracer.workers import Workers
from tautwire_fmu.laws.effects import DAMPING, HYSTERESIS, SLACK
from tests.recordings import recorded
from tests.robots import example

ALL = (1, 2, 3)
SOFT = Hypothesis(SLACK, ALL)
STICKY = Hypothesis(HYSTERESIS, ALL)
VISCOUS = Hypothesis(DAMPING, ALL)


def looked(effects: dict[str, dict[str, float]]) -> tuple[Robot, Fitter, Sample]:
    robot, fit = example("three"), recorded("three", 3, effects)
    noise = noise_of(robot, fit)
    return robot, Fitter(noise), split(robot, noise, fit, None).fit


def test_a_softness_that_slopes_cannot_see_is_seen_by_a_run() -> None:
    robot, fitter, sample = looked({"slack": {"softness": 400.0}})
    slopes = screen(robot, (), [SOFT, VISCOUS], fitter, sample)
    assert slopes[SOFT].gain == 0.0
    assert set(silent(slopes)) == {SOFT}
    found = scanned(robot, (), fitter, sample, silent(slopes), Workers(1))
    assert found[SOFT].values == {"softness": 300.0}
    assert found[SOFT].gain > slopes[VISCOUS].gain > 0.0


def test_nothing_is_promised_where_nothing_is_hidden() -> None:
    robot, fitter, sample = looked({})
    found = scanned(robot, (), fitter, sample, {SOFT: Prospect(0.0, {})}, Workers(1))
    assert found[SOFT].gain < 4.0


def test_a_promise_that_a_run_holds_better_stays() -> None:
    robot, fitter, sample = looked({"hysteresis": {"force": 30.0, "yield_strain": 1e-4}})
    true = Prospect(1.0, {"force": 30.0, "yield_strain": 1e-4})
    assert scanned(robot, (), fitter, sample, {STICKY: true}, Workers(1)) == {STICKY: true}
    wrong = Prospect(1.0, {"force": 0.5, "yield_strain": 1e-5})
    better = scanned(robot, (), fitter, sample, {STICKY: wrong}, Workers(1))[STICKY]
    assert better.values["force"] > wrong.values["force"]
    assert better.gain > 1000.0


def test_a_promise_that_cannot_be_run_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, fitter, sample = looked({"hysteresis": {"force": 30.0, "yield_strain": 1e-4}})
    judged = fitter.judged

    def unheld(robot: Robot, chosen: Sequence[Hypothesis], sample: Sample) -> Innovations:
        if any(setting.values["force"] == 0.5 for setting in robot.effects):
            raise UnreachableError("here", robot.platform.start, None, None)
        return judged(robot, chosen, sample)

    monkeypatch.setattr(fitter, "judged", unheld)
    unrun = Prospect(1.0, {"force": 0.5, "yield_strain": 1e-5})
    assert scanned(robot, (), fitter, sample, {STICKY: unrun}, Workers(1))[STICKY].gain > 1000.0


def test_scales_are_looked_at_from_the_largest_each_with_all_shapes() -> None:
    groups = list(looked_at(STICKY))
    values = [each for group in groups for each in group]
    assert [len(group) for group in groups] == [3, 3, 3]
    assert [each["force"] for each in values] == [1000.0] * 3 + [100.0] * 3 + [10.0] * 3
    assert len({tuple(each.items()) for each in values}) == 9
    assert list(looked_at(VISCOUS)) == []


def test_smaller_values_are_spared_once_one_is_not_felt(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, fitter, sample = looked({})
    runs = []
    judged = fitter.judged
    monkeypatch.setattr(fitter, "judged", lambda *asked: runs.append(asked[0]) or judged(*asked))
    scanned(robot, (), fitter, sample, {SOFT: Prospect(0.0, {})}, Workers(1))
    assert 2 < len(runs) < 1 + len(SLACK.parameters[0].scanned)
