"""Opens pages in Debian's chromium: as a laptop or a phone, light or dark, and hears what they ask for."""

from __future__ import annotations

import base64
import io
import json
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.keys import Keys

Result = TypeVar("Result")

PACKAGES = "chromium chromium-driver"
MISSING = f"no chromium with its driver here; on Debian: apt-get install {PACKAGES}"
# Software stands in for the graphics card, and the browser asks nothing of the network by itself.
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)
WAIT = 30.0
# A page with figures has first to inflate what draws them.
STARTED = """return document.readyState === 'complete'
  && (!document.getElementById('packed-plotly') || 'started' in document.documentElement.dataset)"""
# What chromium says of itself, not of the page: software drawing, and how plotly reads pixels back.
OWN_WORDS = ("GL Driver Message", "willReadFrequently")


def chromium() -> tuple[str, str] | None:
    """Paths of chromium and of its driver; None where one is missing."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    driver = shutil.which("chromedriver")
    return (browser, driver) if browser and driver else None


@dataclass(frozen=True)
class Screen:
    """What a page is shown on."""

    name: str
    width: int
    height: int
    dark: bool = False
    phone: bool = False


LAPTOP = Screen("laptop", 1280, 900)
LAPTOP_DARK = Screen("laptop, dark", 1280, 900, dark=True)
PHONE = Screen("phone", 390, 844, phone=True)
PHONE_DARK = Screen("phone, dark", 390, 844, dark=True, phone=True)


class Browser:
    """A page that is open on a screen."""

    def __init__(self, driver: Any) -> None:
        self._driver = driver

    def show(self, screen: Screen) -> None:
        """Take another screen for the pages to come."""
        metrics = {"width": screen.width, "height": screen.height, "deviceScaleFactor": 1, "mobile": screen.phone}
        scheme = {"name": "prefers-color-scheme", "value": "dark" if screen.dark else "light"}
        self._command("Emulation.setDeviceMetricsOverride", metrics)
        self._command("Emulation.setTouchEmulationEnabled", {"enabled": screen.phone})
        self._command("Emulation.setEmulatedMedia", {"media": "", "features": [scheme]})

    def show_as_printed(self, width: int) -> None:
        """Show the open page with the styles of paper, of a width in pixels."""
        self.run("window.dispatchEvent(new Event('beforeprint'))")
        self._command("Emulation.setEmulatedMedia", {"media": "print"})
        self.run("document.body.style.width = `${arguments[0]}px`", width)

    def open(self, page: Path) -> None:
        """Open a page from the disk, and forget what was heard before."""
        self.heard()
        self.requests()
        self._driver.get(page.resolve().as_uri())
        self.wait(lambda: self.run(STARTED), "the page to load and to start")

    def run(self, script: str, *values: Any) -> Any:
        """The result of a script in the page."""
        return self._driver.execute_script(script, *values)

    def wait(self, done: Callable[[], Result], what: str) -> Result:
        """What ``done`` gives once it is true; raises AssertionError where it stays false."""
        until = time.monotonic() + WAIT
        while time.monotonic() < until:
            if result := done():
                return result
            time.sleep(0.05)
        raise AssertionError(f"waited {WAIT:g} s for {what}")

    def see(self, selector: str) -> None:
        """Scroll an element into view, and wait until a figure in it is drawn."""
        self.run("document.querySelector(arguments[0]).scrollIntoView({ block: 'center' })", selector)
        drawn = "const p = document.querySelector(arguments[0]).querySelector(':scope > .plot');"
        drawn += "return !p || p.classList.contains('js-plotly-plot') || p.classList.contains('empty')"
        self.wait(lambda: self.run(drawn, selector), f"{selector} to be drawn")
        self.run("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")

    def pixels(self, selector: str) -> NDArray[np.uint8]:
        """What an element looks like, shape (height, width, 3)."""
        self.see(selector)
        script = "const b = document.querySelector(arguments[0]).getBoundingClientRect();"
        script += "return [b.left + scrollX, b.top + scrollY, b.width, b.height]"
        x, y, width, height = self.run(script, selector)
        clip = {"x": x, "y": y, "width": width, "height": height, "scale": 1}
        shot = self._command("Page.captureScreenshot", {"format": "png", "clip": clip})
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(shot["data"]))).convert("RGB"))

    def drag(self, selector: str, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag the mouse between two points of an element in view, as shares of its width and height."""
        self._move_mouse("mouseMoved", *self._point(selector, start))
        self._move_mouse("mousePressed", *self._point(selector, start))
        for share in (0.3, 0.7, 1.0):
            point = tuple(a + share * (b - a) for a, b in zip(start, end, strict=True))
            self._move_mouse("mouseMoved", *self._point(selector, point))
        self._move_mouse("mouseReleased", *self._point(selector, end))

    def double_click(self, selector: str) -> None:
        """Click twice in the middle of an element in view."""
        for count in (1, 2):
            for event in ("mousePressed", "mouseReleased"):
                self._move_mouse(event, *self._point(selector, (0.5, 0.5)), count)

    def downloaded(self, script: str, folder: Path) -> Path:
        """The file that a script of the page makes the browser save in an empty folder."""
        self._command("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(folder)})
        self.run(script)
        # Chromium holds the name with an empty file until the written one is moved there.
        unfinished = (".crdownload", ".tmp")
        return self.wait(
            lambda: [
                path
                for path in folder.iterdir()
                if path.suffix not in unfinished and path.name[0] != "." and path.stat().st_size
            ],
            "a file to be saved",
        )[0]

    def press(self, *keys: str) -> None:
        """Press keys where the focus is; names such as "TAB" or letters."""
        for key in keys:
            self._driver.switch_to.active_element.send_keys(getattr(Keys, key, key))

    def heard(self) -> list[str]:
        """Errors and warnings on the console since the last call, without chromium's own words."""
        said = [entry["message"] for entry in self._driver.get_log("browser")]
        return [message for message in said if not any(words in message for words in OWN_WORDS)]

    def requests(self) -> list[str]:
        """Addresses that pages asked for since the last call, over any network or from the disk.

        Chromium's own page of a new tab may still be loading when the first page of a test is opened.
        """
        events = [json.loads(entry["message"])["message"] for entry in self._driver.get_log("performance")]
        asked = [event["params"] for event in events if event["method"] == "Network.requestWillBeSent"]
        sockets = [event["params"]["url"] for event in events if event["method"] == "Network.webSocketCreated"]
        own = ("chrome:", "chrome-untrusted:", "chrome-extension:")
        return [each["request"]["url"] for each in asked if not each["documentURL"].startswith(own)] + sockets

    def _point(self, selector: str, shares: tuple[float, ...]) -> list[float]:
        script = """const box = document.querySelector(arguments[0]).getBoundingClientRect();
        return [box.left + arguments[1][0] * box.width, box.top + arguments[1][1] * box.height]"""
        return [float(each) for each in self.run(script, selector, shares)]

    def _move_mouse(self, event: str, x: float, y: float, clicks: int = 1) -> None:
        values = {"type": event, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": clicks}
        self._command("Input.dispatchMouseEvent", values)

    def _command(self, name: str, values: dict[str, Any]) -> Any:
        return self._driver.execute_cdp_cmd(name, values)


@contextmanager
def browser_at(paths: tuple[str, str], *flags: str) -> Iterator[Browser]:
    """A browser with an empty profile; ``paths`` are those of :func:`chromium`."""
    program, driver_program = paths
    with TemporaryDirectory(prefix="tautwire-browser-", ignore_cleanup_errors=True) as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = program
        for flag in (*FLAGS, *flags, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        driver = webdriver.Chrome(options=options, service=Service(driver_program))
        try:
            yield Browser(driver)
        finally:
            driver.quit()
