"""What a trace found as inputs of a campaign: its effects are on, its numbers vary by their intervals, together."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.campaigns.campaign_plan import Plan
from tautwire.campaigns.campaign_run import Job, build_context, run_job
from tautwire.campaigns.input_sampling import draw_samples
from tautwire.campaigns.plan_file import read_plan
from tautwire.errors import InputError
from tautwire.estimation.effect_estimates import estimated_effects, parameter_correlations
from tautwire.estimation.estimation_data import DataSplit
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.selection_result import SelectionResult
from tautwire.reports import trace_document
from tautwire.robot.robot_file_reader import robot_from_content
from tests.support.campaigns import plan_file, read
from tests.support.fits import fitted
from tests.support.traces import made_trace

SAMPLED = 'robot = "robot.toml"\nseed = 3\n[sample]\nmethod = "sobol"\ncount = 4096\n[found]\nreport = "report.json"\n'
DAMPING = {"value": 2.0e9, "unit": "Pa s", "low": 1.9e9, "high": 2.1e9}
MODULUS = {"value": 1.0e11, "unit": "Pa", "low": 9.0e10, "high": 1.1e11}
MASS = {"value": 1.5, "unit": "kg", "low": 1.4, "high": 1.6}
ALL = [1, 2, 3]


def effect(name: str, cables: list[int], estimate: dict[str, Any]) -> dict[str, Any]:
    """One with a parameter."""
    return {"name": name, "cables": cables, "parameters": {"mass" if name == "payload" else name: estimate}}


def together(one: dict[str, Any], other: dict[str, Any], value: float | None) -> dict[str, Any]:
    """How two effects' only parameters go together."""
    named = [{"name": e["name"], "cables": e["cables"], "parameter": next(iter(e["parameters"]))} for e in (one, other)]
    return {"between": named, "value": value}


def planned(folder: Path, effects: list[Any], correlations: list[Any] | None = None, more: str = "") -> Plan:
    """The plan that varies what a report found."""
    document = {"effects": effects} if correlations is None else {"effects": effects, "correlations": correlations}
    (folder / "report.json").write_text(json.dumps(document), encoding="utf-8")
    return read(folder, SAMPLED + more)


def test_numbers_vary_by_their_intervals_and_effects_are_on(tmp_path: Path) -> None:
    plan = planned(tmp_path, [effect("damping", ALL, DAMPING), effect("modulus", [2], MODULUS)])
    assert plan.keys == ("effect.damping.damping", "effect.modulus.modulus")
    assert plan.inputs[0].distribution.numbers == pytest.approx((2.0e9, 1e8 / 1.959963985))
    assert plan.content["effect"]["modulus"] == {"modulus": 1e11, "cables": [2]}
    assert np.quantile(draw_samples(plan)[:, 0], [0.025, 0.975]) == pytest.approx([1.9e9, 2.1e9], rel=1e-3)


def test_a_number_without_interval_stays(tmp_path: Path) -> None:
    effects = [effect("damping", ALL, {**DAMPING, "low": None, "high": None}), effect("modulus", [2], MODULUS)]
    plan = planned(tmp_path, effects, [])
    assert plan.keys == ("effect.modulus.modulus",) and plan.content["effect"]["damping"] == {"damping": 2e9}
    assert plan.notes == ("effect.damping.damping stays at 2e+09: report.json gives it no interval",)


def test_numbers_vary_together_as_the_report_says(tmp_path: Path) -> None:
    effects = [effect("damping", ALL, DAMPING), effect("payload", [], MASS), effect("modulus", [2], MODULUS)]
    pairs = [(0, 1, 0.9), (0, 2, -0.3), (1, 2, -0.6)]
    plan = planned(tmp_path, effects, [together(effects[k], effects[i], value) for i, k, value in pairs])
    expected = np.array([[1.0, 0.9, -0.3], [0.9, 1.0, -0.6], [-0.3, -0.6, 1.0]])
    assert plan.notes == () and np.allclose(np.corrcoef(draw_samples(plan).T), expected, atol=0.02)
    apart = planned(tmp_path, effects, [together(effects[0], effects[1], 0.9)], "correlated = false")
    assert apart.notes == () and np.allclose(np.corrcoef(draw_samples(apart).T), np.eye(3), atol=0.02)
    assert apart.digest() != plan.digest()


def test_correlations_missing_from_a_report_are_noted(tmp_path: Path) -> None:
    effects = [effect("damping", ALL, DAMPING), effect("payload", [], MASS), effect("modulus", [2], MODULUS)]
    (note,) = planned(tmp_path, effects).notes
    assert note == "report.json gives no correlation of 3 of 3 pairs of its numbers: taken as independent"
    some = [together(effects[0], effects[1], 0.9), together(effects[0], effects[2], None)]
    plan = planned(tmp_path, effects, some)
    assert "no correlation of 2 of 3 pairs" in plan.notes[0]
    assert [(each.first, each.second, each.value) for each in plan.correlations] == [(0, 1, 0.9)]


def test_the_plan_has_the_last_word_on_correlations(tmp_path: Path) -> None:
    effects = [effect("damping", ALL, DAMPING), effect("payload", [], MASS)]
    more = '[[correlation]]\nbetween = ["effect.payload.mass", "effect.damping.damping"]\nvalue = {}\n'
    for value, expected in ((0.5, [0.5]), (0.0, [])):
        plan = planned(tmp_path, effects, [together(*effects, 0.9)], more.format(value))
        assert [each.value for each in plan.correlations] == expected


def test_numbers_of_which_one_tells_the_other_are_sampled(tmp_path: Path) -> None:
    effects = [effect("damping", ALL, DAMPING), effect("payload", [], MASS)]
    values = draw_samples(planned(tmp_path, effects, [together(*effects, -1.0)]))
    scaled = (values - [2e9, 1.5]) / [1e8, 0.1]
    assert np.allclose(scaled[:, 0], -scaled[:, 1], atol=1e-6) and np.ptp(scaled[:, 0]) > 2.0


def test_what_was_found_takes_the_place_of_what_was_declared(tmp_path: Path) -> None:
    file = plan_file(tmp_path, SAMPLED)
    robot = file.with_name("robot.toml")
    robot.write_text(robot.read_text(encoding="utf-8") + "\n[effect.damping]\ndamping = 1e9\n", encoding="utf-8")
    effects = [effect("damping", [2], DAMPING), effect("damping", [3], {**DAMPING, "value": 3e9})]
    (tmp_path / "report.json").write_text(json.dumps({"effects": effects}), encoding="utf-8")
    plan = read_plan(file)
    assert plan.keys == ("effect.damping[2].damping", "effect.damping[3].damping")
    job = Job(0, 0, 0, (2.1e9, 3.1e9))
    assert "failure" not in run_job(build_context(plan, {}), job, tmp_path).row
    settings = robot_from_content(dict(plan.content), plan.file).effects
    assert [(each.values["damping"], each.cables) for each in settings] == [(1e9, (1,)), (2e9, (2,)), (3e9, (3,))]


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"effects": []}, "has no effect whose parameters could vary"),
        ({"verdict": "none"}, "is not a report of a trace"),
        ({"effects": [effect("damping", ALL, DAMPING), effect("damping", [2], DAMPING)]}, "on a cable twice"),
        ({"effects": [effect("damping", ALL, {**DAMPING, "value": float("nan")})]}, "is not a report of a trace"),
        ({"effects": [effect("damping", ALL, {**DAMPING, "high": float("inf")})]}, "is not a report of a trace"),
        ({"effects": [effect("damping", ALL, {**DAMPING, "value": 10**400})]}, "is not a report of a trace"),
        ({"effects": [{**effect("damping", ALL, DAMPING), "cables": [float("inf")]}]}, "is not a report of a trace"),
        ({"effects": [effect("damping", [4], DAMPING)]}, "must be from 1 to 3"),
        ({"effects": [effect("dampin", ALL, DAMPING)]}, "is not a known effect"),
        ({"effects": [effect("payload", [], MASS)], "correlations": [{"between": [], "value": 0.1}]}, "not a report"),
        (
            {"effects": [effect("payload", [], MASS)],
             "correlations": [together(effect("payload", [], MASS), effect("damping", ALL, DAMPING), 1.5)]},
            "is not a report",
        ),
    ],
)  # fmt: skip
def test_what_is_no_report_is_refused(document: dict[str, Any], said: str, tmp_path: Path) -> None:
    file = plan_file(tmp_path, SAMPLED)
    (tmp_path / "report.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read(tmp_path, file.read_text(encoding="utf-8"))
    assert said in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.validate
def test_samples_spread_as_the_fit_of_a_recording_does(tmp_path: Path) -> None:
    fitter, chosen, sample, fit = fitted(3)
    result = SelectionResult(tuple(chosen), (1.0, 1.0), fit, (), ())
    context = IdentificationContext(fit.robot, fitter, DataSplit(sample, sample, ()))
    effects = estimated_effects(context, result)
    trace = replace(made_trace(), effects=effects, correlations=parameter_correlations(fit, effects))
    (tmp_path / "report.json").write_text(json.dumps(trace_document(trace)), encoding="utf-8")
    plan = read(tmp_path, SAMPLED)
    assert plan.keys == ("effect.payload.mass", "effect.sensor_gain.tension_gain") and plan.notes == ()
    values = draw_samples(plan)
    assert values.mean(axis=0) == pytest.approx(fit.values, rel=1e-3)
    assert np.cov(values.T) == pytest.approx(fit.covariance, rel=0.01)


def test_what_a_report_has_beside_its_effects_is_noted(tmp_path: Path) -> None:
    document = {
        "effects": [effect("damping", ALL, DAMPING)],
        "correlations": [],
        "formula": "frame: compliance = 3.3e-07 m/N",
        "small_effects": [effect("payload", [], MASS)],
    }
    (tmp_path / "report.json").write_text(json.dumps(document), encoding="utf-8")
    assert read(tmp_path, SAMPLED).notes == (
        "the formula frame: compliance = 3.3e-07 m/N of report.json is left out: its own robot.toml has it",
        "the effect payload of report.json is left out: its own robot.toml has it",
    )


def test_an_interval_that_ends_at_a_bound_gives_no_deviation(tmp_path: Path) -> None:
    at_bound = {"value": 2.0e9, "unit": "Pa s", "low": 0.0, "high": 2.1e9}
    plan = planned(tmp_path, [effect("damping", ALL, at_bound), effect("modulus", [2], MODULUS)], [])
    assert plan.keys == ("effect.modulus.modulus",)
    assert plan.notes == ("effect.damping.damping stays at 2e+09: report.json gives it no interval",)
