"""Lines that are not TOML are told with what to write in their place."""

from __future__ import annotations

from pathlib import Path

import pytest

from tautwire.errors import RobotFileError
from tautwire.robot.robot_file_reader import read_robot
from tests.support.robots import EXAMPLES

ROBOT = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")
LINES = {
    "decimal comma": ("mass = 300.0", "mass = 300,5", "write a decimal point: mass = 300.5"),
    "unit": ("mass = 300.0", "mass = 300 kg", "write the number alone, mass = 300, "),
    "colon": ("mass = 300.0   ", "mass: 300.0   ", "write mass = 300.0"),
    "fraction": ("mass = 300.0", "mass = 600/2", "write mass as one number"),
    "power": ("modulus = 1.022e11", "modulus = 1.022*10^11", "write modulus as one number, such as 1.022e11"),
    "no quotation marks": ('law = "logarithmic"', "law = logarithmic", 'write law = "logarithmic", in quotation'),
    "curly quotation marks": ('law = "logarithmic"', "law = \u201clogarithmic\u201d", 'write law = "logarithmic"'),
    "one quotation mark": ('"logarithmic"  ', '"logarithmic  ', "close the quotation mark"),
    "one bracket": ("start = [28.86, 0.0, 5.0]", "start = [28.86, 0.0, 5.0", "close the list that begins in line 10"),
    "a cable's table": ("[[cable]]", "[cable]", "write [[cable]] above each"),
    "a table twice": ("[sensors]", "[platform]\nmass = 3\n[sensors]", "write all keys of [platform] into one table"),
    "a key twice": ("mass = 300.0", "mass = 300.0\nmass = 310.0", "the key stands twice, keep one of the two"),
}


def refusal(text: str, folder: Path) -> str:
    path = folder / "robot.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RobotFileError, match="is not TOML") as refused:
        read_robot(path)
    return refused.value.hint


@pytest.mark.parametrize("case", LINES)
def test_a_line_is_told_with_what_to_write(case: str, tmp_path: Path) -> None:
    before, after, hint = LINES[case]
    assert before in ROBOT and hint in refusal(ROBOT.replace(before, after), tmp_path)


@pytest.mark.parametrize("text", ['{"name": "three"}', '<?xml version="1.0"?>\n<robot/>'])
def test_another_format_is_told_with_how_to_begin(text: str, tmp_path: Path) -> None:
    assert "tautwire new NAME" in refusal(text, tmp_path)


def test_what_has_no_hint_is_to_be_corrected(tmp_path: Path) -> None:
    assert refusal("mass == 3", tmp_path) == "correct this line"
