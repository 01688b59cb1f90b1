"""What hypotheses promise, worked out here and by workers."""

from pathlib import Path

import numpy as np
import pytest

from tautwire.estimation.effect_sensitivities import SensitivityColumn
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.filter_linearisation import linearise_filter
from tautwire.estimation.hypotheses import Hypothesis, hypotheses
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.preprocessing import prepare_data
from tautwire.estimation.score_test import (
    ScoreRun,
    ScoreStatistics,
    _predicted_gain,
    effect_sensitivities,
    score_tests,
    score_tests_in_workers,
    statistics_of_runs,
)
from tautwire.estimation.worker_pool import WorkerPool
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import EffectSetting
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.planar import VERTICAL, planar_case
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1, {"payload": {"mass": 0.5}})
NOISE = estimate_noise(ROBOT, RECORDING)
SPLIT = split_data(ROBOT, NOISE, RECORDING, None)
SAMPLE = SPLIT.estimation


@pytest.mark.validate
def test_what_is_there_has_the_largest_score_and_its_values() -> None:
    (found,) = score_tests(ROBOT, (), hypotheses(ROBOT), [ScoreRun(Fitter(NOISE), SAMPLE)])
    best = max(found, key=lambda hypothesis: found[hypothesis].gain)
    assert best.effect.name == "payload"
    assert found[best].values["mass"] == pytest.approx(0.5, rel=0.05)


@pytest.mark.validate(only=["true1"])
@pytest.mark.parametrize(
    ("name", "declared", "true"),
    [
        ("payload", {"mass": 4.0}, {"mass": 1.0}),
        ("friction", {"coefficient": 0.05}, {"coefficient": 0.03}),
        ("modulus", {"modulus": 1.1e11}, {"modulus": 1.08e11}),
    ],
)
def test_a_declared_effect_is_expected_to_change_from_its_declared_value(
    name: str, declared: dict[str, float], true: dict[str, float]
) -> None:
    effect = BY_NAME[name]
    on_all = Hypothesis(effect, () if name == "payload" else ROBOT.cable_numbers)
    robot = ROBOT.with_effect(EffectSetting(name, effect.completed_values(declared), on_all.cables))
    data = split_data(robot, NOISE, recorded("three", 1, {name: true}), None).estimation
    # Single cables beside all of them share the columns of each.
    candidates = [on_all] if name == "payload" else [on_all, Hypothesis(effect, (2,))]
    predicted = score_tests(robot, (), candidates, [ScoreRun(Fitter(NOISE), data)])[0][on_all]
    ((parameter, value),) = true.items()
    assert predicted.gain > 100.0
    assert predicted.values[parameter] == pytest.approx(value, abs=0.2 * abs(declared[parameter] - value))


def test_sensitivities_of_effects_serve_one_run_after_another() -> None:
    likelihood, values = Fitter(NOISE).likelihood(ROBOT, (), SAMPLE)
    relaxation = [h for h in hypotheses(ROBOT) if h.effect.name == "relaxation"]
    effects = effect_sensitivities(SAMPLE.placed(ROBOT), relaxation, likelihood.model.state_names)
    first, second = (
        statistics_of_runs(linearise_filter(likelihood, values, SAMPLE.recording), effects, SAMPLE.rows)
        for _ in range(2)
    )
    assert np.any(first.fisher_information)
    assert np.array_equal(first.fisher_information, second.fisher_information)


def test_a_column_of_all_cables_is_the_sum_of_those_of_each() -> None:
    likelihood, values = Fitter(NOISE).likelihood(ROBOT, (), SAMPLE)
    on_all, on_one = (Hypothesis(BY_NAME["damping"], cables) for cables in (ROBOT.cable_numbers, (1,)))
    together, apart = (
        statistics_of_runs(
            linearise_filter(likelihood, values, SAMPLE.recording),
            effect_sensitivities(SAMPLE.placed(ROBOT), chosen, likelihood.model.state_names),
            SAMPLE.rows,
        )
        for chosen in ([on_all], [on_all, on_one])
    )
    assert [column.cables for column in together.columns] == [ROBOT.cable_numbers]
    assert [column.cables for column in apart.columns] == [(cable,) for cable in ROBOT.cable_numbers]
    assert float(together.fisher_information[0, 0]) == pytest.approx(float(np.sum(apart.fisher_information)))


@pytest.mark.validate
def test_workers_compute_the_same_scores_along_all_runs_at_once() -> None:
    damped = Hypothesis(BY_NAME["damping"], ROBOT.cable_numbers)
    robot, accepted = ROBOT.with_effect(damped.setting(ROBOT)), (damped,)
    others = [h for h in hypotheses(ROBOT) if not h.overlaps(damped)]
    fitter = Fitter(NOISE)
    runs = [ScoreRun(fitter, SAMPLE), ScoreRun(fitter, SAMPLE, 0.1), ScoreRun(fitter, SAMPLE.head())]
    here = [score_tests(robot, accepted, others, [run])[0] for run in runs]
    with WorkerPool(2) as workers:
        context = IdentificationContext(ROBOT, fitter, SPLIT, workers=workers)
        apart = score_tests_in_workers(context, robot, accepted, others, runs)
    for found, expected in zip(apart, here, strict=True):
        assert list(found) == list(expected)
        for hypothesis, prospect in expected.items():
            assert found[hypothesis].gain == pytest.approx(prospect.gain, rel=1e-6, abs=1e-6)
            assert found[hypothesis].values == pytest.approx(dict(prospect.values), rel=1e-6)
    for other in here[1:]:
        assert any(here[0][hypothesis].gain != other[hypothesis].gain for hypothesis in others)


@pytest.mark.validate
def test_far_from_noise_a_coarse_grid_tells_what_scores_do_not(tmp_path: Path) -> None:
    """After a second the oscillations of a platform a fifth lighter are out of phase with the model's."""
    robot_file, fit, check = planar_case(tmp_path, VERTICAL, {"payload": {"mass": -1.0}}, 1, preferred=30.0)
    robot = read_robot(robot_file)
    with WorkerPool(1) as workers:
        ready, *_ = prepare_data(robot, read_recording(fit, 4), read_recording(check, 4), workers)
    sample = ready.split.estimation.head()
    runs = [ScoreRun(ready.fitter, sample, roughness) for roughness in (0.0, 0.1)]
    found = score_tests(robot, (), hypotheses(robot), runs)
    ranks = [sorted(prospects, key=lambda h: -prospects[h].gain) for prospects in found]
    payload = Hypothesis(BY_NAME["payload"], ())
    assert ranks[0].index(payload) > 10
    assert ranks[1].index(payload) == 0
    assert found[1][payload].values["mass"] == pytest.approx(-1.0, rel=0.2)


@pytest.mark.parametrize(("best", "kept", "value"), [(1.0, 1.0, 1.0), (20.0, 0.75, 10.0), (-1.0, 0.0, 0.0)])
def test_a_bound_before_the_best_value_leaves_what_the_way_there_gains(best: float, kept: float, value: float) -> None:
    pulley = Hypothesis(BY_NAME["pulley"], (1,))
    least, most = pulley.parameters[0].minimum, pulley.parameters[0].maximum
    assert least == 0.0
    unit = most / 10.0
    column = SensitivityColumn("pulley", (1,), "radius", 0)
    signatures = ScoreStatistics((column,), np.zeros(1), np.ones((1, 1)), np.array([-best * unit]))
    found = _predicted_gain(signatures, (), pulley, 0, {})
    assert found.gain == pytest.approx(kept * 0.5 * (best * unit) ** 2)
    assert found.values["radius"] == pytest.approx(value * unit)
