"""Numbers tell what a column is, and its unit, where its name does not and they decide; the figure is said."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire import read_robot
from tautwire.recordings.column_names import ColumnName
from tautwire.recordings.column_proposal import ProposedColumn, propose_columns
from tautwire.recordings.column_samples import ColumnSamples
from tautwire.recordings.recording import read_recording
from tautwire.recordings.recording_table import is_column_name
from tautwire.recordings.value_proposal import with_values
from tautwire.robot.schema import Robot
from tests.support.robots import EXAMPLES

Array = NDArray[np.float64]
THREE = EXAMPLES / "three"
COUNT = 2000
FALLING = np.sin(np.linspace(0.0, 3.0, COUNT))


@pytest.fixture(scope="module")
def robot() -> Robot:
    return read_robot(THREE / "robot.toml")


@pytest.fixture(scope="module")
def recorded() -> dict[str, Array]:
    """The columns of a recording by their standard names."""
    frame = read_recording(THREE / "fit.csv", 3).first(COUNT).frame()
    return {str(name): frame[name].to_numpy() for name in frame}


def proposed(
    values: dict[str, Array], robot: Robot | None = None, cables: int = 3, units: dict[str, str] | None = None
) -> tuple[dict[str, dict[str, str]], dict[str, str]]:
    """The proposed columns, and the reasons for those that are not used."""
    names = [ColumnName(name, name if is_column_name(name) else None, name) for name in values]
    proposal = with_values(propose_columns(names, cables), ColumnSamples(values, units or {}), cables, robot)
    return {each.column: asdict(each) for each in proposal.columns}, dict(proposal.unused)


@pytest.mark.parametrize(("step", "unit"), [(0.002, "s"), (2.0, "ms"), (2000.0, "us"), (2e6, "ns")])
@pytest.mark.parametrize("name", ["Col1", "Zeit", "time"])
def test_the_step_of_a_column_that_rises_evenly_tells_the_unit_of_time(step: float, unit: str, name: str) -> None:
    columns, _ = proposed({name: 17.0 + step * np.arange(COUNT), "Col2": FALLING})
    expected = "" if name == "time" and unit == "s" else unit
    assert (columns["time"]["name"], columns["time"]["unit"]) == (name, expected)
    assert ("500 Hz" in columns["time"]["doubt"]) == bool(expected)


@pytest.mark.parametrize(
    "values",
    [
        np.arange(COUNT),
        np.arange(COUNT) * 0.1,
        np.arange(COUNT) * 7.0 % 100.0,
        np.cumsum(np.arange(COUNT) % 5 + 1.0),
        np.append(np.arange(COUNT - 1) * 0.002, np.nan),
    ],
    ids=["number of the row", "two units fit", "not rising", "not even", "not a number"],
)
def test_what_may_not_be_a_time_is_left_out(values: Array) -> None:
    columns, unused = proposed({"Col1": values, "Col2": FALLING})
    assert columns == {} and unused.keys() == {"Col1", "Col2"}


def test_two_columns_that_rise_evenly_are_left_out() -> None:
    times = 0.002 * np.arange(COUNT)
    columns, unused = proposed({"Col1": times, "Col2": 1e3 * times, "AI3 [V]": times})
    assert columns == {} and unused.keys() == {"Col1", "Col2", "AI3 [V]"}


def test_a_robot_at_its_start_tells_columns_without_names(robot: Robot, recorded: dict[str, Array]) -> None:
    scales = {"tension": 1e-3, "time": 1e6}
    own = {name: scales.get(name.split("_")[0], 1e3 if name in "xyz" else 1.0) * recorded[name] for name in recorded}
    wanted = {name: numbers for name, numbers in own.items() if not name.startswith("winch")}
    values = {f"Ch {index}": numbers for index, numbers in enumerate(wanted.values())} | {"Ch 99": np.ones(COUNT)}
    columns, unused = proposed(values, robot)
    assert [columns[name]["name"] for name in wanted] == list(values)[:-1]
    assert [columns[name]["unit"] for name in ("time", "tension_3", "y")] == ["us", "kN", "mm"]
    assert columns["x"]["doubt"] == "by its values: begins at 28860, the robot at 28860 mm, in the file's order"
    assert unused == {"Ch 99": "no known word"}
    assert proposed(values)[0].keys() == {"time"}


def test_columns_that_fit_a_start_twice_are_left_out(robot: Robot, recorded: dict[str, Array]) -> None:
    twice = {f"Col{index}": recorded[name] for index, name in enumerate("xyzxyz")}
    assert proposed(twice, robot)[0] == {}


def recorded_axes(recorded: dict[str, Array]) -> dict[str, Array]:
    return {f"pos {axis}": 1e3 * recorded[axis] for axis in "xyz"}


def test_the_start_tells_units_that_names_do_not(robot: Robot, recorded: dict[str, Array]) -> None:
    forces = {f"Kraft {cable}": 1e-3 * recorded[f"tension_{cable}"] for cable in (1, 2, 3)}
    columns, _ = proposed(recorded_axes(recorded) | forces, robot)
    assert {each: columns[each]["unit"] for each in columns} == dict.fromkeys("xyz", "mm") | {
        f"tension_{cable}": "kN" for cable in (1, 2, 3)
    }
    assert "mm by its values: x begins at 28860, the robot at 28860 mm" in columns["y"]["doubt"]
    assert "kN by its values: they begin at 1.00 of the robot's static tension" in columns["tension_1"]["doubt"]
    standard = proposed({name: 1e3 * recorded[name] for name in "xyz"}, robot)[0]
    assert standard["z"]["unit"] == "mm"
    assert proposed({name: recorded[name] for name in "xyz"}, robot)[0]["z"] == asdict_of("z")


def asdict_of(name: str) -> dict[str, object]:
    return asdict(ProposedColumn(name, name))


@pytest.mark.parametrize(("extent", "unit"), [(2.0, "m"), (1500.0, "mm"), (40.0, "")])
def test_the_range_tells_metres_from_millimetres_without_a_robot(extent: float, unit: str) -> None:
    columns, _ = proposed({"pos x": extent * FALLING, "pos y": 0.0 * FALLING})
    assert [columns[axis]["unit"] for axis in "xy"] == [unit, unit]


@pytest.mark.parametrize("name", ["Zeit", "Col1", "time"])
def test_clock_times_have_no_unit(name: str) -> None:
    values = {name: 0.002 * np.arange(COUNT), "Col2": FALLING}
    proposal = propose_columns([ColumnName(each, "time" if each == "time" else None, each) for each in values], 3)
    (time,) = with_values(proposal, ColumnSamples(values, clocks=frozenset([name])), 3).columns
    assert (time.column, time.name, time.unit) == ("time", name, "")
    assert "no unit" not in time.doubt


def test_units_in_the_file_stay(recorded: dict[str, Array], robot: Robot) -> None:
    columns, _ = proposed(recorded_axes(recorded) | {"Col1": recorded["time"]}, robot, units={"Col1": "s"})
    assert {each["unit"] for each in columns.values()} == {""}
