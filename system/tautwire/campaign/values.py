"""Values of a plan beside those that robot files have: whole numbers, choices, flags, files beside it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ..errors import shown
from ..input_file import read_bytes
from ..robots.checked_table import CheckedTable, NumberRule, nearest
from .errors import PlanError


def file_beside(table: CheckedTable, name: str | None) -> Path:
    """The path of a file that a plan names."""
    return (Path(table.file).parent / str(name)).absolute()


def whole(table: CheckedTable, key: str, rule: NumberRule) -> int:
    """The whole number under a key, or the rule's default."""
    number = table.number(key, rule)
    if number != int(number):
        table.refuse(key, f"is {number!r}, not a whole number", rule.mend())
    return int(number)


def one_of(table: CheckedTable, key: str, known: tuple[str, ...]) -> str:
    """The text under a key, one of those known; empty where it is absent."""
    if key not in table.content:
        return ""
    listed = ", ".join(f'"{each}"' for each in known)
    given = table.text(key, f"write one of {listed}") or ""
    if given not in known:
        table.refuse(key, f"is {shown(given)}, must be one of {listed}", f"write {nearest(given, known)}")
    return given


def flag(table: CheckedTable, key: str, default: bool) -> bool:
    """True or false, the default where the key is absent."""
    value = table.content.get(key, default)
    if not isinstance(value, bool):
        table.refuse(key, f"is {shown(value)}, not true or false", f"write {key} = true or {key} = false")
    return bool(value)


def digest_of(file: Path) -> str:
    """What tells the contents of files apart."""
    return hashlib.sha256(read_bytes(file, PlanError)).hexdigest()[:16]
