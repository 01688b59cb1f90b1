"""The paper's page in a real browser: its figures are saved, zoomed, and shown whole again."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("selenium", reason="the page is not tried in a browser: selenium is in the dev extra")

from tests.paper.test_paper_page import _page
from tests.support.browser.browser import LAPTOP_DARK, MISSING, Browser, chromium
from tests.support.browser.report_pages import opened

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(chromium() is None, reason=f"the page is not tried in a browser: {MISSING}"),
]

FIGURE = "#fig_07"
VIEW = f"return document.querySelector('{FIGURE} svg').getAttribute('viewBox').split(' ').map(Number)"
PRESS = f"document.querySelector('{FIGURE} .tools {{}}').click()"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page with small figures."""
    folder = tmp_path_factory.mktemp("paper")
    (folder / "claims.html").write_text(_page(folder), encoding="utf-8")
    return folder / "claims.html"


def saved(browser: Browser, page: Path, format_name: str, folder: Path) -> Path:
    """The file that a figure's button saves."""
    opened(browser, page, LAPTOP_DARK).see(FIGURE)
    file = browser.downloaded(PRESS.format(f"[data-save={format_name}]"), folder)
    assert browser.heard() == []
    assert file.name == f"fig-07-title-of-fig-07.{format_name}"
    return file


def test_every_figure_has_its_buttons(browser: Browser, page: Path) -> None:
    opened(browser, page)
    script = """return [...document.querySelectorAll('figure')]
      .map((f) => [...f.querySelectorAll('.tools button')].map((b) => b.textContent))"""
    buttons = browser.run(script)
    assert len(buttons) > 10 and all(each == ["PNG", "SVG", "Reset"] for each in buttons)
    links = "return [...document.querySelectorAll('.tools a')].map((a) => a.textContent + a.getAttribute('href'))"
    assert "CSVfig_07.csv" in browser.run(links) and len(browser.run(links)) == len(buttons)
    assert browser.heard() == []


def test_figure_is_saved_as_a_picture_as_it_is_seen_in_the_dark(browser: Browser, page: Path, tmp_path: Path) -> None:
    picture = np.asarray(Image.open(saved(browser, page, "png", tmp_path)).convert("RGBA"))
    width, height = browser.run(VIEW)[2:]
    assert picture.shape[:2] == pytest.approx((3 * (height + 28), 3 * width), abs=1)
    assert (picture[..., 3] == 255).all()
    assert picture[5, 5, :3].max() < 64
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 30


def test_figure_is_saved_as_a_vector_drawing_under_its_title(browser: Browser, page: Path, tmp_path: Path) -> None:
    drawing = ElementTree.parse(saved(browser, page, "svg", tmp_path)).getroot()
    assert drawing.tag == "{http://www.w3.org/2000/svg}svg" and float(drawing.attrib["width"]) == 216.0
    assert "Title of fig_07" in "".join(drawing.itertext())


def test_a_zoomed_figure_is_saved_zoomed_and_as_large(browser: Browser, page: Path, tmp_path: Path) -> None:
    opened(browser, page).see(FIGURE)
    whole = browser.run(VIEW)
    browser.drag(f"{FIGURE} svg", (0.25, 0.25), (0.75, 0.5))
    drawing = ElementTree.parse(browser.downloaded(PRESS.format("[data-save=svg]"), tmp_path)).getroot()
    assert float(drawing.attrib["width"]) == whole[2]
    assert float(drawing.attrib["viewBox"].split()[2]) == pytest.approx(0.5 * whole[2], rel=0.02)


@pytest.mark.parametrize("undo", ["double click", "button"])
def test_dragging_zooms_into_a_figure_of_the_same_shape_and_it_returns(browser: Browser, page: Path, undo: str) -> None:
    opened(browser, page).see(FIGURE)
    whole = browser.run(VIEW)
    browser.drag(f"{FIGURE} svg", (0.25, 0.25), (0.75, 0.5))
    x, y, width, height = browser.run(VIEW)
    assert (width, height) == pytest.approx((0.5 * whole[2], 0.5 * whole[3]), rel=0.02)
    assert (x, y) == pytest.approx((0.25 * whole[2], 0.125 * whole[3]), abs=0.02 * whole[2])
    if undo == "button":
        browser.run(PRESS.format("button:last-child"))
    else:
        browser.double_click(f"{FIGURE} svg")
    assert browser.run(VIEW) == whole
    assert browser.run("return document.querySelector('.drag-frame')") is None
