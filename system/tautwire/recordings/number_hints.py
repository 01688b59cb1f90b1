"""Hints for cells of recordings that are numbers to a reader, and not to a parser."""

from __future__ import annotations

import re

_GROUPED_WITH_COMMAS = re.compile(r"[-+]?[0-9]{1,3}(?:,[0-9]{3})+(?:\.[0-9]*)?")
_GROUPED_WITH_POINTS = re.compile(r"[-+]?[0-9]{1,3}(?:\.[0-9]{3})+,[0-9]*")
_GROUPED_WITH_SPACES = re.compile(r"[-+]?[0-9]{1,3}(?:[ '\u2019\u00a0\u202f][0-9]{3})+(?:[.,][0-9]*)?")
_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")
_PLAIN = re.compile(r"[-+]?[0-9]*[.,]?[0-9]+(?:[eE][-+]?[0-9]+)?")
_NUMBER_AND_UNIT = re.compile(rf"({_PLAIN.pattern})\s*[^\W\d_][\w/%]*")
_OTHER_MARKS = str.maketrans({"\u2212": "-", "\u2013": "-", "D": "E", "d": "e"})


def hint_for_number(cell: str, decimal_mark: str) -> str:
    """How to write a number with separators of thousands, other marks or its unit; blank for what is no number."""
    mark = "comma" if decimal_mark == "," else "point"
    if decimal_mark == "." and _DECIMAL_COMMA.fullmatch(cell):
        return "write it with a decimal point"
    if any(pattern.fullmatch(cell) for pattern in (_GROUPED_WITH_COMMAS, _GROUPED_WITH_POINTS, _GROUPED_WITH_SPACES)):
        return f"write it with a decimal {mark}, without separators of thousands"
    if decimal_mark == "," and "." in cell:
        return "write it with a decimal comma, as others in this file, and without separators of thousands"
    plain = cell.translate(_OTHER_MARKS)
    if plain != cell and _PLAIN.fullmatch(plain):
        return f"write it as {plain}"
    match = _NUMBER_AND_UNIT.fullmatch(cell)
    return f"write {match.group(1)}, and the unit in the header" if match else ""
