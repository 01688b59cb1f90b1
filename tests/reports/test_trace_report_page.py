"""The page: well formed, complete, self-contained, and deaf to what hostile names say."""

from __future__ import annotations

import base64
import gzip
import io
import json
import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from markupsafe import escape
from rich.console import Console

from tautwire.estimation.trace_result import Correlation, FittedParameter, Identifiability, Trace
from tautwire.provenance import PROVENANCE_KEY, Provenance
from tautwire.reports import trace_document, trace_page, trace_table, write_report
from tautwire.reports.downsampling import (
    envelope_times,
    min_max_envelope,
    pack_float32,
    residual_spectra,
    unpack_float32,
    white_noise_density,
)
from tautwire.reports.robot_scene import deviation_magnification
from tautwire.reports.trace_figures import MAX_CURVE_POINTS, trace_page_data
from tautwire.reports.trace_texts import runners_up
from tautwire.robot.robot_file_reader import read_robot
from tests.support.pages import FETCHING, MAX_PAGE_BYTES, Page
from tests.support.traces import HOSTILE, TENSION_NOISE, made_trace, nothing_found, without_positions

LINKS = {"robot.toml": "robot.toml", "cable 1": "fmus/cable 1.fmu"}
SECTIONS = (
    "summary",
    "found",
    "possible",
    "robot",
    "residuals",
    "spectra",
    "where",
    "candidates",
    "left",
    "unseen",
    "notes",
)


@cache
def page(kind: str) -> Page:
    """A parsed page, made once."""
    traces = {
        "three": lambda: made_trace(),
        "eight": lambda: made_trace(eight=True),
        "hostile": lambda: replace(made_trace(name=HOSTILE, path=HOSTILE), sentence=HOSTILE, notes=(HOSTILE,) * 3),
        "none": lambda: nothing_found(made_trace()),
        "tensions only": lambda: without_positions(made_trace(check=False)),
    }
    return Page(trace_page(traces[kind](), LINKS))


KINDS = ("three", "eight", "hostile", "none", "tensions only")


@pytest.mark.parametrize("kind", KINDS)
def test_page_is_well_formed_with_all_sections(kind: str) -> None:
    result = page(kind)
    assert result.open == []
    assert tuple(each["id"] for each in result.all("section")) == SECTIONS
    identities = [attributes["id"] for _, attributes in result.elements if "id" in attributes]
    assert len(identities) == len(set(identities))
    assert [len(result.all(tag)) for tag in ("h1", "main", "title")] == [1, 1, 1]


@pytest.mark.parametrize("kind", ["three", "eight"])
def test_terms_of_art_are_explained_where_they_first_stand(kind: str) -> None:
    text = " ".join(page(kind).text.split())
    for term, explained in {
        "rms": "Root mean square (rms) of measured minus co-simulated",
        "oise floor": "The noise floor is what noise of the sensors",
        "xtended model": "by the model with the effects found (the extended model)",
        "xplained": "Explained is the share of the mean square above the floor",
        "vidence": "Evidence tells how much more probable",
        "95 % interval": "In 95 of 100 such recordings the 95 % interval holds the true value",
        "mplitude spectral density": "Amplitude spectral density of the same residuals",
        "correlation": "follows best, with the correlation coefficient",
        "innovations": "one-step predictions (innovations)",
    }.items():
        place = text.index(explained)
        body = text.index("Before and after")
        assert text.find(term, body) >= 0 and place <= text.find(term, body) + len(explained), term
    for jargon in ("nats", "Nats", "cosine", "Cosine", "e-value", "\u03c3"):
        assert jargon not in text


def test_page_says_what_effects_were_judged_on() -> None:
    assert "judged on “check”" in page("three").text
    alone = page("tensions only").text
    assert "one part of the recording and judged on another" in alone and "“check”" not in alone


def test_numbers_of_the_page_have_four_digits_at_most_but_where_an_interval_asks() -> None:
    result = made_trace(samples=400)
    loud = replace(result, candidates=(replace(result.candidates[0], evidence=163595.3645), *result.candidates[1:]))
    text = Page(trace_page(loud, {})).text
    assert "163600" in text and "163595" not in text
    assert "13.3\u00b0" in text and "0.973" not in text  # how like relaxation is to damping
    digits = re.findall(r"(?<![\w.])\d+\.\d+(?![\w.])", text)
    assert digits
    assert [each for each in digits if len(each.replace(".", "").lstrip("0")) > 4] == []


def test_deviations_are_drawn_so_large_that_they_are_seen_and_the_path_too() -> None:
    anchors = np.array(((0.0, 0.0, 50.0), (100.0, 0.0, 50.0)))
    path = np.linspace((50.0, 0.0, 5.0), (58.0, 0.0, 5.0), 50)
    apart = np.zeros((50, 3))
    apart[7, 2] = 2e-3
    assert deviation_magnification(anchors, path, [apart]) == 100  # 1000 times would be 2 m beside a path of 8 m
    assert deviation_magnification(anchors, path[:1].repeat(50, axis=0), [apart]) == 1000
    assert deviation_magnification(anchors, path, [np.zeros((50, 3))]) == 1


def test_page_says_what_would_have_shown_and_what_never() -> None:
    content = trace_page(made_trace(samples=200), {})
    assert "0.0195" in content
    assert "never" in content[content.index("Smallest sizes") :]
    nothing = replace(made_trace(samples=200), identifiability=Identifiability((), ()))
    assert "no size can be given" in trace_page(nothing, {})


@pytest.mark.parametrize("kind", KINDS)
def test_page_asks_nothing_of_the_network(kind: str) -> None:
    for tag, attributes in page(kind).elements:
        assert not FETCHING & set(attributes), tag
        assert not re.match(r"(?i)\s*([a-z]+:|//)", attributes.get("href", "")), attributes
    policy = next(each for each in page(kind).all("meta") if each.get("http-equiv"))
    assert policy["content"].startswith("default-src 'none'")


def test_style_fetches_nothing() -> None:
    assert not re.search(r"@import|url\(", trace_style(), re.IGNORECASE)


def trace_style() -> str:
    """The page's style sheet."""
    content = trace_page(made_trace(samples=200), {})
    return content[content.index("<style>") : content.index("</style>")]


def test_plotly_is_there_once_and_packed() -> None:
    scripts = page("three").scripts
    assert len(scripts) == 3
    assert "plotly.js (gl3d - minified) v4" in gzip.decompress(base64.b64decode(scripts[1])).decode()[:200]


@pytest.mark.validate(but=["False"])
@pytest.mark.parametrize("eight", [False, True])
def test_page_stays_small_for_long_recordings(eight: bool) -> None:
    assert len(trace_page(made_trace(eight, samples=120_000), LINKS).encode()) < MAX_PAGE_BYTES


def test_verdict_numbers_and_links_are_written_without_scripts() -> None:
    result = page("three")
    for words in ("The cables damp 5.3 times", "2.103", "2.050 to 2.160", "812.4", "creep + thermal", "drum effects"):
        assert words in result.text
    assert result.links() == ["robot.toml", "fmus/cable%201.fmu"]


def test_hostile_names_are_shown_and_do_nothing() -> None:
    plain, hostile = page("three"), page("hostile")
    assert [tag for tag, _ in hostile.elements] == [tag for tag, _ in plain.elements]
    assert all(set(a) == set(b) for (_, a), (_, b) in zip(hostile.elements, plain.elements, strict=True))
    assert hostile.text.count(HOSTILE) >= 3
    assert len(hostile.scripts) == len(plain.scripts)


def test_hostile_links_stay_paths_beside_the_page() -> None:
    content = trace_page(made_trace(samples=200), {HOSTILE: 'javascript:alert(1)"><script>alert(2)</script>'})
    target = Page(content).links()[0]
    assert target.startswith("javascript%3A") and '"' not in target and "<" not in target


def test_hostile_effects_and_columns_are_escaped() -> None:
    trace = made_trace(samples=200)
    effect = replace(trace.effects[0], name=HOSTILE, component=HOSTILE, parameters={HOSTILE: _estimate(trace)})
    candidate = replace(trace.candidates[0], name=HOSTILE, values={HOSTILE: 1.0}, form=(HOSTILE,))
    recording = replace(trace.comparisons[0].recording, unknown_columns=(HOSTILE, "\u202e\udc80"))
    comparison = replace(trace.comparisons[0], recording=recording)
    strange = replace(
        trace, effects=(effect,), candidates=(candidate,), also_possible=((HOSTILE,),), formula=HOSTILE,
        comparisons=(comparison,),
    )  # fmt: skip
    content = trace_page(strange, {})
    assert content.encode("utf-8")
    assert "img" not in [tag for tag, _ in Page(content).elements]
    assert len(Page(content).scripts) == 3


def _estimate(trace: Trace) -> Any:
    return replace(trace.effects[0].parameters["damping"], unit=HOSTILE)


@pytest.mark.parametrize(("kind", "cables"), [("three", 3), ("eight", 8)])
def test_every_figure_has_data_for_both_recordings(kind: str, cables: int) -> None:
    found, data = page(kind), page(kind).data()
    panels = [each for each in found.all("figure") if "data-kind" in each]
    assert len(panels) == 2 * (3 + cables)
    assert [each["role"] for each in data["choices"]] == ["fit", "check"]
    for recording in data["choices"]:
        time = unpack_float32(recording["time"])
        for panel in panels:
            channel = recording["channels"][int(panel["data-channel"])]
            drawn = channel if panel["data-kind"] == "residual" else channel["spectrum"]
            across = time if panel["data-kind"] == "residual" else unpack_float32(drawn["frequency"])
            for name in ("before", "after"):
                values = unpack_float32(drawn[name])
                assert values.size == across.size > 50
                assert np.isfinite(values).mean() > 0.9
        scene = recording["scene"]
        assert [path["name"] for path in scene["paths"]] == ["measured", "before", "after"]
        for columns in (*(path["columns"] for path in scene["paths"]), scene["platform"], scene["tension"]):
            assert all(unpack_float32(column).size == unpack_float32(scene["time"]).size for column in columns)
    assert len(data["anchors"]) == cables


def test_what_no_recording_has_gets_no_panel_and_no_row() -> None:
    labels = re.findall(r"<figcaption><strong>([^<]*)</strong>", trace_page(without_positions(made_trace()), LINKS))
    assert "cable 1" in labels
    assert not {"x", "y", "z"} & set(labels)
    assert "Fit, position" not in trace_page(without_positions(made_trace()), LINKS)


def test_what_was_not_measured_is_null_not_nan() -> None:
    recording = page("tensions only").data()["choices"][0]
    assert recording["channels"][0]["before"] is None and recording["channels"][0]["sigma"] is None
    assert [path["name"] for path in recording["scene"]["paths"]] == ["before", "after"]
    assert recording["channels"][3]["before"] is not None
    assert recording["channels"][3]["sigma"] == TENSION_NOISE  # the floor, as the file declares none


@pytest.mark.parametrize("kind", KINDS)
def test_controls_and_figures_have_names(kind: str) -> None:
    result = page(kind)
    assert all(
        each.get("aria-label") for tag, each in result.elements if each.get("role") in ("img", "region", "group")
    )
    assert result.all("html")[0]["lang"] == "en"
    labelled = [tag for tag, _ in result.elements].count("label")
    assert labelled == len(result.all("input")) + len(result.all("select"))
    assert all(each["aria-hidden"] == "true" for each in result.all("svg"))
    assert len(result.all("caption")) == len(result.all("table"))


def test_page_follows_light_and_dark() -> None:
    assert "prefers-color-scheme: dark" in trace_style()
    assert "prefers-color-scheme: dark" in page("three").scripts[2]


def test_short_recordings_and_still_robots_make_a_page() -> None:
    short = made_trace(samples=8)
    assert trace_page_data(short)["choices"][0]["channels"][0]["spectrum"] is None
    assert Page(trace_page(short, {})).open == []


def test_diverged_model_makes_a_page() -> None:
    trace = made_trace(samples=400)
    gone = replace(trace.comparisons[0].before, position=np.full((400, 3), np.nan), tension=np.full((400, 3), np.inf))
    errors = replace(trace.comparisons[0].errors_before, position_rms=np.inf, tension_rms=np.nan)
    comparison = replace(trace.comparisons[0], before=gone, errors_before=errors)
    assert Page(trace_page(replace(trace, comparisons=(comparison,)), {})).data()["choices"]


def test_envelope_keeps_peaks_order_and_gaps() -> None:
    values = np.sin(np.linspace(0.0, 50.0, 100_001))
    values[12_345], values[77_777], values[40_000:42_000] = 9.0, -7.0, np.nan
    drawn = min_max_envelope(values, MAX_CURVE_POINTS)
    time = envelope_times(np.arange(values.size, dtype=float), MAX_CURVE_POINTS)
    assert drawn.size == time.size <= MAX_CURVE_POINTS
    assert (np.diff(time) >= 0.0).all()
    assert (np.nanmax(drawn), np.nanmin(drawn)) == (9.0, -7.0)
    assert abs(time[np.nanargmax(drawn)] - 12_345) < 100
    assert np.isnan(drawn[(time > 40_100) & (time < 41_900)]).all()
    short = np.array([1.0, np.nan, 3.0])
    assert np.array_equal(min_max_envelope(short, MAX_CURVE_POINTS), short, equal_nan=True)


def test_spectrum_of_noise_lies_on_the_noise_line_and_a_tone_above() -> None:
    random, time = np.random.default_rng(3), np.linspace(0.0, 399.99, 40_000)
    noise = random.normal(0.0, 2.0, time.size)
    result = residual_spectra(time, noise + np.sin(2 * np.pi * 5.0 * time), noise)
    assert result is not None
    level = white_noise_density(2.0, time)
    assert np.median(result.after) == pytest.approx(level, rel=0.05)
    assert result.frequency[np.argmax(result.before)] == pytest.approx(5.0, rel=0.03)
    assert result.before.max() > 3.0 * level


def test_packing_keeps_numbers_and_turns_the_infinite_into_gaps() -> None:
    assert np.array_equal(
        unpack_float32(pack_float32(np.array([1.5, np.nan, np.inf]))), [1.5, np.nan, np.nan], equal_nan=True
    )


@pytest.mark.validate
def test_folder_holds_robot_fmus_report_and_page_that_links_them(tmp_path: Path) -> None:
    trace = made_trace(samples=200)
    provenance = Provenance("0.1.0", "tautwire trace '<b>.toml'", "2026-01-02T03:04:05Z", {"<b>.toml": "ab" * 32})
    fmus = write_report(trace, tmp_path, provenance)
    assert read_robot(tmp_path / "robot.toml") == trace.robot_after
    assert (tmp_path / "robot.toml").read_text(encoding="utf-8").startswith(provenance.comment())
    document = {**trace_document(trace), "provenance": provenance.document()}
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8")) == document
    metadata = pq.read_schema(tmp_path / "residuals.parquet").metadata
    assert json.loads(metadata[PROVENANCE_KEY.encode()]) == provenance.document()
    footer = (tmp_path / "index.html").read_text(encoding="utf-8").rpartition("<footer>")[2].partition("</footer>")[0]
    assert all(escape(text) in footer for text in ("tautwire trace '<b>.toml'", provenance.created, "ab" * 32))
    links = Page((tmp_path / "index.html").read_text(encoding="utf-8")).links()
    assert sorted(links) == sorted(path.name for path in tmp_path.iterdir() if path.name != "index.html")
    assert {path.name for path in (*fmus.cables, fmus.platform)} < set(links)


def test_the_next_best_effect_stands_beside_the_one_that_was_taken() -> None:
    trace = made_trace()
    told = "modulus, all cables: 64.2 of 812.4"
    page = Page(trace_page(trace, {}))
    assert f"damping: {told}" in page.text.replace("\N{NO-BREAK SPACE}", " ")
    console = Console(file=io.StringIO(), width=80)
    console.print(trace_table(trace))
    assert isinstance(console.file, io.StringIO)
    assert f"damping: {told}" in console.file.getvalue()
    alone = tuple(each for each in trace.candidates if each.name == "damping" or not math.isfinite(each.evidence))
    assert not runners_up(replace(trace, candidates=alone))
    on_other_cables = replace(trace.candidates[0], cables=(3,))
    of_other = (on_other_cables, *trace.candidates[1:])
    assert not runners_up(replace(trace, candidates=of_other))


def test_correlated_estimates_are_listed() -> None:
    strong = (FittedParameter("damping", (1, 2, 3), "damping"), FittedParameter("payload", (), "mass"))
    weak = (FittedParameter("damping", (1, 2, 3), "damping"), FittedParameter("sag", (2,), "linear_density"))
    correlations = (Correlation(strong, -0.954), Correlation(weak, 0.2))
    html = trace_page(replace(made_trace(), correlations=correlations), LINKS)
    assert "damping of damping (all cables) and mass of payload: where one is too large the other is too small" in html
    assert "(-95 %)" in html and "linear_density of sag" not in html
    assert "err together" not in trace_page(made_trace(), LINKS)


def test_residuals_of_a_tracker_slower_than_the_log_are_lines() -> None:
    trace = made_trace(samples=801)
    (fit, *_) = trace.comparisons
    slow = np.where(np.arange(fit.recording.sample_count)[:, None] % 4, np.nan, fit.recording.position)
    comparison = replace(fit, recording=replace(fit.recording, position=slow))
    page = Page(trace_page(replace(trace, comparisons=(comparison,)), {}))
    choice = page.data()["choices"][0]
    (measured, *_) = choice["scene"]["paths"]
    assert measured["name"] == "measured"
    drawn = [choice["channels"][0]["after"], measured["columns"][0]]
    assert all(np.isfinite(unpack_float32(each)).mean() > 0.99 for each in drawn)


def test_a_tracker_slower_than_the_log_has_the_spectrum_of_its_own_rate() -> None:
    time = 0.01 * np.arange(16_000)
    noise = np.where(np.arange(16_000) % 4, np.nan, 2.0 * np.random.default_rng(3).normal(size=16_000))
    result = residual_spectra(time, noise, noise)
    assert result is not None and result.frequency.max() == pytest.approx(12.5, rel=0.05)
    assert np.median(result.after) == pytest.approx(white_noise_density(2.0, time[::4]), rel=0.1)
    assert residual_spectra(time, np.where(time > 1.0, np.nan, noise), noise) is None
    trace = made_trace(samples=1601)
    (fit, *_) = trace.comparisons
    slow = np.where(np.arange(1601)[:, None] % 4, np.nan, fit.recording.position)
    comparison = replace(fit, recording=replace(fit.recording, position=slow))
    channels = trace_page_data(replace(trace, comparisons=(comparison,)))["choices"][0]["channels"]
    assert channels[0]["spectrum"]["floor"] == pytest.approx(
        2.0 * channels[-1]["spectrum"]["floor"] * (channels[0]["sigma"] / channels[-1]["sigma"]), rel=1e-6
    )
