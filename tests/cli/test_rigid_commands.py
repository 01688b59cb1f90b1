"""Commands on robots whose platform turns."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tautwire.cli import run
from tautwire.cosimulation.robot_wiring import robot_connections
from tautwire.reports.downsampling import unpack_float32
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.static_equilibrium import start_attachments
from tests.support.pages import Page
from tests.support.rigid_robots import crane_robot, suspended_robot


def written_robot(folder: Path) -> Path:
    """A platform on three cables that hangs level; its file says otherwise."""
    robot = suspended_robot(3)
    tilted = (float(np.cos(0.01)), float(np.sin(0.01)), 0.0, 0.0)
    write_robot(replace(robot, platform=replace(robot.platform, start_orientation=tilted)), folder / "robot.toml")
    return folder / "robot.toml"


def test_simulate_writes_the_orientation_and_tells_that_of_the_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, speeds, result = written_robot(tmp_path), tmp_path / "speeds.csv", tmp_path / "result.csv"
    commands = {f"winch_speed_{i}": [0.0, 0.3 * (i == 1), 0.0] for i in range(1, 4)}
    pd.DataFrame({"time": [0.0, 0.2, 0.4]} | commands).to_csv(speeds, index=False)
    page = tmp_path / "run.html"
    assert run(["simulate", str(robot), "--speeds", str(speeds), "--out", str(result), "--report", str(page)]) == 0
    frame = pd.read_csv(result)
    orientation = frame[["qw", "qx", "qy", "qz"]].to_numpy()
    assert np.linalg.norm(orientation, axis=1) == pytest.approx(1.0, abs=1e-14)
    assert orientation[0] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-6)
    assert np.max(np.abs(orientation[-1, 1:])) > 1e-3
    channels = Page(page.read_text(encoding="utf-8")).data()["choices"][0]["channels"]
    shown = [(each["label"], each["unit"]) for each in channels if each["title"] == "Rotation"]
    assert shown == [(f"about {axis}", "mrad") for axis in "xyz"]
    printed = capsys.readouterr()
    assert "suspended: starts 1.15 degrees from the declared orientation" in printed.err
    assert "trace" not in printed.out + printed.err


@pytest.mark.validate
def test_pages_draw_each_cable_to_its_attachment(tmp_path: Path) -> None:
    robot, speeds, page, modes = (tmp_path / name for name in ("robot.toml", "speeds.csv", "run.html", "modes.html"))
    write_robot(crane_robot(), robot)
    standing = {f"winch_speed_{i}": [0.0, 0.0] for i in range(1, 9)}
    pd.DataFrame({"time": [0.0, 0.1]} | standing).to_csv(speeds, index=False)
    out = [str(tmp_path / name) for name in ("run.csv", "model.json")]
    assert run(["simulate", str(robot), "--speeds", str(speeds), "--out", out[0], "--report", str(page)]) == 0
    assert run(["linearise", str(robot), "--out", out[1], "--report", str(modes)]) == 0
    scenes = [Page(each.read_text(encoding="utf-8")).data()["choices"][0]["scene"] for each in (page, modes)]
    for scene, place in zip(scenes, (-1, 18), strict=True):
        # A quarter of a period after the largest swing a mode passes through rest.
        drawn = np.array([[unpack_float32(column)[place] for column in point] for point in scene["attachments"]])
        assert np.max(np.abs(drawn - start_attachments(crane_robot()))) < 1e-6
        assert len(scene["edges"]) >= 12


@pytest.mark.validate
def test_build_connects_each_cable_with_its_attachment(tmp_path: Path) -> None:
    assert run(["build", str(written_robot(tmp_path)), "--out", str(tmp_path / "out")]) == 0
    archive = zipfile.ZipFile(tmp_path / "out" / "suspended.ssp")
    described = archive.read("SystemStructure.ssd").decode()
    for wire in robot_connections(3, is_rigid=True):
        assert (
            f'startElement="{wire.source.component}" startConnector="{wire.source.variable}" '
            f'endElement="{wire.target.component}" endConnector="{wire.target.variable}"'
        ) in described
    assert 'startConnector="position_3.z" endElement="cable_3"' in described
