"""Whether columns agree, on rows whose agreement is known and on the paper's table."""

import math
from pathlib import Path

import pytest

from tautwire.materials.material_table import PAPER_TABLE, read_material_table
from tautwire.materials.table_consistency import (
    ConsistencyCheck,
    consistency_checks,
    disagreements,
    understated_uncertainties,
)

HEADER = (
    "frequency,dynamic_modulus,dynamic_modulus_uncertainty,storage_modulus,storage_modulus_uncertainty,"
    "phase_degrees,phase_degrees_uncertainty,loss_factor,damping"
)
# |E*| = 100 GPa at 30 degrees: E' = 86.60254 GPa, eta = 0.577350, c = 50 GPa / (2 pi f).
GOOD = "1,100.000e9,1e9,86.603e9,1e9,30.000,1,0.57735,7.958e9"


def of_row(path: Path, row: str, column: str) -> dict[str, ConsistencyCheck]:
    rows = [row, *(GOOD.replace("1,", f"{f},", 1) for f in (2, 3, 4))]
    path.write_text("\n".join([HEADER, *rows]) + "\n", encoding="utf-8")
    result = consistency_checks(read_material_table(path))
    return {check.formula: check for check in result if check.frequency == 1.0 and check.column == column}


def test_rounded_columns_agree(tmp_path: Path) -> None:
    for column in ("storage_modulus", "dynamic_modulus", "loss_factor", "damping"):
        result = of_row(tmp_path / "t.csv", GOOD, column)
        assert result
        assert all(check.agreement == "agrees" and check.range_gap == 0.0 for check in result.values())


def test_truncated_digits_are_distinguished_from_wrong_ones(tmp_path: Path) -> None:
    cut = of_row(tmp_path / "t.csv", GOOD.replace("86.603e9", "86.602e9"), "storage_modulus")["|E*| cos phi"]
    assert cut.agreement == "agrees"  # the digits of |E*| and phi leave that much room
    sharp = GOOD.replace("100.000e9", "100.0000000e9").replace("30.000", "30.0000000")
    cut = of_row(tmp_path / "t.csv", sharp.replace("86.603e9", "86.602e9"), "storage_modulus")["|E*| cos phi"]
    assert cut.agreement == "agrees if cut off"
    assert cut.range_gap == pytest.approx(4e4, rel=0.1)
    wrong = of_row(tmp_path / "t.csv", GOOD.replace("86.603e9", "86.303e9"), "storage_modulus")["|E*| cos phi"]
    assert wrong.agreement == "disagrees"
    assert wrong.recomputed == pytest.approx(86.60254e9)
    assert 0.2e9 < wrong.range_gap < 0.3e9


def test_uncertainty_is_propagated_from_both_inputs(tmp_path: Path) -> None:
    check = of_row(tmp_path / "t.csv", GOOD, "storage_modulus")["|E*| cos phi"]
    expected = math.hypot(1e9 * math.cos(math.radians(30.0)), 100e9 * math.sin(math.radians(30.0)) * math.radians(1.0))
    assert check.uncertainty == pytest.approx(expected, rel=1e-6)
    assert check in understated_uncertainties([check])


def test_the_papers_table_disagrees_with_itself_in_three_rows() -> None:
    result = disagreements(consistency_checks(read_material_table(PAPER_TABLE)))
    named = {(check.frequency, check.column, check.formula): check.agreement for check in result}
    assert named == {
        (2.0, "storage_modulus", "|E*| cos phi"): "disagrees",
        (5.0, "storage_modulus", "|E*| cos phi"): "disagrees",
        (5.0, "dynamic_modulus", "E' sqrt(1 + eta^2)"): "disagrees",
        (5.0, "damping", "|E*| sin phi / (2 pi f)"): "agrees if cut off",
        (10.0, "loss_factor", "tan phi"): "agrees if cut off",
    }


def test_the_papers_uncertainty_of_the_storage_modulus_leaves_the_phase_out() -> None:
    short = understated_uncertainties(consistency_checks(read_material_table(PAPER_TABLE)))
    assert [check.frequency for check in short if check.column == "storage_modulus"] == [2.0, 5.0, 10.0, 20.0]
