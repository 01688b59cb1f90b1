"""The pages in a real browser, as they are read: nothing is cut, nothing lies over another, all stands out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("selenium", reason="the pages are not tried in a browser: selenium is in the dev extra")

from tests.reports.test_page_rendering import TEXT, themes
from tests.support.browser.browser import (
    LAPTOP,
    LAPTOP_DARK,
    MISSING,
    PHONE,
    PHONE_DARK,
    Browser,
    Screen,
    chromium,
)
from tests.support.browser.report_pages import DRAW_ALL, KINDS, near, opened
from tests.support.folders import SUPPORT

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(chromium() is None, reason=f"the pages are not tried in a browser: {MISSING}"),
]

PAPER_WIDTH = 718  # pixels of A4 between margins of 1 cm
# Everything on paper that reaches beyond it, and figures that are not as wide as their frame.
BEYOND_PAPER = """
const all = [...document.querySelectorAll('figure, table, pre, .main-svg, .on-paper')];
const shrunk = [...document.querySelectorAll('.js-plotly-plot')].every((plot) => {
  const [width, drawn] = [plot, plot.querySelector('.main-svg')].map((each) => each.getBoundingClientRect().width);
  return Math.abs(width - drawn) < 1 && plot.querySelector('.main-svg').hasAttribute('viewBox');
});
const beyond = all.filter((each) => each.getBoundingClientRect().right > arguments[0] + 1);
return [beyond.map((each) => each.outerHTML.slice(0, 80)), shrunk];
"""
SCREENS = (LAPTOP, LAPTOP_DARK, PHONE, PHONE_DARK)
CONTRAST = (SUPPORT / "browser" / "contrast.js").read_text(encoding="utf-8")
# Every title and label of figures that reaches beyond its figure, or lies over another of its figure.
CUT = """
const cut = [];
for (const plot of document.querySelectorAll('.panel > .plot.js-plotly-plot')) {
  const frame = plot.getBoundingClientRect();
  const words = [...plot.querySelectorAll('.xtitle, .ytitle, .y2title, .annotation-text')];
  const boxes = words.map((each) => each.getBoundingClientRect());
  boxes.forEach((box, place) => {
    const inside = box.left >= frame.left - 0.1 && box.right <= frame.right + 0.1 && box.top >= frame.top - 0.1
      && box.bottom <= frame.bottom + 0.1;
    const over = boxes.slice(0, place).some((other) => box.left < other.right - 1 && other.left < box.right - 1
      && box.top < other.bottom - 1 && other.top < box.bottom - 1);
    if (!inside || over || box.width === 0) cut.push(words[place].textContent);
  });
}
return cut;
"""


@pytest.mark.parametrize("screen", SCREENS, ids=lambda screen: screen.name)
@pytest.mark.parametrize("kind", KINDS)
def test_page_fits_its_screen_and_its_words_stand_out(
    browser: Browser, pages: dict[str, Path], kind: str, screen: Screen
) -> None:
    opened(browser, pages[kind], screen).run(DRAW_ALL)
    browser.run("for (const d of document.querySelectorAll('details')) d.open = true")
    assert browser.run("return document.documentElement.scrollWidth") <= screen.width
    assert browser.run("return innerWidth") == screen.width
    assert browser.run(CONTRAST, TEXT) == []


@pytest.mark.parametrize("screen", [LAPTOP, PHONE], ids=lambda screen: screen.name)
@pytest.mark.parametrize("kind", [*KINDS, "close"])
def test_titles_of_axes_and_labels_of_modes_can_be_read(
    browser: Browser, pages: dict[str, Path], kind: str, screen: Screen
) -> None:
    opened(browser, pages[kind], screen).run(DRAW_ALL)
    assert browser.run("return document.querySelectorAll('.panel .ytitle').length") >= 6
    assert browser.run(CUT) == []


@pytest.mark.parametrize("kind", [*KINDS, "close"])
def test_titles_in_space_are_whole_on_a_phone(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    opened(browser, pages[kind], PHONE).see("figure.scene")
    titled = browser.pixels("#scene")
    for axis in "xyz":
        browser.run(f"return Plotly.relayout('scene', {{ 'scene.{axis}axis.title.text': '' }})")
        without = browser.pixels("#scene")
        rows, columns = np.nonzero((without != titled).any(axis=2))
        assert len(rows) > 40, axis
        assert columns.min() > 3 and columns.max() < titled.shape[1] - 4, axis
        titled = without


def test_labels_that_would_run_into_each_other_stand_in_two_lines(browser: Browser, pages: dict[str, Path]) -> None:
    script = """const band = (at, label) => ({ low: at, high: 1.1 * at, label, spans: [[at, 1.1 * at]] });
    const bands = [band(5, "2 and 3"), band(4, "1"), band(40, "?")];
    return frequencyBands(bands, [0.1, 100], colours()).annotations.map(({ text, yshift }) => [text, yshift > 0]);"""
    labels = opened(browser, pages["modes"]).run(script)
    assert labels == [["1", False], ["2 and 3", True], ["?", False]]


@pytest.mark.parametrize("screen", [LAPTOP, PHONE_DARK], ids=lambda screen: screen.name)
def test_what_was_recorded_shows_beside_the_run_and_below_it_the_difference(
    browser: Browser, pages: dict[str, Path], screen: Screen
) -> None:
    opened(browser, pages["run"], screen)
    colours = themes()["dark" if screen.dark else "light"]
    picture = browser.pixels("figure[data-kind=compared]")
    upper, lower = np.array_split(picture[30:], [int(0.6 * len(picture)) - 30])
    assert near(upper, colours["before"]) > 100 and near(upper, colours["accent"]) > 100
    assert near(lower, colours["text"]) > 100
    label = "return document.querySelector('figure[data-kind=compared] > .plot').getAttribute('aria-label')"
    assert "recorded minus co-simulated has a root mean square of" in browser.run(label)


@pytest.mark.parametrize("kind", KINDS)
def test_every_figure_of_every_page_has_words(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    opened(browser, pages[kind]).run(DRAW_ALL)
    script = (
        "return [...document.querySelectorAll('figure > .plot')].map((p) => [p.role, p.getAttribute('aria-label')])"
    )
    words = browser.run(script)
    assert all(role == "img" and len(label) > 30 for role, label in words)
    assert len({label for _, label in words if "Spectrum" not in label}) > 6


def test_figures_say_in_words_what_they_show(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"]).run(DRAW_ALL)
    script = "return [...document.querySelectorAll('.panel > .plot')].map((p) => p.getAttribute('aria-label'))"
    labels = browser.run(script)
    assert len(labels) == 12
    assert all("Fit recording: root mean square" in label for label in labels)
    assert all("Modes 1 to" in label or "Mode 1" in label for label in labels[6:])
    browser.run("document.querySelectorAll('input[name=choice]')[1].click()")
    browser.run(DRAW_ALL)
    assert all("Check recording: root mean square" in label for label in browser.run(script))


@pytest.mark.parametrize("kind", KINDS)
def test_contents_stay_at_the_side_while_the_page_scrolls(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    opened(browser, pages[kind]).run("scrollTo(0, document.documentElement.scrollHeight / 2)")
    script = """const [nav, section] = ['.contents', '.sections'].map((each) => document.querySelector(each));
    const box = nav.getBoundingClientRect();
    return [box.top >= 0 && box.bottom <= innerHeight, box.right < section.getBoundingClientRect().left,
      [...nav.querySelectorAll('a')].map((each) => each.textContent)]"""
    in_view, is_beside, titles = browser.run(script)
    assert in_view and is_beside
    assert titles == browser.run("return [...document.querySelectorAll('h2')].map((each) => each.textContent)")


def test_contents_stand_above_the_sections_on_a_phone(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"], PHONE)
    bottom, top = browser.run("""return [document.querySelector('.contents').getBoundingClientRect().bottom,
      document.querySelector('.sections').getBoundingClientRect().top]""")
    assert bottom <= top


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_cut_on_paper(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    opened(browser, pages[kind]).show_as_printed(PAPER_WIDTH)
    beyond, is_shrunk = browser.run(BEYOND_PAPER, PAPER_WIDTH)
    assert beyond == [] and is_shrunk
    hidden = "return [...document.querySelectorAll('.contents, .tools, .controls')].every((e) => !e.offsetParent)"
    assert browser.run(hidden)
    assert browser.run("return document.querySelector('.on-paper').naturalWidth") > 300
    assert browser.run("return document.querySelectorAll('details:not([open])').length") == 0


def test_printing_leaves_folded_what_was_folded_and_open_what_was_open(
    browser: Browser, pages: dict[str, Path]
) -> None:
    opened(browser, pages["trace"])
    are_open = "return [...document.querySelectorAll('details')].map((each) => each.open)"
    browser.run("document.querySelector('details').open = true")
    before = browser.run(are_open)
    assert before[0] and not all(before)
    browser.run("window.dispatchEvent(new Event('beforeprint'))")
    assert all(browser.run(are_open))
    browser.run("window.dispatchEvent(new Event('afterprint'))")
    assert browser.run(are_open) == before
