"""The part of the page that tells where a robot errs."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.localisation.component_residuals import FaultLocalisation
from tautwire.estimation.trace_result import Trace
from tautwire.reports import trace_document, trace_page
from tautwire.reports.inline_charts import Chart, Mark, log_bar
from tests.support.pages import Page, section_of
from tests.support.traces import HOSTILE, made_trace


def localisation(trace: Trace) -> Page:
    """The section on localisation of a trace's page."""
    return section_of(trace_page(trace, {}), "where")


def test_each_component_has_its_figures_and_a_bar() -> None:
    trace = made_trace(samples=200)
    page = localisation(trace)
    assert len(page.all("tr")) == 1 + len(trace.components.residuals)
    assert len(page.all("svg")) == len(trace.components.residuals)
    for words in (trace.components.sentence, "cable 3", "force z", "5.00", "strain rate (98\u00a0%)"):
        assert words in page.text


def test_the_worst_comes_first() -> None:
    text = localisation(made_trace(samples=200)).text
    assert text.index("cable 1") < text.index("force x")


def test_what_could_not_be_localised_is_stated() -> None:
    blind = FaultLocalisation(
        np.zeros(0), (), "cannot tell", "Cannot tell which component is faulty.", ("no positions",)
    )
    page = localisation(replace(made_trace(samples=200), components=blind))
    assert page.all("table") == []
    assert "Cannot tell" in page.text and "no positions" in page.text


def test_a_ringing_force_shows_its_frequency() -> None:
    trace = made_trace(samples=200)
    loud = replace(trace.components.residuals[-1], rms=9.0, resonance_frequency=0.4512)
    shown = replace(trace.components, residuals=(*trace.components.residuals[:-1], loud))
    assert "oscillates at 0.45 Hz" in localisation(replace(trace, components=shown)).text


def test_hostile_words_are_escaped() -> None:
    trace = made_trace(samples=200)
    hostile = replace(trace.components, sentence=HOSTILE, limitations=(HOSTILE,))
    assert "img" not in [tag for tag, _ in localisation(replace(trace, components=hostile)).elements]


def test_a_bar_begins_at_the_mark_to_either_side() -> None:
    above, below = (log_bar(value, 0.1, 100.0, 1.0).marks for value in (10.0, 0.5))
    assert above[1] == below[1] == Mark("tick", "floor", pytest.approx(68.7, abs=0.05))
    assert above[0].start == above[1].start == below[0].end
    assert log_bar(float("nan"), 0.1, 100.0, 1.0) == log_bar(1.0, 0.0, 1.0, 1.0) == Chart()


def test_the_document_lists_each_component_and_the_sentence() -> None:
    trace = made_trace(samples=200)
    document = trace_document(trace)
    assert document["where"] == {
        "component": "cables (rope or winch)",
        "sentence": trace.components.sentence,
        "untold": [],
    }
    first = document["components"][0]
    assert first["moves_with"] == {"name": "strain rate", "correlation": 0.98}
    assert (first["component"], first["quantity"], first["unit"], first["ratio"]) == ("cable 1", "tension", "N", 5.0)
    assert first["rms"] == 5.0 * first["expected_rms"]
    assert document["components"][-1]["moves_with"] is None
