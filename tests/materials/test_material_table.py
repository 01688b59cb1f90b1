"""Tables of dynamic tests as files: what is read, and what is refused in one line."""

import math
from pathlib import Path

import pytest

from tautwire.errors import MaterialTableError
from tautwire.materials.material_table import PAPER_TABLE, read_material_table

HEADER = "frequency,storage_modulus,storage_modulus_uncertainty,loss_factor,loss_factor_uncertainty"
ROWS = [f"{f},1.2e11,3e9,0.1,0.01" for f in (0.1, 1, 2, 5)]


def table(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_the_papers_table_is_read_with_its_digits() -> None:
    read = read_material_table(PAPER_TABLE)
    assert [row.frequency for row in read.rows] == [0.1, 1.0, 2.0, 5.0, 10.0, 20.0]
    first = read.rows[0].quantities
    assert first["dynamic_modulus"].value == 121.4e9
    assert first["dynamic_modulus"].uncertainty == 2.8e9
    assert first["dynamic_modulus"].resolution == pytest.approx(0.1e9)
    assert first["phase"].value == pytest.approx(math.radians(6.8))
    assert first["phase"].uncertainty == pytest.approx(math.radians(2.3))
    assert first["phase"].resolution == pytest.approx(math.radians(0.1))
    assert read.rows[-1].quantities["damping"].value == 0.44e9
    assert read.rows[-1].quantities["damping"].uncertainty is None
    assert [row.quantities["storage_modulus"].value for row in read.static_rows] == [102.2e9]


def test_pairs_need_uncertainties_in_every_row() -> None:
    read = read_material_table(PAPER_TABLE)
    assert read.modulus_pairs() == (("dynamic_modulus", "phase"), ("storage_modulus", "loss_factor"))


def test_remarks_blank_lines_and_columns_without_uncertainty_are_read(tmp_path: Path) -> None:
    lines = ["# our rope", "", f"{HEADER},strain_amplitude", *(f"{row},1e-4" for row in ROWS)]
    read = read_material_table(table(tmp_path / "t.csv", *lines))
    assert len(read.rows) == 4
    assert read.rows[2].where.endswith("t.csv: line 6")
    assert read.rows[2].quantities["strain_amplitude"].value == 1e-4


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([], "is empty"),
        (["# only a remark"], "is empty"),
        ([HEADER.replace("frequency", "freq"), *ROWS], "line 1: the column 'freq' is not known; write 'frequency'"),
        ([HEADER.replace(",", ";"), *ROWS], "separated with semicolons or tabs"),
        ([HEADER + ",loss_factor", *ROWS], "line 1: the column 'loss_factor' appears twice"),
        ([HEADER + ",phase_uncertainty", *ROWS], "phase_uncertainty stands without phase"),
        ([HEADER + ",phase,phase_degrees", *ROWS], "in rad and in degrees"),
        ([HEADER.removeprefix("frequency,"), *ROWS], "the column frequency is missing"),
        ([HEADER, *ROWS[:3], "5,1.2e11,3e9,0.1"], "line 5: has 4 cells, the header has 5"),
        ([HEADER, *ROWS[:3], "5,1.2e11,3e9,tenth,0.01"], "line 5: loss_factor: is 'tenth', not a number"),
        ([HEADER, *ROWS[:3], "5,120,3e9,0.1,0.01"], "storage_modulus: is 120.0, must be at least 100000 Pa; give"),
        ([HEADER, *ROWS[:3], "5,1.2e11,0,0.1,0.01"], "storage_modulus_uncertainty: is 0.0, must be above 0 Pa"),
        ([HEADER, *ROWS[:3], ",1.2e11,3e9,0.1,0.01"], "line 5: frequency: is missing"),
        ([HEADER, *ROWS[:3], "inf,1.2e11,3e9,0.1,0.01"], "frequency: is 'inf', not a number"),
        ([HEADER, *ROWS[:3], "-1,1.2e11,3e9,0.1,0.01"], "frequency: is -1.0, must be at least 0 Hz"),
        ([HEADER, *ROWS[:3]], "has 3 rows of a frequency above zero, must have at least 4"),
        ([HEADER, *ROWS * 126], "has 504 rows, at most 500 are fitted"),
        ([HEADER, *ROWS, "0,,,0.1,0.01"], "line 6: a static row gives no storage_modulus"),
        ([HEADER, *ROWS[:3], "5,1.2e11,3e9,0.1,"], "no pair of columns gives a complex modulus"),
        ([HEADER, *ROWS[:3], '5,1.2e11,3e9,"' + "1" * 200_000], "line 5: is not valid CSV"),
    ],
)
def test_invalid_input_is_an_error_of_one_line(tmp_path: Path, lines: list[str], said: str) -> None:
    with pytest.raises(MaterialTableError) as caught:
        read_material_table(table(tmp_path / "t.csv", *lines))
    assert said in str(caught.value)
    assert "t.csv" in caught.value.where
    assert "\n" not in str(caught.value)


def test_a_number_with_a_monstrous_exponent_is_no_crash(tmp_path: Path) -> None:
    lines = [HEADER, *ROWS, "1,1.2e11,3e9,0e99999999,0.01"]
    assert len(read_material_table(table(tmp_path / "t.csv", *lines)).rows) == 5


def test_a_missing_file_and_a_spreadsheet_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MaterialTableError, match="there is no such file"):
        read_material_table(tmp_path / "none.csv")
    sheet = tmp_path / "sheet.csv"
    sheet.write_bytes(b"PK\x03\x04rest")
    with pytest.raises(MaterialTableError, match="spreadsheet"):
        read_material_table(sheet)
