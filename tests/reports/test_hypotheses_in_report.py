"""Hypotheses on the page and the terminal: those fitted apart from those whose predicted gain was too small."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rich.console import Console

from tautwire.estimation.trace_result import Candidate, Estimate, FoundEffect, Trace
from tautwire.number_format import ABSENT_TEXT
from tautwire.reports import trace_page, trace_table
from tautwire.reports.page_rendering import Number
from tautwire.reports.trace_report_page import _effect_rows, _unfitted_row
from tests.support.pages import section_of
from tests.support.traces import made_trace


def with_hopeless_round() -> Trace:
    """A trace whose second round fitted nothing."""
    trace = made_trace(samples=200)
    hopeless = tuple(
        Candidate(2, "creep", (i,), {"time": 10.0}, 0.0, float("nan"), False, ("time",)) for i in (1, 2, 3)
    )
    return replace(trace, candidates=(*(each for each in trace.candidates if each.round == 1), *hopeless))


def test_page_folds_away_what_was_not_fitted() -> None:
    page = section_of(trace_page(with_hopeless_round(), {}), "candidates")
    assert "3 not fitted, predicted gain too small" in page.text
    assert "No predicted gain was large enough for a fit." in page.text
    assert "1 not fitted" in page.text  # drag, in the first round
    assert page.text.index("damping") < page.text.index("1 not fitted") < page.text.index("drag")


def test_values_are_those_that_were_fitted() -> None:
    trace = made_trace(samples=200)
    values = {"drag_area": 6.2, "density": 1.2, "wind_x": 0.0}
    drag = Candidate(1, "drag", (), values, 40.0, 1.0, False, ("drag_area",))
    trace = replace(trace, candidates=(drag,))
    console = Console(width=200, color_system=None)
    with console.capture() as captured:
        console.print(trace_table(trace))
    for text in (captured.get(), section_of(trace_page(trace, {}), "candidates").text):
        assert "drag_area 6.20 m²" in text
        assert "density" not in text and "wind_x" not in text


def test_effects_on_no_cable_are_on_the_platform() -> None:
    page = section_of(trace_page(made_trace(samples=200), {}), "candidates")
    assert "payloadplatform" in page.text


def test_terminal_leaves_out_what_was_not_fitted() -> None:
    console = Console(width=80, color_system=None)
    with console.capture() as captured:
        console.print(trace_table(with_hopeless_round()))
    text = " ".join(captured.get().split())
    assert "creep 1" not in text and "drag" not in text
    assert "no predicted gain" in text and "or not fitted" in text


def test_an_effect_with_two_parameters_is_named_once() -> None:
    trace = made_trace()
    estimate = Estimate(1.0, "N", 0.9, 1.1, None)
    effect = FoundEffect("hysteresis", "cable", (2,), {"force": estimate, "yield_strain": estimate}, 40.0)
    rows = _effect_rows(trace, effect)
    assert [row[:3] for row in rows] == [["hysteresis", "cable 2", "force"], ["", "", "yield_strain"]]


def test_a_prediction_without_effect_is_a_dash() -> None:
    trace = made_trace()
    sag = Candidate(1, "sag", (3,), {"linear_density": 0.0, "catenary": 0.0}, 0.0, np.nan, False, ("linear_density",))
    predicted = replace(sag, values={"linear_density": 0.5, "catenary": 0.0})
    texts = [_unfitted_row(trace, each)[2] for each in (sag, predicted)]
    assert texts == [Number(ABSENT_TEXT), Number("linear_density 0.500 kg/m")]
