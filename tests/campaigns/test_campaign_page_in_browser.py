"""A campaign's page in a real browser: nothing fails, nothing is asked for, all is drawn, the chooser works."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("selenium", reason="the pages are not tried in a browser: selenium is in the dev extra")

from tautwire.campaigns.campaign_runner import write_summary
from tests.campaigns.test_campaign_summary import GRID, written
from tests.reports.test_legibility_in_browser import BEYOND_PAPER, PAPER_WIDTH
from tests.support.browser.browser import LAPTOP, MISSING, PHONE_DARK, Browser, Screen, chromium
from tests.support.campaigns import AT_REST, moving

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(chromium() is None, reason=f"the pages are not tried in a browser: {MISSING}"),
]

DRAW_ALL = "window.dispatchEvent(new Event('beforeprint'))"
INDICES = AT_REST.replace('"sobol"\ncount = 8', '"saltelli"\ncount = 16').replace(
    "cable.modulus = {normal = [1.022e11, 2.2e9]}", '"cable[*].anchor[*]" = {normal = [40.0, 0.1]}'
)
# More inputs than a heat map on paper has room for beside each other.
MANY = INDICES + "".join(
    f'"{key}" = {{normal = [40.0, 0.1]}}\n'
    for key in ("cable[*].modulus", "cable[*].area", "cable[*].damping", "platform.start[*]", "gravity")
)
# Cells of heat maps whose words do not fit in them, as far as they are seen.
OVERFLOWING = """return [...document.querySelectorAll('table.heat :is(thead th, tbody th, td, .heat-cell)')]
  .filter((each) => !each.closest('.many thead') && each.scrollWidth > each.clientWidth + 1)
  .map((each) => each.outerHTML)"""
MEDIANS = "return document.querySelector('figure[data-kind=band] .plot').data[2].y"


@pytest.fixture(scope="module", params=["path", "grid", "indices"])
def page(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of samples along a path, that of a grid at rest, and those with Sobol indices of ten and more inputs."""
    texts = {"path": moving(64), "grid": GRID, "indices": INDICES, "many": MANY}
    plan, out = written(tmp_path_factory.mktemp(request.param), texts[request.param])
    write_summary(plan, out)
    return out / "index.html"


@pytest.mark.parametrize("screen", [LAPTOP, PHONE_DARK], ids=lambda screen: screen.name)
def test_page_loads_in_silence_fits_its_screen_and_draws_every_figure(
    browser: Browser, page: Path, screen: Screen
) -> None:
    browser.show(screen)
    browser.open(page)
    browser.run(DRAW_ALL)
    assert browser.heard() == []
    assert [url for url in browser.requests() if not url.startswith(("data:", "blob:"))] == [page.resolve().as_uri()]
    assert browser.run("return document.documentElement.scrollWidth") <= screen.width
    figures = browser.run("return document.querySelectorAll('figure').length")
    assert figures >= 10
    assert browser.run("return document.querySelectorAll('.js-plotly-plot .trace').length") >= figures


def contrast(one: list[int], other: list[int]) -> float:
    """Contrast ratio of two colours by WCAG."""

    def luminance(colour: list[int]) -> float:
        shares = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255.0 for v in colour)]
        return 0.2126 * shares[0] + 0.7152 * shares[1] + 0.0722 * shares[2]

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def colours_of(browser: Browser, *scripts: str) -> list[list[int]]:
    """Colours that scripts of the page give, as red, green and blue."""
    return [[int(each) for each in re.findall(r"\d+", browser.run(f"return {script}"))[:3]] for script in scripts]


@pytest.mark.parametrize("page", ["path"], indirect=True)
@pytest.mark.parametrize("screen", [LAPTOP, PHONE_DARK], ids=lambda screen: screen.name)
def test_bands_stand_out_from_their_ground_and_medians_from_bands(browser: Browser, page: Path, screen: Screen) -> None:
    browser.show(screen)
    browser.open(page)
    browser.see("figure[data-kind=band]")
    plot = "document.querySelector('figure[data-kind=band] .plot')"
    fill, ground, median = colours_of(
        browser,
        f"getComputedStyle({plot}.querySelector('.js-fill')).fill",
        "getComputedStyle(document.querySelector('figure[data-kind=band]')).backgroundColor",
        f"getComputedStyle({plot}.querySelectorAll('.js-line')[2]).stroke",
    )
    assert contrast(fill, ground) >= 3.0 and contrast(fill, median) >= 3.0


@pytest.mark.parametrize("page", ["indices"], indirect=True)
@pytest.mark.parametrize("screen", [LAPTOP, PHONE_DARK], ids=lambda screen: screen.name)
def test_numbers_of_the_heat_map_can_be_read_on_every_ground(browser: Browser, page: Path, screen: Screen) -> None:
    browser.show(screen)
    browser.open(page)
    for level in range(6):
        cell = f"getComputedStyle(document.querySelector('.keys .heat-{level}'))"
        text, ground = colours_of(browser, f"{cell}.color", f"{cell}.backgroundColor")
        assert contrast(text, ground) >= 4.5, level
    assert browser.run("return document.querySelectorAll('table.heat .heat-cell').length") == 100


@pytest.mark.parametrize("page", ["path", "grid", "indices", "many"], indirect=True)
def test_nothing_of_a_campaign_is_cut_on_paper(browser: Browser, page: Path) -> None:
    browser.show(LAPTOP)
    browser.open(page)
    browser.show_as_printed(PAPER_WIDTH)
    beyond, is_shrunk = browser.run(BEYOND_PAPER, PAPER_WIDTH)
    assert beyond == [] and is_shrunk
    assert browser.run(OVERFLOWING) == []


@pytest.mark.parametrize("page", ["indices"], indirect=True)
def test_numbers_of_the_heat_map_are_saved_with_their_outputs_and_inputs(
    browser: Browser, page: Path, tmp_path: Path
) -> None:
    browser.show(LAPTOP)
    browser.open(page)
    file = browser.downloaded("document.querySelector('.saved-table [data-save=csv]').click()", tmp_path)
    assert file.name == "sobol-indices-total-at-rest.csv" and browser.heard() == []
    header, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    shown = browser.run("""return [...document.querySelector('table.heat').rows]
      .map((row) => [...row.cells].map((cell) => cell.innerText.trim()))""")
    assert header == shown[0] and [row[0] for row in rows] == [row[0] for row in shown[1:]]
    numbers = [["nan" if text == "\N{EN DASH}" else text for text in row[1:]] for row in shown[1:]]
    saved = np.array([[cell or "nan" for cell in row[1:]] for row in rows], dtype=float)
    np.testing.assert_array_equal(saved, np.array(numbers, dtype=float))


@pytest.mark.parametrize("page", ["path", "grid"], indirect=True)
def test_another_path_or_input_is_drawn_when_it_is_chosen(browser: Browser, page: Path) -> None:
    browser.show(LAPTOP)
    browser.open(page)
    if page.parent.parent.name.startswith("grid"):
        browser.see("figure[data-kind=against]")
        script = "return document.querySelector('figure[data-kind=against] .plot').data[0].x"
        change = "const s = document.getElementById('against'); s.value = '1'; s.dispatchEvent(new Event('change'))"
    else:
        browser.see("figure[data-kind=band]")
        script, change = MEDIANS, "document.querySelectorAll('input[name=choice]')[1].click()"
    before = browser.run(script)
    browser.run(change)
    browser.wait(lambda: browser.run(script) != before, "the other one to be drawn")
    assert browser.heard() == []
