"""The pages in a real browser: nothing fails, nothing is asked for, all is drawn, all controls can be reached."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("selenium", reason="the pages are not tried in a browser: selenium is in the dev extra")

from tautwire import read_robot
from tautwire.reports.check_page import CheckedFiles, check_page
from tests.reports.test_page_rendering import themes
from tests.reports.test_trace_report_page import SECTIONS
from tests.support.browser.browser import (
    LAPTOP,
    LAPTOP_DARK,
    MISSING,
    PHONE_DARK,
    Browser,
    Screen,
    browser_at,
    chromium,
)
from tests.support.browser.report_pages import DRAW_ALL, KINDS, near, opened
from tests.support.planar import HORIZONTAL, VERTICAL, Plane, robot_text
from tests.support.traces import HOSTILE

pytestmark = pytest.mark.skipif(chromium() is None, reason=f"the pages are not tried in a browser: {MISSING}")

NAMED = ("time-shown", "tensions")
# The muted colour of cables without a tension, light and dark.
CABLE = (np.array([0x5A, 0x64, 0x6D]), np.array([0x9C, 0xA7, 0xAE]))
SLIDE = """const slider = document.getElementById('time');
slider.value = String(Math.round(arguments[0] * slider.max));
slider.dispatchEvent(new Event('input'));"""
PLATFORM = "const t = document.getElementById('scene').data[2]; return [t.x[0], t.y[0], t.z[0]]"


def drawn_share(picture: NDArray[np.uint8]) -> float:
    """Which share of a picture is not of its most frequent colour."""
    _, counts = np.unique(picture.reshape(-1, 3), axis=0, return_counts=True)
    return 1.0 - float(counts.max()) / float(counts.sum())


@pytest.mark.validate(but=["trace-laptop"])
@pytest.mark.parametrize("screen", [LAPTOP, PHONE_DARK], ids=lambda screen: screen.name)
@pytest.mark.parametrize("kind", KINDS)
def test_page_loads_in_silence_and_asks_for_nothing_but_itself(
    browser: Browser, pages: dict[str, Path], kind: str, screen: Screen
) -> None:
    opened(browser, pages[kind], screen).see("figure.scene")
    browser.run(DRAW_ALL)
    assert browser.heard() == []
    outside = [url for url in browser.requests() if not url.startswith(("data:", "blob:"))]
    assert outside == [pages[kind].resolve().as_uri()]


@pytest.mark.validate
@pytest.mark.parametrize("screen", [LAPTOP, PHONE_DARK], ids=lambda screen: screen.name)
@pytest.mark.parametrize("plane", [VERTICAL, HORIZONTAL], ids=lambda plane: plane.up)
def test_planar_robot_faces_the_reader_and_fills_the_figure(
    browser: Browser, plane: Plane, screen: Screen, tmp_path: Path
) -> None:
    file, page = tmp_path / "robot.toml", tmp_path / "planar.html"
    file.write_text(robot_text(plane), encoding="utf-8")
    page.write_text(check_page(CheckedFiles(read_robot(file), None, (), ()), {}), encoding="utf-8")
    opened(browser, page, screen)
    picture = browser.pixels("#scene")
    drawn = np.argwhere(np.abs(picture.astype(int) - CABLE[screen.dark]).max(axis=2) <= 24)
    assert drawn.min() > 0 and (drawn.max(axis=0) < np.array(picture.shape[:2]) - 1).all()
    assert max((np.ptp(drawn, axis=0) + 1) / picture.shape[:2]) > 0.6
    axes, scales, eye = browser.run(
        "const { aspectratio, camera, ...scene } = document.getElementById('scene')._fullLayout.scene;"
        "const axes = ['x', 'y', 'z'].map((name) => scene[`${name}axis`]);"
        "const scales = axes.map(({ range, _name }) => aspectratio[_name[0]] / (range[1] - range[0]));"
        "return [axes.map((each) => each.visible), scales, camera.eye]"
    )
    across = {"y": "z", "z": "y"}[plane.up]
    assert scales == pytest.approx(3 * scales[:1]) and abs(eye[across]) > 20.0 * abs(eye["x"]) + abs(eye[plane.up])
    assert axes == [True, plane.up == "y", plane.up == "z"]
    views = browser.run(
        "return [...document.querySelectorAll('[data-view]')].filter((each) => each.offsetParent)"
        ".map((each) => each.textContent)"
    )
    assert views == ["Whole", "Close up"] and browser.heard() == []


@pytest.mark.validate
@pytest.mark.parametrize("screen", [LAPTOP, PHONE_DARK], ids=lambda screen: screen.name)
@pytest.mark.parametrize("kind", KINDS)
def test_no_plot_is_empty(browser: Browser, pages: dict[str, Path], kind: str, screen: Screen) -> None:
    opened(browser, pages[kind], screen)
    accent = themes()["dark" if screen.dark else "light"]["accent"]
    count = browser.run("return document.querySelectorAll('figure').length")
    browser.run("document.querySelectorAll('figure').forEach((each, place) => { each.id = `figure-${place}`; })")
    assert count > 6
    for place in range(count):
        picture = browser.pixels(f"#figure-{place}")
        assert drawn_share(picture) > 0.01, place
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 30, place
        assert near(picture, accent) > 20, place


@pytest.mark.validate
@pytest.mark.parametrize("kind", KINDS)
def test_slider_moves_the_robot(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    opened(browser, pages[kind]).see("figure.scene")
    at_start, seen = browser.run(PLATFORM), browser.pixels("#scene")
    words, tensions = (browser.run(f"return document.getElementById('{name}').textContent") for name in NAMED)
    browser.run(SLIDE, 0.5)
    assert browser.run(PLATFORM) != at_start
    assert float((browser.pixels("#scene") != seen).any(axis=2).mean()) > 1e-3
    assert browser.run("return document.getElementById('time-shown').textContent") != words
    assert browser.run("return document.getElementById('tensions').textContent") != tensions
    browser.run(SLIDE, 0.0)
    assert browser.run(PLATFORM) == at_start


@pytest.mark.validate
def test_play_moves_the_robot_until_it_is_pressed_again(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"]).see("figure.scene")
    at_start = browser.run(PLATFORM)
    browser.run("document.getElementById('play').click()")
    browser.wait(lambda: browser.run(PLATFORM) != at_start, "the robot to move")
    assert browser.run("return document.getElementById('play').textContent") == "Pause"
    browser.run("document.getElementById('play').click()")
    stopped = browser.run(PLATFORM)
    browser.run("return new Promise((done) => setTimeout(done, 200))")
    assert browser.run(PLATFORM) == stopped


@pytest.mark.validate
def test_a_mode_goes_round(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["modes"]).see("figure.scene")
    browser.run(SLIDE, 0.97)
    late = browser.run("return state.place")
    browser.run("document.getElementById('play').click()")
    browser.wait(lambda: browser.run("return state.place") < late, "the mode to begin anew")
    assert browser.run("return document.getElementById('play').textContent") == "Pause"


@pytest.mark.validate
def test_views_turn_the_robot(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"]).see("figure.scene")
    shown = [browser.pixels("#scene")]
    for view in ("top", "close"):
        browser.run("document.querySelector(`[data-view=${arguments[0]}]`).click()", view)
        after = browser.pixels("#scene")
        assert all(float((after != before).any(axis=2).mean()) > 0.01 for before in shown), view
        assert near(after, themes()["light"]["accent"]) > 20, view
        shown.append(after)


@pytest.mark.validate
def test_all_controls_can_be_reached_and_used_by_keyboard(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"]).see("figure.scene")
    browser.run("document.body.tabIndex = -1; document.body.focus(); scrollTo(0, 0)")
    reached: list[str] = []
    name = """const e = document.activeElement;
    return e.closest('.contents')?.className || e.id || e.dataset.view || e.name || e.className || e.tagName"""
    while len(reached) < 160 and (not reached or reached[-1] != "BODY"):
        browser.press("TAB")
        reached.append(browser.run(name))
    assert reached.count("contents") == len(SECTIONS)
    wanted = ["skip", "A", "choice", "play", "time", "perspective", "close", "magnify", "scale"]
    assert [each for each in reached if (each in wanted and reached.count(each) == 1) or each == "A"] == wanted
    browser.run("document.getElementById('time').focus()")
    browser.press("ARROW_RIGHT", "ARROW_RIGHT")
    assert browser.run("return state.place") == 2
    browser.press("END")
    assert browser.run("return state.place") == browser.run("return Number(document.getElementById('time').max)")
    browser.run("document.querySelector('input[name=choice]').focus()")
    browser.press("ARROW_RIGHT")
    assert browser.run("return [chosen().role, state.place]") == ["check", 0]


@pytest.mark.validate
@pytest.mark.parametrize("kind", KINDS)
def test_every_control_of_every_page_is_reached_by_tab_and_has_a_name(
    browser: Browser, pages: dict[str, Path], kind: str
) -> None:
    opened(browser, pages[kind]).see("figure.scene")
    # Of radio buttons that belong together the tabulator reaches the chosen one; arrows lead to the others.
    find = """const all = [...document.querySelectorAll('a[href], button, select, summary, input, .scroll')]
      .filter((e) => e.type !== 'radio' || e.checked)
      .filter((e) => !e.closest('details:not([open]) > :not(summary)'));
    window.wanted = all;
    const named = (e) => e.getAttribute('aria-label') || e.textContent.trim() || e.labels?.[0].textContent.trim();
    return all.filter((e) => !named(e)).map((e) => e.outerHTML);"""
    assert browser.run(find) == []
    count = browser.run("document.body.focus(); scrollTo(0, 0); return wanted.length")
    assert count > 10
    reached = set()
    for _ in range(count + 5):
        browser.press("TAB")
        reached.add(browser.run("return wanted.indexOf(document.activeElement)"))
    assert set(range(count)) - reached == set()


@pytest.mark.validate
def test_skip_link_leads_to_the_results(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["trace"]).press("TAB", "ENTER")
    assert browser.run("return document.activeElement.id") == "main"


@pytest.mark.validate
@pytest.mark.parametrize("kind", KINDS)
def test_page_is_light_or_dark_as_asked_and_turns_with_it(browser: Browser, pages: dict[str, Path], kind: str) -> None:
    opened(browser, pages[kind]).see("figure.scene")
    light = browser.pixels("#scene")
    browser.show(LAPTOP_DARK)
    browser.wait(lambda: drawn_in(browser, "dark"), "the figures to be drawn anew")
    dark = browser.pixels("#scene")
    assert np.median(light) > 200 and np.median(dark) < 60
    assert near(dark, themes()["dark"]["accent"]) > 20


def drawn_in(browser: Browser, theme: str) -> bool:
    """Whether the platform has the accent of a theme."""
    colour = browser.run("return document.getElementById('scene').data[2].marker.color")
    return bool(colour == themes()[theme]["accent"])


@pytest.mark.validate
def test_gains_follow_the_chosen_input(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["modes"]).see("figure[data-kind=gain]")
    label = "return document.querySelector('figure[data-kind=gain] > .plot').getAttribute('aria-label')"
    assert "by winch speed 1" in browser.run(label)
    browser.run("const s = document.getElementById('source'); s.value = '9'; s.dispatchEvent(new Event('change'))")
    assert "by external force y" in browser.run(label)


@pytest.mark.validate
def test_hostile_names_are_shown_as_text(browser: Browser, pages: dict[str, Path]) -> None:
    opened(browser, pages["hostile"]).see("figure.scene")
    assert HOSTILE in browser.run("return document.querySelector('h1').textContent")
    assert browser.run("return [document.images.length, document.title.includes('onerror')]") == [0, True]
    browser.run(DRAW_ALL)
    assert browser.heard() == []


@pytest.mark.validate
def test_robot_is_drawn_flat_where_there_is_no_3d(pages: dict[str, Path]) -> None:
    browser_path = chromium()
    assert browser_path is not None
    with browser_at(browser_path, "--disable-3d-apis") as flat:
        opened(flat, pages["trace"]).see("figure.scene")
        assert "drawn flat" in flat.run("return document.getElementById('flat').innerText")
        pictures = [flat.pixels("#scene")]
        for view in ("top", "close"):
            flat.run("document.querySelector(`[data-view=${arguments[0]}]`).click()", view)
            pictures.append(flat.pixels("#scene"))
        flat.run(SLIDE, 0.3)
        pictures.append(flat.pixels("#scene"))
        for before, after in pairwise(pictures):
            assert float((after != before).any(axis=2).mean()) > 1e-3
        assert all(near(picture, themes()["light"]["accent"]) > 20 for picture in pictures)
        assert flat.heard() == []
