"""Jumps of encoders whose range ends are undone, and no others."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.recordings.encoder_wrap import without_wraps
from tautwire.recordings.recording_table import Header
from tautwire.robot.schema import RecordedColumn

TIME = np.arange(2000) / 100.0
TURNED = 3.0 * np.sin(0.7 * TIME) + 0.2 * TIME  # turns of a drum


def header(factor: float = 1.0) -> Header:
    scale = RecordedColumn("rope_length_1", "rope_length_1", "", factor, 1.0, 0.0)
    return Header(("time", "rope_length_1"), (), scales={"rope_length_1": scale})


@pytest.mark.parametrize(
    ("per_turn", "period", "lowest"),
    [(20_000.0, 65_536.0, -32_768.0), (360.0, 360.0, 0.0), (2.0 * np.pi, 2.0 * np.pi, -np.pi), (1000.0, 4096.0, 0.0)],
)
@pytest.mark.parametrize("factor", [1.0, 3e-5])
def test_a_range_that_ends_is_continued(per_turn: float, period: float, lowest: float, factor: float) -> None:
    recorded = (per_turn * TURNED - lowest) % period + lowest
    changed, (note,) = without_wraps({"time": TIME, "rope_length_1": factor * recorded}, header(factor))
    expected = factor * per_turn * (TURNED - TURNED[0])
    lengths = changed["rope_length_1"]
    assert lengths - lengths[0] == pytest.approx(expected, abs=1e-9 * factor * period)
    assert note.startswith(f"rope_length_1 begins anew after {period:.9g}, ")


@pytest.mark.parametrize("jump", [50_000.0, -100.5, 700.0])
def test_another_jump_stays(jump: float) -> None:
    lengths = TURNED + np.where(TIME > 7.0, jump, 0.0)
    changed, notes = without_wraps({"time": TIME, "rope_length_1": lengths}, header())
    assert notes == () and np.array_equal(changed["rope_length_1"], lengths)


def test_a_motion_by_a_turn_is_no_wrap() -> None:
    lengths = np.sin(0.5 * TIME)
    changed, notes = without_wraps({"time": TIME, "rope_length_1": lengths, "x": 360.0 * (TIME > 3.0)}, header())
    assert notes == () and np.array_equal(changed["rope_length_1"], lengths)
