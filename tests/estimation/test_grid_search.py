"""Effects whose slopes tell nothing are seen by running the model."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from tautwire.errors import UnreachableError
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import DataSet, split_data
from tautwire.estimation.grid_search import grid_points, grid_search, misleading_predictions, starts_by_shape
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.innovations import Innovations
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.score_test import PredictedGain, ScoreRun, score_tests
from tautwire.robot.schema import EffectSetting, Robot
from tautwire_fmu.laws.effects import DAMPING, HYSTERESIS, SENSOR_DELAY, SLACK
from tests.support.recordings import recorded
from tests.support.robots import example

ALL = (1, 2, 3)
SOFT = Hypothesis(SLACK, ALL)
STICKY = Hypothesis(HYSTERESIS, ALL)
VISCOUS = Hypothesis(DAMPING, ALL)
LATE = Hypothesis(SENSOR_DELAY, ALL, ("tension_delay",))


def looked(effects: dict[str, dict[str, float]]) -> tuple[IdentificationContext, Fitter, DataSet]:
    robot, fit = example("three"), recorded("three", 3, effects)
    noise = estimate_noise(robot, fit)
    context = IdentificationContext(robot, Fitter(noise), split_data(robot, noise, fit, None))
    return context, context.fitter, context.split.estimation


@pytest.mark.validate
def test_a_softness_that_slopes_cannot_see_is_seen_by_a_run() -> None:
    context, fitter, sample = looked({"slack": {"softness": 400.0}})
    slopes = score_tests(context.robot, (), [SOFT, VISCOUS], [ScoreRun(fitter, sample)])[0]
    assert slopes[SOFT].gain == 0.0
    assert set(misleading_predictions(slopes, ALL)) == {SOFT}
    found = grid_search(context, context.robot, (), sample, misleading_predictions(slopes, ALL))
    assert found[SOFT].values == {"softness": 300.0}
    assert found[SOFT].gain > slopes[VISCOUS].gain > 0.0


@pytest.mark.validate
def test_a_delay_of_more_than_half_a_period_of_a_mode_is_seen_by_a_run() -> None:
    context, fitter, sample = looked({"sensor_delay": {"seconds": 0.17}})
    slopes = score_tests(context.robot, (), [LATE], [ScoreRun(fitter, sample)])[0]
    found = grid_search(context, context.robot, (), sample, slopes)[LATE]
    assert slopes[LATE].values["tension_delay"] < 0.13
    assert found.values["tension_delay"] == pytest.approx(0.17, abs=0.011)
    assert found.gain > 1000.0


def test_a_slope_is_no_answer_where_all_cables_are_meant() -> None:
    one = Hypothesis(SENSOR_DELAY, (2,), ("tension_delay",))
    sloped, flat = PredictedGain(5.0, {"tension_delay": 0.04}), PredictedGain(0.0, {})
    assert misleading_predictions({LATE: sloped, one: sloped, VISCOUS: sloped}, ALL) == {LATE: sloped}
    assert misleading_predictions({LATE: flat, one: flat, VISCOUS: flat}, ALL) == {LATE: flat, one: flat}


def test_no_gain_is_predicted_where_nothing_is_hidden() -> None:
    context, _, sample = looked({})
    found = grid_search(context, context.robot, (), sample, {SOFT: PredictedGain(0.0, {})})
    assert found[SOFT].gain < 4.0


@pytest.mark.validate
def test_a_predicted_gain_is_replaced_only_by_a_larger_one() -> None:
    context, _, sample = looked({"hysteresis": {"force": 30.0, "yield_strain": 1e-4}})
    true = PredictedGain(1.0, {"force": 30.0, "yield_strain": 1e-4})
    assert grid_search(context, context.robot, (), sample, {STICKY: true}) == {STICKY: true}
    wrong = PredictedGain(1.0, {"force": 0.5, "yield_strain": 1e-5})
    better = grid_search(context, context.robot, (), sample, {STICKY: wrong})[STICKY]
    assert better.values["force"] > wrong.values["force"]
    assert better.gain > 1000.0


def test_a_predicted_gain_that_cannot_be_fitted_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    context, fitter, sample = looked({"hysteresis": {"force": 30.0, "yield_strain": 1e-4}})
    judged = fitter.judged

    def unheld(robot: Robot, chosen: Sequence[Hypothesis], sample: DataSet) -> Innovations:
        if any(setting.values["force"] == 0.5 for setting in robot.effects):
            raise UnreachableError("here", robot.platform.start, None, None)
        return judged(robot, chosen, sample)

    monkeypatch.setattr(fitter, "judged", unheld)
    unrun = PredictedGain(1.0, {"force": 0.5, "yield_strain": 1e-5})
    assert grid_search(context, context.robot, (), sample, {STICKY: unrun})[STICKY].gain > 1000.0


def test_beside_a_disturbance_the_first_samples_rank_and_all_tell_the_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    context, fitter, _ = looked({"slack": {"softness": 400.0}})
    noise = replace(fitter.noise, disturbance=disturbance_prior(context.robot, fitter.noise).median)
    recording = recorded("three", 3, {"slack": {"softness": 400.0}})
    sample = split_data(context.robot, noise, recording, recording).estimation
    count = len(sample.rows)
    beside, runs = Fitter(noise), []
    judged = beside.judged
    monkeypatch.setattr(beside, "judged", lambda *asked: runs.append(asked[2]) or judged(*asked))
    context = replace(context, fitter=beside)
    found = grid_search(context, context.robot, (), sample, {SOFT: PredictedGain(0.0, {})})[SOFT]
    assert sum(len(each.rows) == count for each in runs) == 2 < len(runs)
    without, softened = (
        judged(robot, chosen, sample).log_likelihood(sample.rows)
        for robot, chosen in (
            (context.robot, ()),
            (context.robot.with_effect(EffectSetting("slack", found.values, ALL)), (SOFT,)),
        )
    )
    assert found.gain == pytest.approx(softened - without)


def test_an_effect_that_is_not_felt_in_the_first_samples_is_looked_for_in_all(monkeypatch: pytest.MonkeyPatch) -> None:
    context, fitter, _ = looked({"slack": {"softness": 400.0}})
    noise = replace(fitter.noise, disturbance=disturbance_prior(context.robot, fitter.noise).median)
    recording = recorded("three", 3, {"slack": {"softness": 400.0}})
    sample = split_data(context.robot, noise, recording, recording).estimation
    beside = Fitter(noise)
    judged = beside.judged

    def felt_late(robot: Robot, chosen: Sequence[Hypothesis], data: DataSet) -> Innovations:
        return judged(robot, chosen, data) if data is sample else judged(context.robot, (), data)

    monkeypatch.setattr(beside, "judged", felt_late)
    context = replace(context, fitter=beside)
    found = grid_search(context, context.robot, (), sample, {SOFT: PredictedGain(0.0, {})})[SOFT]
    assert found.values == {"softness": 300.0}


def test_scales_are_looked_at_from_the_largest_each_with_all_shapes() -> None:
    groups = list(grid_points(STICKY))
    values = [each for group in groups for each in group]
    assert [len(group) for group in groups] == [3, 3, 3]
    assert [each["force"] for each in values] == [1000.0] * 3 + [100.0] * 3 + [10.0] * 3
    assert len({tuple(each.items()) for each in values}) == 9
    assert list(grid_points(VISCOUS)) == []


def test_smaller_values_are_spared_once_one_is_not_felt(monkeypatch: pytest.MonkeyPatch) -> None:
    context, fitter, sample = looked({})
    runs = []
    judged = fitter.judged
    monkeypatch.setattr(fitter, "judged", lambda *asked: runs.append(asked[0]) or judged(*asked))
    grid_search(context, context.robot, (), sample, {SOFT: PredictedGain(0.0, {})})
    assert 2 < len(runs) < 1 + len(SLACK.parameters[0].grid_values)


def test_starts_are_grouped_by_the_values_that_shape_an_effect() -> None:
    robot = example("three")
    groups = [[each.effects[0].values for each in group] for group in starts_by_shape(robot, STICKY)]
    assert [{values["yield_strain"] for values in group} for group in groups] == [{1e-5}, {1e-4}, {1e-3}]
    assert all([values["force"] for values in group] == [1000.0, 100.0, 10.0] for group in groups)
    assert starts_by_shape(robot, VISCOUS) == []
