"""Values of a plan that robot files do not have: whole numbers, choices, flags and relative paths."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ..errors import format_value
from ..input_file import read_bytes
from ..robots.checked_table import CheckedTable, NumberRule, suggest_name
from .errors import PlanError


def file_relative_to_plan(table: CheckedTable, name: str | None) -> Path:
    """The absolute path of a file that a plan names relative to itself."""
    return (Path(table.file).parent / str(name)).absolute()


def whole_number(table: CheckedTable, key: str, rule: NumberRule) -> int:
    """The whole number under a key, or the rule's default."""
    number = table.number(key, rule)
    if number != int(number):
        table.refuse(key, f"is {number!r}, not a whole number", rule.hint())
    return int(number)


def choice(table: CheckedTable, key: str, choices: tuple[str, ...]) -> str:
    """The text under a key, one of the choices; empty where the key is absent."""
    if key not in table.content:
        return ""
    listed = ", ".join(f'"{each}"' for each in choices)
    value = table.text(key, f"write one of {listed}") or ""
    if value not in choices:
        table.refuse(key, f"is {format_value(value)}, must be one of {listed}", f"write {suggest_name(value, choices)}")
    return value


def flag(table: CheckedTable, key: str, default: bool) -> bool:
    """The boolean under a key, or the default where the key is absent."""
    value = table.content.get(key, default)
    if not isinstance(value, bool):
        table.refuse(key, f"is {format_value(value)}, not true or false", f"write {key} = true or {key} = false")
    return bool(value)


def file_digest(file: Path) -> str:
    """Digest of a file's content."""
    return hashlib.sha256(read_bytes(file, PlanError)).hexdigest()[:16]
