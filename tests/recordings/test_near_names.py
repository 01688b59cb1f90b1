"""Names of columns that differ from the standard ones in case, separators or a unit are known, and no others."""

from __future__ import annotations

import pytest

from tautwire.recordings.near_names import columns_of_absent_kinds, nearly_named

COLUMNS = ("qw", "tension_1", "x", "y")


@pytest.mark.parametrize(
    ("name", "column", "unit"),
    [
        ("X", "x", ""),
        ("x_mm", "x", "mm"),
        ("Y (Meters)", "y", "m"),
        ("x in mm", "x", "mm"),
        ("x, mm", "x", "mm"),
        ("TENSION-1 / kN", "tension_1", "kN"),
        ("Tension01", "tension_1", ""),
        ("QW [-]", "qw", ""),
    ],
)
def test_a_name_that_differs_by_little_is_known(name: str, column: str, unit: str) -> None:
    near = nearly_named(name, COLUMNS)
    assert near is not None and (near.column, near.name, near.unit) == (column, name, unit)


@pytest.mark.parametrize(
    "name", ["x (raw)", "x_in", "y min", "X_4", "Hook_X", "tension_12", "x axis", "X_Value", "(x)y", ""]
)
def test_another_name_is_not(name: str) -> None:
    assert nearly_named(name, COLUMNS) is None


def test_what_was_left_out_beside_others_of_its_kind_was_meant_to_be() -> None:
    """The third axis of a planar robot, a load cell that is dead, an orientation that a point has not."""
    known = ["qw", "tension_1", "tension_2", "x", "y", "z"]
    assert columns_of_absent_kinds(known, ["time", "x", "Y [mm]", "z", "tension_1"]) == []
    assert columns_of_absent_kinds(known, ["time", "X", "tension_2_kN", "z"]) == ["tension_1", "tension_2"]
    assert columns_of_absent_kinds(known, ["time", "X", "tension_1"]) == ["x", "y", "z"]
