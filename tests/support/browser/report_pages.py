"""Small report pages of each kind for the browser, and what they are looked at with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tautwire.linear import linearise
from tautwire.recordings.recording import read_recording
from tautwire.reports.check_page import CheckedFiles, check_page
from tautwire.reports.modes_page import modes_page
from tautwire.reports.run_page import run_page
from tautwire.reports.trace_report_page import trace_page
from tests.support.browser.browser import LAPTOP, Browser, Screen
from tests.support.robots import EXAMPLES, example
from tests.support.traces import HOSTILE, made_run, made_trace

KINDS = ("trace", "run", "modes", "check")
DRAW_ALL = "window.dispatchEvent(new Event('beforeprint'))"


def report_pages(folder: Path) -> dict[str, Path]:
    """A page of each kind in a folder, one of a plant whose modes are close, and one full of hostile names."""
    robot, close = example("eight"), example("three")
    links = {"robot.toml": "robot.toml"}
    hostile = replace(made_trace(name=HOSTILE, samples=400), sentence=HOSTILE, notes=(HOSTILE,))
    recording = read_recording(EXAMPLES / "three" / "fit.csv", 3).first(2000)
    # A tracker at a quarter of the log's rate.
    recording = replace(recording, position=np.where(np.arange(2000)[:, None] % 4, np.nan, recording.position))
    problems = (("fit.csv", "speeds are in mm/s", "multiply them by 0.001"),)
    written = {
        "trace": trace_page(made_trace(samples=801), links),
        "run": run_page(made_run(), links),
        "modes": modes_page(robot, linearise(robot), links),
        "check": check_page(CheckedFiles(close, recording, problems, ("a note",)), links),
        "close": modes_page(close, linearise(close), links),
        "hostile": trace_page(hostile, {HOSTILE: HOSTILE}),
    }
    for name, content in written.items():
        (folder / f"{name}.html").write_text(content, encoding="utf-8")
    return {name: folder / f"{name}.html" for name in written}


def opened(browser: Browser, page: Path, screen: Screen = LAPTOP) -> Browser:
    """The browser with a page on a screen."""
    browser.show(screen)
    browser.open(page)
    return browser


def near(picture: NDArray[np.uint8], colour: str) -> int:
    """How many pixels of a picture are nearly of a colour such as "#0a6a8a"."""
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)])
    return int((np.abs(picture.astype(int) - wanted).max(axis=2) <= 24).sum())
