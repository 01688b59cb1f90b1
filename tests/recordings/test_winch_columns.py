"""The coordinates tell cable, factor, unit and sign of winch columns that names leave open, with the figure."""

from __future__ import annotations

import re
from collections.abc import Mapping

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
from tautwire.recordings.winch_columns import ProposedFile, with_winch_scales
from tautwire.robot.schema import QUATERNION_COLUMNS, Robot
from tests.support.rigid_recordings import rigid_recording, with_noise
from tests.support.rigid_robots import octahedral_robot
from tests.support.robots import EXAMPLES

Array = NDArray[np.float64]
THREE = EXAMPLES / "three"
COUNT = 2000
CABLES = (1, 2, 3)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return read_robot(THREE / "robot.toml")


@pytest.fixture(scope="module")
def recorded() -> dict[str, Array]:
    """The columns of a recording by their standard names."""
    frame = read_recording(THREE / "fit.csv", 3).first(COUNT).frame()
    return {str(name): frame[name].to_numpy() for name in frame}


def file_of(values: Mapping[str, Array], cables: int, robot: Robot | None) -> ProposedFile:
    names = [ColumnName(name, name if is_column_name(name) else None, name) for name in values]
    samples = ColumnSamples(values)
    return ProposedFile(with_values(propose_columns(names, cables), samples, cables, robot), samples)


def proposed(
    values: Mapping[str, Array],
    robot: Robot | None = None,
    tracker: Mapping[str, Array] | None = None,
    cables: int = 3,
) -> dict[str, ProposedColumn]:
    """The columns that are proposed for winches."""
    of_tracker = None if tracker is None else file_of(tracker, 0, robot)
    proposal = with_winch_scales(file_of(values, cables, robot), cables, robot, of_tracker)
    assert {each.name for each in proposal.columns}.isdisjoint(proposal.unused)
    return {each.column: each for each in proposal.columns if each.column.startswith(("rope", "winch"))}


def speeds(recorded: Mapping[str, Array]) -> Array:
    return np.array([recorded[f"winch_speed_{cable}"] for cable in CABLES])


def counts(recorded: Mapping[str, Array], scale: float = 2.5e-5) -> Array:
    return np.round(np.cumsum(speeds(recorded), axis=1) * 0.01 / -scale)


def axes(recorded: Mapping[str, Array]) -> dict[str, Array]:
    return {axis: recorded[axis] for axis in "xyz"}


def test_counts_without_names_have_the_cables_that_the_coordinates_tell(
    robot: Robot, recorded: dict[str, Array]
) -> None:
    one, two, three = counts(recorded)
    columns = proposed({"data_1": three, "data_2": -one, "data_3": two} | axes(recorded), robot)
    told = [(columns[f"rope_length_{cable}"].name, columns[f"rope_length_{cable}"].sign) for cable in CABLES]
    assert told == [("data_2", -1), ("data_3", 1), ("data_1", 1)]
    assert [each.factor for each in columns.values()] == pytest.approx([2.5e-5] * 3, rel=1e-3)
    assert "as counts of an encoder; cable by the coordinates; factor and sign" in columns["rope_length_1"].doubt


def test_counts_without_coordinates_are_in_the_order_of_the_file(recorded: dict[str, Array]) -> None:
    own = dict(zip(("data_1", "data_2", "data_3"), counts(recorded), strict=True))
    columns = proposed(own)
    assert columns["rope_length_1"].name == "data_1" and columns["rope_length_1"].factor is None
    assert "cables in the file's order; add factor = metres per count; has to fall" in columns["rope_length_1"].doubt
    assert proposed(own, cables=4) == {}
    assert proposed({**own, "Drive1 [m/s]": speeds(recorded)[0]}).keys() == {"winch_speed_1"}
    falling = np.sin(np.linspace(0.0, 3.0, COUNT))
    assert proposed({f"Col{index}": np.round(900.0 * falling) for index in CABLES}) == {}


@pytest.mark.parametrize("scale", [2.5e-5, 1e-3])
@pytest.mark.parametrize("apart", [False, True], ids=["one file", "tracker"])
def test_the_factor_of_named_counts_is_proposed_with_its_figure(
    scale: float, apart: bool, robot: Robot, recorded: dict[str, Array]
) -> None:
    one, two, three = counts(recorded, scale)
    log = {"Zeit [s]": recorded["time"], "enc_1_cnt": one, "enc_2_cnt": -two, "enc_3_cnt": three}
    tracker = {"Zeit [s]": recorded["time"] + 51.3} | axes(recorded)
    columns = proposed(log, robot, tracker) if apart else proposed(log | axes(recorded), robot)
    assert [columns[f"rope_length_{cable}"].factor for cable in CABLES] == pytest.approx([scale] * 3, rel=2e-3)
    assert [columns[f"rope_length_{cable}"].sign for cable in CABLES] == [1, -1, 1]
    source = "the tracker's coordinates" if apart else "the coordinates"
    pattern = (
        rf"factor and sign by {source}, to [0-9.]+ % \(rms; cables alike to [0-9.]+ %\): an estimate with the errors "
        r"of drum and rope in it, "
    )
    formula = r"replace it by metres per count \(2 pi \* drum radius / counts per turn\)"
    assert re.fullmatch(pattern + formula, columns["rope_length_1"].doubt)
    assert re.fullmatch(f"{pattern}as above", columns["rope_length_2"].doubt)
    assert re.match(
        r'rope_length_2 = { name = "enc_2_cnt", factor = [0-9.e-]+, sign = -1 }  #', columns["rope_length_2"].line()
    )


def test_drums_that_differ_have_factors_of_their_own(robot: Robot, recorded: dict[str, Array]) -> None:
    own = {f"enc_{cable}": (1.0 + 0.1 * cable) * counts(recorded)[cable - 1] for cable in CABLES}
    columns = proposed(own | axes(recorded), robot)
    expected = [2.5e-5 / (1.0 + 0.1 * cable) for cable in CABLES]
    assert [columns[f"rope_length_{cable}"].factor for cable in CABLES] == pytest.approx(expected, rel=2e-3)
    assert "alike" not in columns["rope_length_1"].doubt


@pytest.mark.parametrize(("size", "unit"), [(1.0, "m/s"), (1e3, "mm/s"), (60.0, "m/min"), (17.0, "")])
def test_speeds_without_names_are_those_whose_integrals_are_rope_lengths(
    size: float, unit: str, robot: Robot, recorded: dict[str, Array]
) -> None:
    one, two, three = size * speeds(recorded)
    own = {
        "Zeit [s]": recorded["time"],
        "c1": two,
        "c2": three,
        "c3": -one,
        "c4": recorded["tension_1"],
        "c5": 0.0 * one,
    }
    columns = proposed(own | axes(recorded), robot)
    assert [(columns[f"winch_speed_{cable}"].name, columns[f"winch_speed_{cable}"].sign) for cable in CABLES] == [
        ("c3", -1),
        ("c1", 1),
        ("c2", 1),
    ]
    assert {each.unit for each in columns.values()} == {unit}
    factors = [each.factor for each in columns.values()]
    assert factors == ([None] * 3 if unit else pytest.approx([1.0 / 17.0] * 3, rel=1e-2))
    assert "if summed up; cable by the coordinates; " in columns["winch_speed_1"].doubt
    assert proposed(own, robot) == {}
    assert proposed(own | {"c6": two} | axes(recorded), robot) == {}


def test_named_columns_get_the_sign_and_unit_that_fit(robot: Robot, recorded: dict[str, Array]) -> None:
    one, two, three = speeds(recorded)
    own = {"Zeit [s]": recorded["time"], "Drive1 [m/s]": -one, "Drive2 [m/s]": two, "Drive3 [mm/s]": three}
    columns = proposed(own | axes(recorded), robot)
    assert [columns[f"winch_speed_{cable}"].sign for cable in CABLES] == [-1, 1, 1]
    assert "sign by the coordinates" in columns["winch_speed_1"].doubt
    # The numbers contradict the unit, so the line stays as its name has it.
    assert columns["winch_speed_3"].doubt == "positive has to reel in"
    bare = proposed({"Zeit [s]": own["Zeit [s]"], "v1": one, "v2": 1e3 * two, "v3": three} | axes(recorded), robot)
    assert [bare[f"winch_speed_{cable}"].unit for cable in CABLES] == ["m/s", "mm/s", "m/s"]


def test_what_the_coordinates_do_not_fit_stays_as_its_name_has_it(robot: Robot, recorded: dict[str, Array]) -> None:
    one, two, three = counts(recorded)
    columns = proposed({"enc_1": two, "enc_2": one, "enc_3": three} | axes(recorded), robot)
    assert {each.factor for each in columns.values()} == {None}
    assert all("add factor = metres per count" in each.doubt for each in columns.values())
    assert proposed({"enc_1": one} | axes(recorded), None)["rope_length_1"].factor is None


@pytest.mark.validate
def test_a_tracker_that_wrote_zeros_for_a_lost_platform_tells_the_factor_of_counts_too() -> None:
    turning = octahedral_robot()
    frame = rigid_recording(with_noise(turning), 800).frame()
    values = {str(name): frame[name].to_numpy(copy=True) for name in frame}
    wound = np.array([np.cumsum(values.pop(f"winch_speed_{cable}")) for cable in range(1, 7)])
    steps = np.diff(values["time"])
    for cable, each in enumerate(wound, start=1):
        values[f"encoder_{cable}"] = np.round(each * steps[0] / -2.5e-6)
    values |= {name: np.where(np.arange(len(steps) + 1) < 5, 0.0, values[name]) for name in QUATERNION_COLUMNS}
    factors = [each.factor for each in proposed(values, turning, cables=6).values()]
    assert factors == pytest.approx([2.5e-6] * 6, rel=0.02)


def test_clock_times_are_in_seconds_whatever_their_doubt() -> None:
    values = {"c0": 0.01 * np.arange(COUNT)}
    names = [ColumnName("c0", None, "c0")]
    samples = ColumnSamples(values, clocks=frozenset(values))
    proposal = with_values(propose_columns(names, 0), samples, 0)
    assert proposal.columns[0].doubt
    np.testing.assert_array_equal(ProposedFile(proposal, samples).si_values("time"), values["c0"])
