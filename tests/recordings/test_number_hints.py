"""Numbers that are written for readers are told as they have to be written."""

from __future__ import annotations

import pytest

from tautwire.recordings.number_hints import hint_for_number


@pytest.mark.parametrize(
    ("cell", "mark", "hint"),
    [
        ("1,234.5", ".", "write it with a decimal point, without separators of thousands"),
        ("1.234,5", ",", "write it with a decimal comma, without separators of thousands"),
        ("1\u202f234,5", ",", "write it with a decimal comma, without separators of thousands"),
        ("1'234.5", ".", "write it with a decimal point, without separators of thousands"),
        ("3,5", ".", "write it with a decimal point"),
        ("3.5", ",", "write it with a decimal comma, as others in this file, and without separators of thousands"),
        ("1.5D-03", ".", "write it as 1.5E-03"),
        ("\u22120.5", ".", "write it as -0.5"),
        ("3.5 kN", ".", "write 3.5, and the unit in the header"),
        ("12%", ".", ""),
        ("OVERLOAD", ".", ""),
        ("", ".", ""),
    ],
)
def test_a_number_otherwise_written_is_told_as_it_has_to_be(cell: str, mark: str, hint: str) -> None:
    assert hint_for_number(cell, mark) == hint
