"""Codes of a missing number are emptied in every column, also single ones; numbers that are measured stay."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.recordings.missing_codes import without_missing_codes
from tautwire.recordings.recording_table import Header
from tautwire.recordings.units import find_unit

TIME = np.arange(200) / 100.0
MOTION = 2.0 + 0.3 * np.sin(TIME)


@pytest.mark.parametrize("code", [-9999.0, 9999.0, -999.0, 1e6, -32768.0])
@pytest.mark.parametrize("name", ["x", "tension_1", "winch_speed_2", "rope_length_1"])
def test_a_single_code_is_emptied_and_told(code: float, name: str) -> None:
    lost = np.arange(200) == 77
    header = Header(("time", name), ())
    changed, (note,) = without_missing_codes({"time": TIME, name: np.where(lost, code, MOTION)}, header)
    assert np.array_equal(np.isnan(changed[name]), lost) and np.array_equal(changed[name][~lost], MOTION[~lost])
    assert note.startswith(f"{name}: 1 sample at {code:.10g}, as programs write ")


def test_a_code_is_the_number_in_the_file_whatever_its_unit() -> None:
    unit = find_unit("mm", "x")
    assert unit is not None
    header = Header(("time", "x"), (), units={"x": unit})
    shown = np.where(np.arange(200) % 50 == 7, -9999.0, 1e3 * MOTION)
    changed, (note,) = without_missing_codes({"time": TIME, "x": unit.to_si(shown)}, header)
    assert np.isnan(changed["x"]).sum() == 4 and "4 samples at -9999," in note


def test_a_sensor_that_passes_a_code_on_its_way_is_read() -> None:
    counts = np.linspace(-40_000.0, 40_000.0, 200)
    counts[[20, 180]] = -32768.0, 32767.0
    columns = {"time": TIME, "rope_length_1": counts, "tension_1": np.where(TIME < 1.0, 999.0, 1000.5)}
    changed, notes = without_missing_codes(columns, Header(tuple(columns), ()))
    assert notes == () and all(np.array_equal(changed[name], values) for name, values in columns.items())
