"""What can be done with a figure in a real browser: save it as a picture or as numbers, zoom, and undo the zoom."""

from __future__ import annotations

import csv
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("selenium", reason="the pages are not tried in a browser: selenium is in the dev extra")

from tests.support.browser.browser import LAPTOP_DARK, MISSING, Browser, chromium
from tests.support.browser.report_pages import DRAW_ALL, KINDS, opened

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(chromium() is None, reason=f"the pages are not tried in a browser: {MISSING}"),
]

RESIDUAL = "figure[data-kind=residual]"
PRESS = "document.querySelector('{} .tools button{}').click()"
SPANS = f"""return [...document.querySelectorAll('{RESIDUAL} > .plot.js-plotly-plot')]
  .map((plot) => plot._fullLayout.xaxis.range)"""


def saved(browser: Browser, page: Path, figure: str, format_name: str, folder: Path) -> Path:
    """The file that a figure's button saves."""
    opened(browser, page).see(figure)
    file = browser.downloaded(PRESS.format(figure, f"[data-save={format_name}]"), folder)
    assert browser.heard() == []
    return file


def table(file: Path) -> tuple[list[str], np.ndarray]:
    """Header and numbers of a CSV file; NaN where a cell is empty."""
    header, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    return header, np.array([[float(cell or "nan") for cell in row] for row in rows])


def test_numbers_of_a_residual_are_saved_with_names_and_units(
    browser: Browser, pages: dict[str, Path], tmp_path: Path
) -> None:
    file = saved(browser, pages["trace"], RESIDUAL, "csv", tmp_path)
    assert file.name == "residual-position-x-fit-recording.csv"
    header, values = table(file)
    assert header == ["Time (s)", "before (mm)", "after (mm)"]
    drawn = browser.run(f"return document.querySelector('{RESIDUAL} > .plot').data.map((each) => [each.x, each.y])")
    assert values[:, 0] == pytest.approx(drawn[0][0], rel=1e-6)
    lines = np.array([y for _, y in drawn], dtype=float)
    np.testing.assert_allclose(values[:, 1:].T, lines, rtol=1e-6)


@pytest.mark.parametrize(
    ("kind", "figure", "header"),
    [
        ("run", "figure[data-kind=compared]", ["Time (s)", "recorded (mm)", "co-simulated (mm)"]),
        ("modes", "figure[data-kind=gain]", ["Frequency (Hz)", "gain (mm per mm/s)", "phase (°)"]),
        ("trace", "figure[data-kind=spectrum]", ["Frequency (Hz)", "before (mm/√Hz)", "after (mm/√Hz)"]),
        ("modes", "figure.scene", ["Phase (% of a period)", "platform x (m)", "platform y (m)", "platform z (m)"]),
    ],
)
def test_every_kind_of_figure_saves_its_numbers(
    browser: Browser, pages: dict[str, Path], tmp_path: Path, kind: str, figure: str, header: list[str]
) -> None:
    names, values = table(saved(browser, pages[kind], figure, "csv", tmp_path))
    assert names[: len(header)] == header
    assert len(values) > 30 and np.isfinite(values[:, 0]).all()


@pytest.mark.parametrize("figure", ["figure.scene", RESIDUAL])
def test_figure_is_saved_as_a_picture_on_a_ground_of_its_own(
    browser: Browser, pages: dict[str, Path], tmp_path: Path, figure: str
) -> None:
    file = saved(browser, pages["trace"], figure, "png", tmp_path)
    picture = np.asarray(Image.open(file).convert("RGBA"))
    width = browser.run(f"return document.querySelector('{figure} > .plot').clientWidth")
    assert picture.shape[1] == 2 * width
    assert (picture[..., 3] == 255).all()
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 30


def test_figure_is_saved_as_a_vector_drawing_under_its_title(
    browser: Browser, pages: dict[str, Path], tmp_path: Path
) -> None:
    drawing = ElementTree.parse(saved(browser, pages["trace"], RESIDUAL, "svg", tmp_path)).getroot()
    assert drawing.tag.endswith("svg")
    assert "Position, x, Fit recording" in "".join(drawing.itertext())


def test_reset_undoes_the_zoom_of_a_figure(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"], LAPTOP_DARK).run(DRAW_ALL)
    spectrum = "figure[data-kind=spectrum]"
    plot = f"document.querySelector('{spectrum} > .plot')"
    whole = browser.run(f"return {plot}._fullLayout.xaxis.range")
    browser.run(f"return Plotly.relayout({plot}, {{ 'xaxis.range': [0, 0.5] }})")
    assert browser.run(f"return {plot}._fullLayout.xaxis.range") == [0, 0.5]
    browser.run(PRESS.format(spectrum, ":last-child"))
    assert browser.run(f"return {plot}._fullLayout.xaxis.range") == pytest.approx(whole)


@pytest.mark.parametrize("kind", KINDS)
def test_every_drawn_figure_has_its_buttons(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    opened(browser, pages[kind]).run(DRAW_ALL)
    script = "return [...document.querySelectorAll('figure')].map((f) => [f.querySelector('.plot.empty') === null, "
    script += "[...f.querySelectorAll('.tools:not([hidden]) button')].map((b) => b.textContent)])"
    for is_drawn, buttons in browser.run(script):
        assert buttons == (["PNG", "SVG", "CSV", "Reset"] if is_drawn else [])


@pytest.mark.parametrize("undo", ["double click", "button"])
def test_figures_over_time_zoom_together_and_return(browser: Browser, pages: dict[str, Path], undo: str) -> None:
    opened(browser, pages["trace"]).run(DRAW_ALL)
    browser.see(RESIDUAL)
    whole = browser.run(SPANS)
    browser.drag(f"{RESIDUAL} .nsewdrag", (0.25, 0.5), (0.5, 0.5))
    browser.wait(lambda: browser.run(SPANS) != whole, "the zoom")
    browser.run(DRAW_ALL)
    spans = np.array(browser.run(SPANS))
    assert len(spans) == 6
    assert spans == pytest.approx(np.tile([10.0, 20.0], (6, 1)), abs=0.3)
    if undo == "button":
        browser.run(PRESS.format(RESIDUAL, ":last-child"))
    else:
        browser.double_click(f"{RESIDUAL}[data-channel='1'] .nsewdrag")
    browser.wait(lambda: browser.run(DRAW_ALL) or browser.run(SPANS) == whole, "the zoom to be undone")


def test_what_was_read_over_time_zooms_together_and_what_is_over_travel_stays(
    browser: Browser, pages: dict[str, Path]
) -> None:
    opened(browser, pages["check"]).run(DRAW_ALL)
    script = """return [...document.querySelectorAll('.panel > .plot.js-plotly-plot')]
      .map((plot) => [plot._fullLayout.xaxis.title.text, plot._fullLayout.xaxis.range])"""
    before = browser.run(script)
    first = "document.querySelector('figure[data-kind=check] > .plot')"
    browser.run(f"return Plotly.relayout({first}, {{ 'xaxis.range[0]': 2, 'xaxis.range[1]': 3 }})")
    browser.run(DRAW_ALL)
    after = browser.run(script)
    assert {title for title, _ in after} == {"Time (s)", "Reeled in (mm)"} and len(after) == 9
    for (title, span), (_, whole) in zip(after, before, strict=True):
        assert span == ([2, 3] if title == "Time (s)" else whole)
    browser.run(PRESS.format("figure[data-kind=check]", ":last-child"))
    browser.run(DRAW_ALL)
    assert browser.run(script) == before


def test_another_recording_is_shown_whole(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"]).see(RESIDUAL)
    browser.run("showSpan([5, 6])")
    assert browser.run(SPANS)[0] == [5, 6]
    browser.run("document.querySelectorAll('input[name=choice]')[1].click()")
    browser.see(RESIDUAL)
    assert browser.run(SPANS)[0][1] > 10.0


def test_output_without_an_effect_is_drawn_again_for_an_input_that_has_one(
    browser: Browser, pages: dict[str, Path]
) -> None:
    opened(browser, pages["modes"]).run(DRAW_ALL)
    script = """const output = report.gains.findIndex((gain) => gain.from.some((each) => each.gain === null));
    const none = report.gains[output].from.findIndex((each) => each.gain === null);
    const some = report.gains[output].from.findIndex((each) => each.gain !== null);
    return [none, some].map((input) => {
      source.value = String(input);
      source.dispatchEvent(new Event("change"));
      document.querySelectorAll("figure").forEach(drawFigure);
      return document.querySelector(`figure[data-kind=gain][data-channel="${output}"] > .plot`).innerText;
    });"""
    nothing, drawn = browser.run(script)
    assert nothing == "This input has no effect here"
    assert nothing not in drawn and "Phase" in drawn
