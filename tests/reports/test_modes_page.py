"""The page of a linear plant: modes that swing as they should, gains that the plant has, harmless names."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tautwire.cli import run as command
from tautwire.linear import LinearPlant, linearise
from tautwire.reports.downsampling import unpack_float32
from tautwire.reports.modes_page import DRAWN_SWING_SHARE, modes_data, modes_page
from tautwire.robot.schema import Robot
from tests.support.pages import FETCHING, MAX_PAGE_BYTES, Page
from tests.support.rigid_robots import suspended_robot
from tests.support.robots import EXAMPLES, example
from tests.support.traces import HOSTILE


@cache
def plant_of(name: str) -> tuple[Robot, LinearPlant]:
    """A shipped robot, linearised once."""
    robot = example(name)
    return robot, linearise(robot)


@pytest.mark.parametrize("name", ["three", "eight"])
def test_platform_swings_along_each_mode_about_rest(name: str) -> None:
    robot, plant = plant_of(name)
    data = modes_data(robot, plant)
    for mode, choice in enumerate(data["choices"]):
        swing = np.column_stack([unpack_float32(column) for column in choice["scene"]["platform"]]) - plant.position
        assert swing[0] == pytest.approx(swing[-1], abs=1e-4)
        assert swing.max(axis=0) == pytest.approx(-swing.min(axis=0), abs=1e-4)
        size = np.ptp(np.vstack((robot.anchors, plant.position)), axis=0).max()
        assert swing[0] == pytest.approx(DRAWN_SWING_SHARE * size * plant.modes.shapes[:, mode], abs=1e-4)
        assert choice["scene"]["cycle"]


def test_tensions_change_as_the_plant_says_for_a_millimetre() -> None:
    robot, plant = plant_of("eight")
    scene = modes_data(robot, plant)["choices"][0]["scene"]
    change = np.array([unpack_float32(column)[0] for column in scene["tension"]])
    moved = plant.position + 1e-3 * plant.modes.shapes[:, 0]
    lengths = [np.linalg.norm(np.array(robot.anchors) - place, axis=1) for place in (plant.position, moved)]
    stretch = (lengths[1] - lengths[0]) / lengths[0]
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    assert change == pytest.approx(stiffness * stretch, rel=0.02)


def test_gains_are_those_of_the_plant_in_the_stated_units() -> None:
    robot, plant = plant_of("three")
    data = modes_data(robot, plant)
    frequency = unpack_float32(data["frequency"])
    for row, output, scale in (("position x", "position_x", 1e3), ("tension 2", "tension_2", 1.0)):
        shown = next(each for each in data["gains"] if each["label"] == row)["from"]
        for source, per in (("winch_speed_3", 1e-3), ("external_force_z", 1.0)):
            place = list(plant.system.input_labels).index(source)
            channel = plant.system[output, source]
            expected = np.abs(channel(2j * np.pi * frequency)) * scale * per
            assert unpack_float32(shown[place]["gain"]) == pytest.approx(expected, rel=1e-5)
    assert shown[0]["unit"] == "N per mm/s"


def test_gain_peaks_where_the_modes_are_marked() -> None:
    robot, plant = plant_of("eight")
    data = modes_data(robot, plant)
    place = list(plant.system.input_labels).index("external_force_z")
    gain = unpack_float32(next(each for each in data["gains"] if each["label"] == "position z")["from"][place]["gain"])
    peak = unpack_float32(data["frequency"])[np.argmax(gain)]
    assert any(band["low"] * 0.97 < peak < band["high"] * 1.03 for band in data["bands"])


def test_page_tells_modes_tensions_and_shares_without_scripts() -> None:
    robot, plant = plant_of("three")
    page = Page(modes_page(robot, plant, {"model.json": "model.json"}))
    assert page.open == []
    for words in ("swings at 1.18 Hz (2 modes) and 1.30 Hz", "1.177 Hz", "1.44\u00a0%", "Cable 3", "28.86, 0, 5.000"):
        assert words in page.text
    assert page.links() == ["model.json"]
    assert len(page.all("option")) == len(plant.system.input_labels)
    for tag, attributes in page.elements:
        assert not FETCHING & set(attributes), tag
        assert not re.match(r"(?i)\s*([a-z]+:|//)", attributes.get("href", ""))


def test_notes_of_the_plant_stand_at_the_top_and_in_full() -> None:
    robot, plant = plant_of("three")
    page = Page(modes_page(replace(robot, name=HOSTILE), replace(plant, notes=(HOSTILE,)), {}))
    assert "See the notes" in page.text and page.text.count("onerror") >= 2
    assert "img" not in [tag for tag, _ in page.elements] and len(page.scripts) == 3


def test_linearise_writes_the_page_beside_the_model(tmp_path: Path) -> None:
    model, page = tmp_path / "model.json", tmp_path / "modes.html"
    robot = str(EXAMPLES / "three" / "robot.toml")
    assert command(["linearise", robot, "--out", str(model), "--report", str(page)]) == 0
    assert "model.json" in Page(page.read_text(encoding="utf-8")).links()
    assert command(["linearise", robot, "--out", str(model), "--report", str(model)]) == 2


@pytest.mark.parametrize(
    "robot", [example("eight"), example("cogiro"), suspended_robot(12)], ids=lambda each: each.name
)
def test_page_of_many_cables_stays_small_and_keeps_the_peaks(robot: Robot) -> None:
    plant = linearise(robot)
    content = modes_page(robot, plant, {})
    assert len(content.encode()) < MAX_PAGE_BYTES
    frequency = unpack_float32(Page(content).data()["frequency"])
    assert len(frequency) >= 100
    assert np.isclose(plant.modes.frequencies[:, None], frequency, rtol=1e-6).any(axis=1).all()
