"""Hypotheses on the page and the terminal: those fitted apart from those whose predicted gain was too small."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Console

from tautwire.estimation.trace_result import Candidate, Trace
from tautwire.reports import trace_page, trace_table
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
