"""The document of a trace has the form that others read, and nothing that JSON cannot hold."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from tautwire.estimation.trace_result import Correlation, FittedParameter
from tautwire.reports import trace_document
from tautwire.robot.schema import Numbers
from tests.support.traces import HOSTILE, made_trace, nothing_found, without_positions

# The example of the agreed format, with one entry of each kind.
AGREED: dict[str, Any] = json.loads("""
{"verdict": "effects",
 "effects": [{"name": "damping", "cables": [1, 2, 3],
              "parameters": {"damping": {"value": 2.1e9, "unit": "Pa s", "low": 2.0e9, "high": 2.2e9}},
              "component": "cable", "evidence": 812.4}],
 "also_possible": [["creep", "thermal"]],
 "formula": null,
 "error_before": {"fit": {"position_rms": 0.0, "tension_rms": 0.0},
                  "check": {"position_rms": 0.0, "tension_rms": 0.0}},
 "error_after":  {"fit": {"position_rms": 0.0, "tension_rms": 0.0},
                  "check": {"position_rms": 0.0, "tension_rms": 0.0}},
 "noise_floor": {"position_rms": 0.0, "tension_rms": 0.0},
 "residual_is_noise": {"before": false, "after": true},
 "seconds": 12.3}
""")


def assert_holds_form(document: Any, form: Any, place: str = "report") -> None:
    """Every key of the form is there with a value of the same kind; lists by their first entry."""
    if isinstance(form, dict):
        assert isinstance(document, dict), place
        for key, value in form.items():
            assert key in document, f"{place}.{key}"
            assert_holds_form(document[key], value, f"{place}.{key}")
    elif isinstance(form, list):
        assert isinstance(document, list) and document, place
        for entry in document:
            assert_holds_form(entry, form[0], f"{place}[]")
    else:
        assert type(document) is type(form), f"{place} is {document!r}"


def plain(document: Any) -> bool:
    """Whether a value is made of exactly the types that JSON has, with finite numbers only."""
    if isinstance(document, dict):
        return all(type(key) is str and plain(value) for key, value in document.items())
    if isinstance(document, list):
        return all(plain(value) for value in document)
    if type(document) is float:
        return math.isfinite(document)
    return document is None or type(document) in (str, int, bool)


def test_every_agreed_key_is_there() -> None:
    assert_holds_form(trace_document(made_trace()), AGREED)


def test_values_are_those_of_the_trace() -> None:
    trace = made_trace()
    document = trace_document(trace)
    fit, check = trace.comparisons
    assert document["verdict"] == "effects"
    assert document["error_before"]["fit"]["position_rms"] == fit.errors_before.position_rms
    assert document["error_after"]["check"]["tension_rms"] == check.errors_after.tension_rms
    assert document["error_before"]["fit"]["axes"] == dict(zip("xyz", fit.errors_before.axes, strict=True))
    assert document["noise_floor"]["tension_rms"] == trace.noise_floor.tension_rms
    assert document["residual_is_noise"] == {"before": False, "after": True}
    assert document["also_possible"] == [["relaxation"], ["creep", "thermal"]]
    damping = document["effects"][0]["parameters"]["damping"]
    values = {"value": 2.1034e9, "unit": "Pa s", "low": 2.05e9, "high": 2.16e9, "declared": 4e8}
    assert damping == {**values, "dominant_uncertainty": ""}
    assert document["seconds"] == 12.34
    assert list(document["left"]) == ["x", "y", "z", "tension_1", "tension_2", "tension_3"]


def test_sizes_that_would_have_shown_and_what_looks_alike_are_there() -> None:
    document = trace_document(made_trace())
    payload, relaxation, slack = document["detectable"]
    assert (payload["parameter"], payload["size"], payload["unit"]) == ("mass", 0.0195, "kg")
    assert relaxation["beside"] == {"time": 30.0}
    assert slack["size"] is None
    assert document["alike"][0]["other"] == "relaxation"
    assert document["alike"][0]["cosine"] == 0.973


def test_correlations_name_the_parameters_as_the_effects_do() -> None:
    between = (FittedParameter("damping", (1, 2, 3), "damping"), FittedParameter("payload", (), "mass"))
    document = trace_document(replace(made_trace(), correlations=(Correlation(between, np.float64(-0.42)),)))
    assert document["correlations"] == [
        {
            "between": [
                {"name": "damping", "cables": [1, 2, 3], "parameter": "damping"},
                {"name": "payload", "cables": [], "parameter": "mass"},
            ],
            "value": -0.42,
        }
    ]
    assert plain(document)


def test_without_check_recording_its_errors_are_null() -> None:
    document = trace_document(made_trace(check=False))
    for field in ("error_before", "error_after"):
        assert list(document[field]) == ["fit", "check"]
        assert document[field]["check"]["position_rms"] is None
        assert document[field]["check"]["tension_rms"] is None
        assert document[field]["fit"]["tension_rms"] > 0.0


def test_without_check_recording_a_rigid_platform_has_the_same_keys_for_both() -> None:
    trace = made_trace(check=False)
    (fit,) = trace.comparisons
    rotations = np.array([1e-3, 2e-3, 3e-3])
    turning, floor = (
        replace(each, orientation_rms=2e-3, rotations=rotations) for each in (fit.errors_before, trace.noise_floor)
    )
    platform = replace(trace.robot_before.platform, inertia=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    document = trace_document(
        replace(
            trace,
            robot_before=replace(trace.robot_before, platform=platform),
            comparisons=(replace(fit, errors_before=turning, errors_after=turning),),
            noise_floor=floor,
            normalised_innovation_variance=np.ones(9),
            autocorrelations=(np.zeros(9), np.zeros(9)),
        )
    )
    for errors in (document["error_before"], document["error_after"]):
        assert list(errors["fit"]) == list(errors["check"])
        assert errors["fit"]["rotations"] == {"x": 1e-3, "y": 2e-3, "z": 3e-3}
        assert errors["check"]["orientation_rms"] is None
        assert errors["check"]["rotations"] == {"x": None, "y": None, "z": None}


@pytest.mark.parametrize("strange", [math.nan, math.inf, -math.inf])
def test_null_replaces_what_is_not_finite(strange: float) -> None:
    trace = made_trace()
    trace = replace(
        trace,
        normalised_innovation_variance=np.full(6, strange),
        autocorrelations=(np.full(6, strange), np.full(6, strange)),
        noise_floor=replace(trace.noise_floor, tension_rms=strange),
        effects=(replace(trace.effects[0], evidence=strange),),
    )
    document = trace_document(trace)
    assert document["noise_floor"]["tension_rms"] is None
    assert document["effects"][0]["evidence"] is None
    assert set(document["left"].values()) == {None}
    assert set(document["autocorrelation"].values()) == set(document["autocorrelation_of_noise"].values()) == {None}


@pytest.mark.parametrize(
    "trace",
    [made_trace(), made_trace(eight=True, name=HOSTILE), without_positions(made_trace()), nothing_found(made_trace())],
)
def test_holds_plain_values_only_and_survives_json(trace: Any) -> None:
    document = trace_document(trace)
    assert plain(document)
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_plain_numbers_come_from_numpy_ones() -> None:
    trace = made_trace()
    candidate = replace(
        trace.candidates[0],
        round=np.int64(1),
        evidence=np.float64(3.0),
        accepted=cast(bool, np.bool_(True)),
        cables=(np.int64(2),),
        values=Numbers({"damping": np.float64(2.0)}),
    )
    noise = cast(bool, np.bool_(False))
    assert plain(trace_document(replace(trace, candidates=(candidate,), noise_before=noise, alpha=np.float64(0.01))))


def test_keys_come_in_the_same_order_each_time() -> None:
    one, other = (json.dumps(trace_document(made_trace())) for _ in range(2))
    assert one == other


def test_a_verdict_without_effects_has_empty_lists() -> None:
    document = trace_document(nothing_found(made_trace()))
    assert (document["verdict"], document["effects"], document["also_possible"]) == ("none", [], [])
    assert document["residual_is_noise"] == {"before": True, "after": True}
