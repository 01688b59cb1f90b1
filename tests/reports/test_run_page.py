"""The page of a run: what it says, that it needs no network, and that names in it do nothing."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from tautwire.cli import run as command
from tautwire.cosimulation.robot_wiring import result_columns
from tautwire.reports.downsampling import unpack_float32
from tautwire.reports.run_overview import RunOverview
from tautwire.reports.run_page import run_page
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.pages import FETCHING, MAX_PAGE_BYTES, Page
from tests.support.pose_recordings import quaternions_of, rotation_of
from tests.support.rigid_robots import suspended_robot
from tests.support.rigid_runs import made_rigid_run
from tests.support.robots import EXAMPLES, example
from tests.support.traces import HOSTILE, made_run

THREE = EXAMPLES / "three"


def test_page_says_how_long_how_far_and_under_what() -> None:
    page = Page(run_page(made_run(), {"result.csv": "result.csv"}))
    assert page.open == []
    for words in (
        "Complete",
        "20.0 s along",
        "2000 macro steps and 17 iterations",
        "The winches were slow.",
        "cable 3",
    ):
        assert words in page.text
    assert page.links() == ["result.csv"]


def test_every_output_has_its_panel_with_what_was_recorded() -> None:
    run = made_run()
    page = Page(run_page(run, {}))
    channels = page.data()["choices"][0]["channels"]
    panels = [each for each in page.all("figure") if each.get("data-kind") in ("output", "compared")]
    assert [each["data-kind"] for each in panels] == 6 * ["compared"] + 6 * ["output"]
    assert [int(each["data-channel"]) for each in panels] == list(range(len(channels)))
    assert [each["title"] for each in channels] == 3 * ["Position"] + 3 * ["Tension"] + 3 * ["Velocity"] + [
        "Elongation"
    ] * 3
    tension = channels[3]
    assert unpack_float32(tension["values"]) == pytest.approx(run.overview.rows[:, 6], rel=1e-6)
    assert float(tension["difference"]["apart"]) == pytest.approx(2.0, rel=0.1)
    assert channels[6]["recorded"] is None and channels[6]["difference"] is None


def test_difference_is_recorded_minus_co_simulated_and_of_positions_in_mm() -> None:
    run = made_run()
    channels = Page(run_page(run, {})).data()["choices"][0]["channels"]
    for channel, recorded, column, unit, one in (
        (channels[2], run.recording.position[:, 2], "z", "mm", 1e-3),
        (channels[3], run.recording.tension[:, 0], "tension_1", "N", 1.0),
    ):
        simulated = run.overview.rows[:, run.columns.index(column)]
        assert channel["difference"]["unit"] == unit
        expected = (recorded - simulated) / one
        assert unpack_float32(channel["difference"]["values"]) == pytest.approx(expected, rel=1e-5, abs=1e-3)
        assert unpack_float32(channel["difference"]["time"]) == pytest.approx(run.overview.time)


def test_coordinates_are_printed_to_the_digits_that_their_range_needs() -> None:
    run = made_run(samples=200)
    overview = RunOverview()
    for time, row in zip(run.overview.time, run.overview.rows, strict=True):
        moved = row.copy()
        moved[0] = 28.86 + 1e-4 * time
        overview.add(float(time), moved)
    page = Page(run_page(replace(run, overview=overview), {}))
    assert page.data()["choices"][0]["channels"][0]["range"] == ["28860.000", "28862.000"]
    assert "28862.000" in page.text


def test_recorded_path_of_a_robot_measured_in_a_plane_lies_in_that_plane() -> None:
    run = made_run(samples=200)
    position = run.recording.position.copy()
    position[:, 1] = np.nan
    page = Page(run_page(replace(run, recording=replace(run.recording, position=position)), {}))
    recorded, simulated = (each["columns"] for each in page.data()["choices"][0]["scene"]["paths"])
    assert recorded[1] == simulated[1] and recorded[0] != simulated[0]


@pytest.mark.validate
def test_page_stays_small_for_long_runs() -> None:
    assert len(run_page(made_run(samples=40_000, eight=True), {})) < MAX_PAGE_BYTES


def test_slack_cables_and_failures_are_named_at_the_top() -> None:
    run = made_run(samples=200)
    row = run.overview.last_row.copy()
    row[list(run.columns).index("tension_2")] = 0.0
    run.overview.add(21.0, row)
    assert "Slack at times: cable 2" in Page(run_page(run, {})).text
    # A rope that slackens softly carries 69 N where nothing pulls at it.
    soft, run_of_soft = EffectSetting("slack", {"softness": 100.0}, (2,)), made_run(samples=200)
    run_of_soft.overview.add(22.0, np.where(np.array(run.columns) == "tension_2", 69.0, row))
    assert "Slack at times: cable 2" not in Page(run_page(run_of_soft, {})).text
    run_of_soft = replace(run_of_soft, robot=run.robot.with_effect(soft))
    assert "Slack at times: cable 2" in Page(run_page(run_of_soft, {})).text
    failed = replace(run, statistics=None, failure="cable_1: doStep failed at 21 s")
    page = Page(run_page(failed, {}))
    assert "Stopped: an FMU failed" in page.text and "cable_1: doStep failed at 21 s" in page.text


def test_output_that_no_fmu_shows_has_no_panel() -> None:
    run = made_run(samples=200)
    kept = [place for place, name in enumerate(run.columns) if name != "tension_2"]
    overview = RunOverview()
    for time, row in zip(run.overview.time, run.overview.rows, strict=True):
        overview.add(float(time), row[kept])
    page = Page(run_page(replace(run, columns=tuple(run.columns[k] for k in kept), overview=overview), {}))
    labels = [each["label"] for each in page.data()["choices"][0]["channels"] if each["title"] == "Tension"]
    assert labels == ["cable 1", "cable 3"]
    assert np.isnan(unpack_float32(page.data()["choices"][0]["scene"]["tension"][1])).all()


def test_page_asks_nothing_of_the_network() -> None:
    for tag, attributes in Page(run_page(made_run(samples=200), {"a b.csv": "../a b.csv"})).elements:
        assert not FETCHING & set(attributes), tag
        assert not re.match(r"(?i)\s*([a-z]+:|//)", attributes.get("href", ""))


def test_hostile_names_do_nothing() -> None:
    run = replace(made_run(HOSTILE, 200), notes=(HOSTILE,), failure=HOSTILE)
    hostile = Page(run_page(run, {}))
    assert "img" not in [tag for tag, _ in hostile.elements]
    assert len(hostile.scripts) == 3 and hostile.open == []
    assert hostile.text.count("onerror") >= 3


def test_simulate_writes_the_page_beside_the_result(tmp_path: Path) -> None:
    speeds, result, page = str(THREE / "fit.csv"), tmp_path / "result.csv", tmp_path / "pages" / "run.html"
    arguments = ["simulate", str(THREE / "robot.toml"), "--speeds", speeds, "--until", "0.5", "--out", str(result)]
    assert command([*arguments, "--report", str(page)]) == 0
    found = Page(page.read_text(encoding="utf-8"))
    assert "0.500 s along" in found.text
    assert "../result.csv" in found.links()


def test_page_in_the_place_of_the_result_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = str(tmp_path / "result.csv")
    arguments = ["simulate", str(THREE / "robot.toml"), "--speeds", str(THREE / "fit.csv"), "--out", result]
    assert command([*arguments, "--report", result]) == 2
    assert "--report" in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


def test_columns_are_those_of_a_result_file() -> None:
    assert made_run(samples=200).columns == tuple(column.name for column in result_columns(3)[1:])


def test_a_run_that_fails_leaves_a_page_that_says_where(tmp_path: Path) -> None:
    recording, page = tmp_path / "torn.csv", tmp_path / "run.html"
    speeds = {"time": [0.0, 0.1, 0.2, 0.3]} | {f"winch_speed_{i}": [0.0, 0.0, 0.0, 1e6] for i in (1, 2, 3)}
    pd.DataFrame({**speeds, "motor current": 1.0}).to_csv(recording, index=False)
    arguments = ["simulate", str(THREE / "robot.toml"), "--speeds", str(recording)]
    assert command([*arguments, "--out", str(tmp_path / "result.csv"), "--report", str(page)]) == 1
    result = Page(page.read_text(encoding="utf-8"))
    assert "Stopped: an FMU failed" in result.text and "the run up to then is in" in result.text
    assert "not read: motor current" in result.text
    assert unpack_float32(result.data()["choices"][0]["scene"]["time"]) == pytest.approx([0.0, 0.1, 0.2])


def test_a_run_that_cannot_begin_leaves_no_page(tmp_path: Path) -> None:
    recording, page = tmp_path / "empty.csv", tmp_path / "run.html"
    recording.write_text("time,winch_speed_1\n0.0,0.0\n", encoding="utf-8")
    arguments = ["simulate", str(THREE / "robot.toml"), "--speeds", str(recording)]
    assert command([*arguments, "--out", str(tmp_path / "result.csv"), "--report", str(page)]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["empty.csv"]


@pytest.mark.parametrize("eight", [False, True])
def test_page_of_a_long_run_stays_small_and_keeps_peaks(eight: bool) -> None:
    run = made_run(samples=20_000, eight=eight)
    content = run_page(run, {})
    assert len(content.encode()) < MAX_PAGE_BYTES
    position = Page(content).data()["choices"][0]["channels"][2]
    low, high = (each[2] for each in run.overview.extremes())
    drawn = unpack_float32(position["values"])
    assert position["unit"] == "mm"
    assert (drawn.min(), drawn.max()) == pytest.approx((1e3 * low, 1e3 * high), rel=1e-6)
    assert len(drawn) == len(unpack_float32(position["time"]))


def test_angular_velocities_are_in_mrad_per_second() -> None:
    run = made_rigid_run(example("cogiro"), 200)
    channels = Page(run_page(run, {})).data()["choices"][0]["channels"]
    (drawn,) = (each for each in channels if (each["title"], each["label"]) == ("Angular velocity", "y"))
    assert drawn["unit"] == "mrad/s"
    expected = 1e3 * run.overview.rows[:, run.columns.index("wy")]
    assert unpack_float32(drawn["values"]) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("samples", [1601, 4001])
def test_rotation_is_drawn_about_each_axis_with_that_between_recorded_and_co_simulated(samples: int) -> None:
    """By a tracker slower than the log that writes the other sign; of a long run only each second row is kept."""
    run = made_rigid_run(suspended_robot(6), samples)
    parts = [run.columns.index(f"q{part}") for part in "wxyz"]
    overview, exact = RunOverview(), run.recording.orientation
    for sample, orientation in enumerate(exact):
        row = run.overview.last_row.copy()
        row[parts] = orientation
        overview.add(float(run.recording.time[sample]), row)
    turned = Rotation.from_rotvec((0.0, 0.002, 0.0)) * rotation_of(exact)
    slow = np.where(np.arange(samples)[:, None] % 4 != 1, np.nan, -quaternions_of(turned))
    page = Page(run_page(replace(run, overview=overview, recording=replace(run.recording, orientation=slow)), {}))
    channels = [each for each in page.data()["choices"][0]["channels"] if each["title"] == "Rotation"]
    assert [(each["label"], each["unit"]) for each in channels] == [(f"about {axis}", "mrad") for axis in "xyz"]
    vectors = 1e3 * (rotation_of(exact) * rotation_of(exact[:1]).inv()).as_rotvec()
    for channel, expected, offset in zip(channels, vectors.T, (0.0, 2.0, 0.0), strict=True):
        drawn, recorded, differences = (
            unpack_float32(each["values"]) for each in (channel, channel["recorded"], channel["difference"])
        )
        assert (drawn.min(), drawn.max()) == pytest.approx((expected.min(), expected.max()), abs=1e-2)
        assert np.isfinite(recorded).mean() > 0.99
        assert np.nanmin(recorded) == pytest.approx(expected.min() + offset, abs=0.5)
        assert channel["difference"]["unit"] == "mrad"
        assert np.nanmax(np.abs(differences - offset)) < 0.5
        assert float(channel["difference"]["apart"]) == pytest.approx(offset, rel=0.05, abs=0.2)
    assert page.text.count("that from the co-simulated to the recorded orientation") == 2
    assert "rotation vector" in page.text and "rotation" not in Page(run_page(made_run(samples=200), {})).text.lower()


def test_platform_whose_fmu_shows_no_whole_orientation_has_no_rotation() -> None:
    run = made_rigid_run(suspended_robot(6), 200)
    kept = [index for index, name in enumerate(run.columns) if name != "qw"]
    overview = RunOverview()
    for time, row in zip(run.overview.time, run.overview.rows, strict=True):
        overview.add(float(time), row[kept])
    page = Page(run_page(replace(run, columns=tuple(run.columns[k] for k in kept), overview=overview), {}))
    titles = {each["title"] for each in page.data()["choices"][0]["channels"]}
    assert "Angular velocity" in titles and not titles & {"Orientation", "Rotation"}


@pytest.mark.parametrize("robot", [example("cogiro"), suspended_robot(12)], ids=lambda each: each.name)
def test_page_of_a_rigid_platform_on_many_cables_stays_small(robot: Robot) -> None:
    content = run_page(made_rigid_run(robot, 4000), {})
    assert len(content.encode()) < MAX_PAGE_BYTES
    scene = Page(content).data()["choices"][0]["scene"]
    assert len(scene["attachments"]) == robot.cable_count
    assert len(unpack_float32(scene["time"])) >= 250


@pytest.mark.parametrize("samples", [401, 4001])
def test_a_tracker_slower_than_the_log_is_drawn_as_lines(samples: int) -> None:
    """Of a long run only each second row is kept, or fewer: those without a sample of the tracker."""
    run = made_run(samples=samples)
    slow = np.where(np.arange(samples)[:, None] % 4 != 1, np.nan, run.recording.position)
    choice = Page(run_page(replace(run, recording=replace(run.recording, position=slow)), {})).data()["choices"][0]
    (recorded, *_), channel = choice["scene"]["paths"], choice["channels"][0]
    assert recorded["name"] == "recorded"
    drawn = [recorded["columns"][0], channel["recorded"]["values"], channel["difference"]["values"]]
    assert all(np.isfinite(unpack_float32(each)).mean() > 0.99 for each in drawn)
