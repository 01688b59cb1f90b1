"""A table of a robot file that validates the values it returns, and the line of the file in which a key stands."""

from __future__ import annotations

import math
import re
import sys
from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from difflib import get_close_matches
from typing import Any, NamedTuple

from ..errors import RobotFileError, format_value, raise_error

ErrorSink = Callable[[RobotFileError], None]
KeyPath = tuple[str | int, ...]

# No quantity of a cable robot is larger, and squares of numbers stay finite.
MAX_MAGNITUDE = 1e15
MAX_KEY_LENGTH = 80
# Ratio of difflib; below it names share little but a few letters.
MIN_NAME_SIMILARITY = 0.6
MAX_UNABBREVIATED_SERIES, MAX_LISTED_NAMES = 2, 30

_DIGITS = re.compile("[0-9]+")


class NumberRule(NamedTuple):
    """Validity range of a number; ``positive`` excludes zero; ``meaning`` and ``unit`` are for messages."""

    meaning: str
    unit: str
    minimum: float = -MAX_MAGNITUDE
    maximum: float = MAX_MAGNITUDE
    positive: bool = False
    default: float | None = None

    def violated_bound(self, value: float) -> str | None:
        """The bound that a finite number violates, such as ``above 0 kg``; None if it violates none."""
        if self.positive and value <= 0.0:
            return f"above 0{self._unit()}"
        if value < self.minimum:
            return f"at least {self.minimum:g}{self._unit()}"
        return f"at most {self.maximum:g}{self._unit()}" if value > self.maximum else None

    def hint(self) -> str:
        """Hint about what to write."""
        return f"give {self.meaning}" + (f" in{self._unit()}" if self._unit() else "")

    def _unit(self) -> str:
        return f" {self.unit}" if self.unit not in ("", "1") else ""


class CheckedTable:
    """One table of a file, at ``key_path``, with validated access to its values.

    Each error goes to ``sink`` as a RobotFileError, which names the file and the full key. If ``sink`` does not raise
    it, as :func:`tautwire.errors.at_once` does, reading continues with NaN for a number and None for a text.
    """

    def __init__(
        self, file: str, key: str, content: dict[str, Any], sink: ErrorSink = raise_error, key_path: KeyPath = ()
    ) -> None:
        self.file = file
        self.key = key
        self.content = content
        self.sink = sink
        self.key_path = key_path

    def refuse(self, key: str, problem: str, hint: str, entry: int | None = None) -> None:
        """Reports an error of a key of this table, or of an entry of its list; of the table if ``key`` is empty."""
        shortened_key = key[:MAX_KEY_LENGTH] if entry is None else f"{key}[{entry + 1}]"
        path = ".".join(part for part in (self.key, shortened_key) if part)
        key_path = (*self.key_path, *([key] if key else []), *([] if entry is None else [entry]))
        self.sink(RobotFileError(f"{self.file}: {path}" if path else self.file, problem, hint, key_path))

    def require_known(self, known: Iterable[str]) -> None:
        """Reports each unknown key, with the known one that is likely meant, or all."""
        names = tuple(known)
        for key in self.content:
            if key not in names:
                self.refuse(key, "is not a known key", f"write {suggest_name(key, names)}, or remove it")

    def number(self, key: str, rule: NumberRule) -> float:
        """The number under a key, or the rule's default."""
        if key not in self.content:
            if rule.default is None:
                self.refuse(key, "is missing", rule.hint())
                return math.nan
            return rule.default
        value = self._finite_number(key, self.content[key], rule.hint())
        bound = rule.violated_bound(value)
        if bound:
            self.refuse(key, f"is {value!r}, must be {bound}", rule.hint())
            return math.nan
        return value

    def optional_number(self, key: str, rule: NumberRule) -> float | None:
        """The number under a key; None where the key is absent."""
        return self.number(key, rule) if key in self.content else None

    def point(self, key: str, meaning: str) -> tuple[float, float, float]:
        """Three coordinates, in m."""
        hint = f"give {meaning} as [x, y, z] in m"
        value = self.content.get(key)
        if key not in self.content:
            self.refuse(key, "is missing", hint)
        elif not isinstance(value, list):
            self.refuse(key, f"is {format_value(value)}, not a list of 3 numbers", hint)
        elif len(value) != 3:
            self.refuse(key, f"has {len(value)} entries, must have 3", hint)
        else:
            x, y, z = (self._coordinate(key, entry, each, hint) for entry, each in enumerate(value))
            return (x, y, z)
        return (math.nan, math.nan, math.nan)

    def text(self, key: str, hint: str) -> str | None:
        """The text under a key."""
        value = self.content.get(key)
        if key not in self.content:
            self.refuse(key, "is missing", hint)
        elif not isinstance(value, str):
            self.refuse(key, f"is {format_value(value)}, not text", hint)
        else:
            return value
        return None

    def table(self, key: str) -> CheckedTable | None:
        """The table under a key; None where there is none."""
        if key not in self.content:
            return None
        return self._nested_table(f"{self.key}.{key}" if self.key else key, self.content[key], (*self.key_path, key))

    def tables(self, key: str) -> tuple[CheckedTable, ...]:
        """The array of tables under a key, their paths counted from 1."""
        path = f"{self.key}.{key}" if self.key else key
        value = self.content[key]
        if not isinstance(value, list):
            self.refuse(key, f"is {format_value(value)}, not an array of tables", f"write it as [[{path}]]")
            return ()
        nested_tables = (
            self._nested_table(f"{path}[{at + 1}]", one, (*self.key_path, key, at)) for at, one in enumerate(value)
        )
        return tuple(table for table in nested_tables if table is not None)

    def table_or_tables(self, key: str) -> tuple[CheckedTable, ...]:
        """The table under a key, or the array of tables."""
        if isinstance(self.content[key], list):
            return self.tables(key)
        table = self.table(key)
        return () if table is None else (table,)

    def _nested_table(self, path: str, content: Any, key_path: KeyPath) -> CheckedTable | None:
        if isinstance(content, dict):
            return CheckedTable(self.file, path, content, self.sink, key_path)
        problem = f"is {format_value(content)}, not a table"
        self.sink(RobotFileError(f"{self.file}: {path}", problem, "write it as a table", key_path))
        return None

    def _finite_number(self, key: str, value: Any, hint: str, entry: int | None = None) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse(key, f"is {format_value(value)}, not a number", hint, entry)
            return math.nan
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.refuse(key, f"is {format_value(value)}, must be finite", hint, entry)
            return math.nan
        return number

    def _coordinate(self, key: str, entry: int, value: Any, hint: str) -> float:
        number = self._finite_number(key, value, hint, entry)
        if abs(number) > MAX_MAGNITUDE:
            self.refuse(key, f"is {number!r}, must be at most {MAX_MAGNITUDE:g} m from the origin", hint, entry)
        return number


def suggest_name(name: str, known: Iterable[str]) -> str:
    """The known name that ``name`` is likely meant to be, quoted; otherwise ``one of`` and all known names."""
    names = tuple(known)
    match = closest_name(name, names)
    if match is not None or len(names) == 1:
        return format_value(match or names[0])
    return f"one of {join_names(names)}" if names else "one that is known"


def closest_name(name: str, known: Iterable[str]) -> str | None:
    """The known name most similar to ``name``, ignoring case; None if none is similar.

    A name with other numbers in it means something else, however similar: ``cable_9`` is no slip for ``cable_3``.
    """
    lower_case_name = name[:MAX_KEY_LENGTH].lower()
    by_lower_case = {candidate.lower(): candidate for candidate in known}
    numbers = _digit_groups(lower_case_name)
    candidates = [
        each for each in by_lower_case if not (numbers and _digit_groups(each)) or numbers == _digit_groups(each)
    ]
    matches = get_close_matches(lower_case_name, candidates, n=1, cutoff=MIN_NAME_SIMILARITY)
    return by_lower_case[matches[0]] if matches else None


def join_names(names: Sequence[str]) -> str:
    """Names separated by commas; a long series is abbreviated, such as ``cable_1 ... cable_8``."""
    parts: list[str] = []
    for series in _group_series(names):
        parts += series if len(series) <= MAX_UNABBREVIATED_SERIES else [f"{series[0]} ... {series[-1]}"]
    return ", ".join(parts[:MAX_LISTED_NAMES]) + (" ..." if len(parts) > MAX_LISTED_NAMES else "")


def _group_series(names: Sequence[str]) -> list[list[str]]:
    """Groups neighbours that differ in their numbers only."""
    groups: list[list[str]] = []
    for name in names:
        if groups and _DIGITS.search(name) and _DIGITS.sub("", name) == _DIGITS.sub("", groups[-1][-1]):
            groups[-1].append(name)
        else:
            groups.append([name])
    return groups


def _digit_groups(name: str) -> list[str]:
    # Kept as digits: Python refuses to convert more than some thousands of them.
    return [digits.lstrip("0") for digits in _DIGITS.findall(name)]


if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

MAX_STATEMENT_LINES = 1000  # lines


def line_of_key(text: str, key_path: Sequence[str | int]) -> int | None:
    """The line, from 1, of the statement in a TOML text that declares a key path, or its longest existing part.

    Bisection over the prefixes of the text that are TOML: the first that contains the key path ends with its
    statement. None if no part of the key path exists.
    """
    lines = text.split("\n")
    full_depth = _matched_depth(_parse_prefix(lines, len(lines)), key_path)
    if not full_depth:
        return None
    return bisect_left(
        range(len(lines) + 1), full_depth, key=lambda count: _matched_depth(_parse_prefix(lines, count), key_path)
    )


def _parse_prefix(lines: Sequence[str], line_count: int) -> Any:
    """Parses the first lines, with as many more as complete the last statement."""
    for last in range(line_count, min(line_count + MAX_STATEMENT_LINES, len(lines)) + 1):
        with suppress(ValueError):
            return tomllib.loads("\n".join(lines[:last]) + "\n")
    return {}


def _matched_depth(content: Any, key_path: Sequence[str | int]) -> int:
    """How many keys of the path exist."""
    for depth, key in enumerate(key_path):
        keys = content if isinstance(content, dict) else range(len(content) if isinstance(content, list) else 0)
        if key not in keys:
            return depth
        content = content[key]
    return len(key_path)
