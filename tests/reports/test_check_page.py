"""The page of a check: what was read, how it fits the robot, and the problems with what mends them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tautwire.cli import run
from tautwire.cli.input_checks import check_files
from tautwire.reports.check_page import CheckedFiles, check_page
from tautwire.reports.downsampling import unpack_float32
from tests.support.pages import MAX_PAGE_BYTES, Page
from tests.support.pose_recordings import noisy, rotation_of, wandering_recording
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES
from tests.support.traces import HOSTILE

ROBOT, FIT = (EXAMPLES / "three" / name for name in ("robot.toml", "fit.csv"))
SECTIONS = ["robot", "speeds", "lengths", "tensions", "read"]


def report_of(folder: Path, recording: Path, exit_status: int) -> Page:
    """The page that the command writes of a recording."""
    page = folder / "check.html"
    assert run(["check", str(ROBOT), str(recording), "--report", str(page)]) == exit_status
    assert page.stat().st_size < MAX_PAGE_BYTES
    return Page(page.read_text(encoding="utf-8"))


def sections(page: Page) -> list[str]:
    """Ids of the sections except the notes."""
    return [each["id"] for each in page.all("section") if each["id"] != "notes"]


def slopes(page: Page) -> list[float]:
    """Slopes in the captions of the panels of rope lengths."""
    channels = page.data()["choices"][0]["channels"]
    return [float(each["numbers"].split()[1]) for each in channels if each["title"] == "Shortening"]


@pytest.fixture(scope="module")
def fit_page(tmp_path_factory: pytest.TempPathFactory) -> Page:
    """The page of a correct recording."""
    return report_of(tmp_path_factory.mktemp("page"), FIT, 0)


def test_page_of_a_correct_recording_has_every_section_and_no_problem(fit_page: Page) -> None:
    assert sections(fit_page) == SECTIONS
    assert "No problems found" in fit_page.text and fit_page.open == []
    assert slopes(fit_page) == pytest.approx([1.0, 1.0, 1.0], abs=0.05)


def test_panels_hold_what_was_recorded_and_what_balances(fit_page: Page) -> None:
    recorded, channels = pd.read_csv(FIT), fit_page.data()["choices"][0]["channels"]
    assert [each["title"] for each in channels] == 3 * ["Winch speed"] + 3 * ["Shortening"] + 3 * ["Tension"]
    assert {(each["unit"], each["xTitle"]) for each in channels[3:6]} == {("mm", "Reeled in (mm)")}
    speed = unpack_float32(channels[0]["curves"][0]["y"])
    assert speed.max() == pytest.approx(recorded["winch_speed_1"].max(), rel=1e-6)
    measured, balanced = (unpack_float32(curve["y"]) for curve in channels[6]["curves"])
    assert measured == pytest.approx(balanced, rel=0.05)


@pytest.mark.validate
def test_problem_of_speeds_in_mm_per_second_stands_on_the_page_with_what_mends_it(tmp_path: Path) -> None:
    recorded, wrong = pd.read_csv(FIT), tmp_path / "wrong.csv"
    speeds = [name for name in recorded if name.startswith("winch_speed_")]
    recorded[speeds] *= 1000.0
    recorded.to_csv(wrong, index=False)
    page = report_of(tmp_path, wrong, 2)
    assert sections(page) == ["problems", *SECTIONS]
    assert "are in mm/s" in page.text and "multiply winch_speed_1 to winch_speed_3 by 0.001" in page.text
    assert slopes(page) == pytest.approx([1e-3, 1e-3, 1e-3], rel=0.05)


def test_page_of_an_unreadable_recording_shows_the_robot_alone(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("time,winch_speed_1,winch_speed_2,winch_speed_3,x\n0.0,0,0,0,a\n0.1,0,0,0,1\n", encoding="utf-8")
    page = report_of(tmp_path, wrong, 2)
    assert sections(page) == ["problems", "robot"]
    assert "No recording could be read" in page.text


def test_robot_file_without_geometry_leaves_no_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, page = tmp_path / "robot.toml", tmp_path / "check.html"
    robot.write_text("name = \n", encoding="utf-8")
    assert run(["check", str(robot), "--report", str(page)]) == 2
    assert not page.exists() and "was not written" in capsys.readouterr().err


def test_hostile_names_do_nothing() -> None:
    result = check_files(ROBOT, FIT)
    assert result.robot is not None
    checked = CheckedFiles(result.robot, result.recording, ((HOSTILE, HOSTILE, HOSTILE),), (HOSTILE,))
    page = Page(check_page(checked, {}))
    assert "img" not in [tag for tag, _ in page.elements] and page.open == []


@pytest.mark.parametrize("absent", ["recording", "columns"])
def test_the_page_tells_of_files_that_are_not_there(absent: str, tmp_path: Path) -> None:
    robot, page = str(EXAMPLES / "three" / "robot.toml"), tmp_path / "check.html"
    recording = str(tmp_path / "absent.csv" if absent == "recording" else EXAMPLES / "three" / "fit.csv")
    options = [] if absent == "recording" else ["--columns", str(tmp_path / "absent.toml")]
    assert run(["check", robot, recording, *options, "--report", str(page)]) == 2
    assert "there is no such file" in page.read_text(encoding="utf-8")


def test_the_path_of_a_tracker_slower_than_the_log_is_drawn_through_its_points(tmp_path: Path) -> None:
    recorded, slow = pd.read_csv(FIT, nrows=800), tmp_path / "slow.csv"
    is_measured = (recorded.index % 4 == 0) & ~recorded.index.isin(range(300, 400))
    recorded.loc[~is_measured, ["x", "y", "z"]] = np.nan
    recorded.to_csv(slow, index=False)
    page = report_of(tmp_path, slow, 0)
    scene = page.data()["choices"][0]["scene"]
    (path,) = scene["paths"]
    for columns in (path["columns"], scene["platform"]):
        x, z = unpack_float32(columns[0]), unpack_float32(columns[2])
        assert np.isfinite(x[:297]).all() and np.isfinite(x[400:797]).all() and np.isnan(x[297:400]).all()
        assert z[8] == pytest.approx(recorded["z"][8], rel=1e-6)
        assert z[10] == pytest.approx((recorded["z"][8] + recorded["z"][12]) / 2, rel=1e-6)


def test_load_cells_slower_than_the_blocks_of_the_balance_are_drawn_through_their_samples(
    fit_page: Page, tmp_path: Path
) -> None:
    recorded, slow = pd.read_csv(FIT), tmp_path / "slow.csv"
    recorded.loc[recorded.index % 50 != 0, ["tension_1", "tension_2", "tension_3"]] = np.nan
    recorded.to_csv(slow, index=False)
    slow_page = report_of(tmp_path, slow, 0)
    measured, exact = (
        [unpack_float32(each["curves"][0]["y"]) for each in channels if each["title"] == "Tension"]
        for channels in (page.data()["choices"][0]["channels"] for page in (slow_page, fit_page))
    )
    assert len(measured) == 3
    for drawn, whole in zip(measured, exact, strict=True):
        assert len(drawn) > 0.9 * len(whole)
        assert np.corrcoef(drawn, whole[: len(drawn)])[0, 1] > 0.7


def table_of_columns(page: Path) -> dict[str, list[str]]:
    """Unit, minimum, maximum, rate and missing share by column."""
    table = page.read_text(encoding="utf-8").partition('<section id="read"')[2].partition("</table>")[0]
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in table.split("<tr")[2:]]
    return {row[0]: [re.sub("<[^>]*>", "", cell).replace("\xa0", " ") for cell in row[1:]] for row in rows}


def test_columns_are_those_that_were_recorded_each_at_its_own_rate(tmp_path: Path) -> None:
    recorded, log = pd.read_csv(FIT, nrows=800), tmp_path / "log.csv"
    recorded.loc[recorded.index % 4 != 0, ["x", "y", "z"]] = np.nan
    recorded.loc[400:487, "tension_2"] = np.nan
    speeds = recorded.filter(like="winch_speed")
    lengths = -(speeds.cumsum() * 0.01).rename(columns=lambda name: name.replace("winch_speed", "rope_length"))
    pd.concat([recorded.drop(columns=speeds), lengths.iloc[:, :2], speeds.iloc[:, 2:]], axis=1).assign(
        status=1.0
    ).to_csv(log, index=False)
    page = report_of(tmp_path, log, 0)
    rows = table_of_columns(tmp_path / "check.html")
    assert {"rope_length_1", "rope_length_2", "winch_speed_3"} < rows.keys() and "winch_speed_1" not in rows
    assert rows["rope_length_1"][0] == "m"
    assert rows["x"][3:] == ["25.0 Hz", "0.4 %"]
    assert rows["tension_2"][3:] == ["100 Hz", "11.0 %"]
    assert page.text.lower().count("not read: status") == 1


def test_page_of_a_rigid_platform_shows_its_rotation_and_its_attachments(tmp_path: Path) -> None:
    robot, recording = crane_robot(), noisy(wandering_recording(crane_robot()))
    content = check_page(CheckedFiles(robot, recording, (), ()), {})
    page = Page(content)
    assert sections(page) == ["robot", "speeds", "orientation", "lengths", "tensions", "read"]
    assert len(content) < MAX_PAGE_BYTES and "unbalanced, moments included" in page.text
    choice = page.data()["choices"][0]
    panels = [each for each in choice["channels"] if each["title"] == "Rotation"]
    assert [(each["label"], each["unit"]) for each in panels] == [(f"about {axis}", "mrad") for axis in "xyz"]
    turned = rotation_of(recording.orientation) * rotation_of(recording.orientation[0]).inv()
    for axis, panel in enumerate(panels):
        drawn = unpack_float32(panel["curves"][0]["y"])
        assert drawn.max() == pytest.approx(1e3 * turned.as_rotvec()[:, axis].max(), rel=1e-5)
    scene = choice["scene"]
    assert len(scene["attachments"]) == 8 and scene["edges"]
    shown = np.array([unpack_float32(column) for column in scene["attachments"][2]])[:, 0]
    expected = recording.position[0] + rotation_of(recording.orientation[0]).apply(robot.attachments[2])
    assert shown == pytest.approx(expected, rel=1e-6)


def test_the_rotation_by_a_tracker_slower_than_the_log_is_drawn_through_its_samples() -> None:
    recording = noisy(wandering_recording(crane_robot()))
    sample = np.arange(recording.sample_count)[:, None]
    is_lost = (sample >= 200) & (sample < 260)
    slow = replace(recording, orientation=np.where((sample % 4 > 0) | is_lost, np.nan, recording.orientation))
    drawn, whole = (
        np.array([unpack_float32(panel["curves"][0]["y"]) for panel in each if panel["title"] == "Rotation"])
        for each in (
            Page(check_page(CheckedFiles(crane_robot(), read, (), ()), {})).data()["choices"][0]["channels"]
            for read in (slow, recording)
        )
    )
    assert np.isfinite(drawn[:, :197]).all() and np.isnan(drawn[:, 197:260]).all()
    assert np.isfinite(drawn[:, 260:-3]).all()
    assert drawn[:, :197] == pytest.approx(whole[:, :197], abs=0.05 * np.abs(whole).max())


def test_page_of_a_rigid_platform_alone_draws_it_at_its_start() -> None:
    robot = crane_robot()
    scene = Page(check_page(CheckedFiles(robot, None, (), ()), {})).data()["choices"][0]["scene"]
    shown = [[float(unpack_float32(column)[0]) for column in point] for point in scene["attachments"]]
    assert np.array(shown) == pytest.approx(np.array(robot.attachments) + robot.platform.start, rel=1e-6)
