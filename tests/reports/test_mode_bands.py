"""Where modes are marked in spectra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.estimation.trace_result import Resonance
from tautwire.linear import linearise, modes_along
from tautwire.reports.mode_bands import merge_mode_bands, mode_bands, resonance_bands
from tautwire.reports.trace_figures import spectrum_bands, trace_page_data
from tautwire.reports.trace_report_page import trace_page
from tests.support.pages import Page
from tests.support.rigid_robots import crane_robot
from tests.support.rigid_runs import made_rigid_trace
from tests.support.robots import example
from tests.support.traces import made_trace


@pytest.mark.validate
def test_bands_span_the_modes_along_the_path() -> None:
    robot = example("three")
    path = np.linspace((28.86, 0.0, 5.0), (35.0, 4.0, 12.0), 400)
    frequencies = modes_along(robot, path[::5]).frequencies
    bands = mode_bands(robot, path)
    assert min(band.low for band in bands) == pytest.approx(frequencies.min(), rel=0.01)
    assert max(band.high for band in bands) == pytest.approx(frequencies.max(), rel=0.01)


@pytest.mark.validate
def test_bands_of_a_rigid_platform_are_those_at_its_orientation_on_the_way() -> None:
    robot, position = crane_robot(), np.tile(crane_robot().platform.start, (5, 1))
    turned = np.roll(Rotation.from_rotvec((0.0, 0.0, 0.5)).as_quat(), 1)
    frequencies = linearise(robot, position[0], orientation=turned).modes.frequencies
    assert frequencies[0] != pytest.approx(linearise(robot).modes.frequencies[0], rel=0.03)
    # An FMU's quaternions are of norm 1 but for its integration error.
    bands = mode_bands(robot, position, np.tile(1.0001 * turned, (5, 1)))
    assert bands[0].low == pytest.approx(frequencies[0], rel=0.01)
    trace = made_rigid_trace(robot, 5)
    motion = replace(trace.comparisons[0].after, position=position, orientation=np.tile(turned, (5, 1)))
    assert spectrum_bands(trace, replace(trace.comparisons[0], after=motion))[0].low == pytest.approx(bands[0].low)


def test_modes_that_lie_apart_have_bands_of_their_own_and_others_share_one() -> None:
    bands = merge_mode_bands(np.array([[1.0, 1.05, 4.0], [1.2, 1.3, 4.4]]))
    assert [(band.label, band.low, band.high) for band in bands] == [("1 and 2", 1.0, 1.3), ("3", 4.0, 4.4)]
    each = "mode 1 between 1.000 and 1.200 Hz, mode 2 between 1.050 and 1.300 Hz"
    assert bands[0].words == f"Modes 1 and 2 lie close together: {each}"
    assert bands[0].spans == ((1.0, 1.2), (1.05, 1.3)) and bands[1].spans == ((4.0, 4.4),)
    still = merge_mode_bands(np.array([[2.0, 7.0]]))
    assert still[0].words == "Mode 1 lies at 2.000 Hz" and still[0].low < 2.0 < still[0].high


def test_three_close_modes_share_a_label_and_are_drawn_each() -> None:
    (band,) = merge_mode_bands(np.array([[1.1773, 1.1774, 1.2973]]))
    assert band.label == "1 to 3" and len(band.spans) == 3
    assert band.words.endswith("mode 1 at 1.177 Hz, mode 2 at 1.177 Hz, mode 3 at 1.297 Hz")


def test_path_where_the_cables_cannot_hold_the_platform_has_no_bands() -> None:
    robot = example("three")
    assert mode_bands(robot, np.linspace((200.0, 0.0, 5.0), (300.0, 0.0, 5.0), 50)) == []
    assert mode_bands(robot, np.full((20, 3), np.nan)) == []


def test_page_tells_modes_and_what_the_model_does_not_have() -> None:
    swinging = Resonance(0.45, ("x", "tension_1"), ("check",))
    trace = replace(made_trace(samples=800), resonances=(swinging,))
    fit, check = trace_page_data(trace)["choices"]
    assert [band["strange"] for band in fit["bands"]] == [False] * len(fit["bands"]) and fit["bands"]
    assert [band["strange"] for band in check["bands"]].count(True) == 1
    text = Page(trace_page(trace, {})).text
    assert f"Check recording: {resonance_bands([swinging])[0].words}" in text
    assert "An oscillation at 0.45 Hz" in text and "Fit recording: Mode" in text
