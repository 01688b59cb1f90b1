"""A table of a robot file that validates the values it returns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from ..errors import RobotFileError, format_value, raise_error
from ..name_suggestions import suggest_name
from ..validation import MAX_MAGNITUDE, NumberRule

ErrorSink = Callable[[RobotFileError], None]
KeyPath = tuple[str | int, ...]
Point = tuple[float, float, float]

MAX_KEY_LENGTH = 80
# Of unit vectors and quaternions that were written with three digits or more, and that were normalised.
MAX_NORM_ERROR, NORM_ROUNDING = 1e-3, 1e-15
# Relative to the largest entry: what rounding to six digits leaves.
MAX_ASYMMETRY = 1e-6
NO_POINT = (math.nan, math.nan, math.nan)


def normalised(numbers: tuple[float, ...]) -> tuple[float, ...]:
    """A vector with norm 1, or zero; what was normalised once stays as it is, so that files read back equal."""
    norm = math.hypot(*numbers)
    needs_scaling = norm > 0.0 and abs(norm - 1.0) > NORM_ROUNDING
    return tuple(number / norm for number in numbers) if needs_scaling else numbers


class CheckedTable:
    """One table of a file, at ``key_path``, with validated access to its values.

    Each error goes to ``sink`` as a RobotFileError, which names the file and the full key. If ``sink`` does not raise
    it, as :func:`tautwire.errors.raise_error` does, reading continues with NaN for a number and None for a text.
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

    def point(self, key: str, meaning: str, default: Point | None = None) -> Point:
        """Three coordinates, in m; those of ``default`` where the key is absent, if there is one."""
        if default is not None and key not in self.content:
            return default
        x, y, z = self._numbers(key, 3, f"give {meaning} as [x, y, z] in m", is_point=True)
        return (x, y, z)

    def unit_vector(self, key: str, meaning: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Numbers whose squares add up to one, as many as ``default`` has; normalised if only rounded."""
        if key not in self.content:
            return default
        hint = f"give {meaning} as {len(default)} numbers whose squares add up to 1"
        numbers = self._numbers(key, len(default), hint)
        norm = math.hypot(*numbers)
        if abs(norm - 1.0) > MAX_NORM_ERROR:
            scaled = ", ".join(f"{number / norm:.6g}" for number in numbers) if norm > 0.0 else ""
            problem = f"has norm {norm:.6g}, must have 1 within {MAX_NORM_ERROR:g}"
            self.refuse(key, problem, hint + (f", such as [{scaled}]" if scaled else ""))
        return normalised(numbers)

    def symmetric_matrix(self, key: str, meaning: str) -> tuple[Point, Point, Point]:
        """Three rows of three numbers, symmetric."""
        hint = f"give {meaning} as [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]"
        rows = self.content[key]
        if not isinstance(rows, list) or len(rows) != 3:
            self.refuse(key, f"is {format_value(rows)}, not a list of 3 rows", hint)
            return (NO_POINT, NO_POINT, NO_POINT)
        xx, xy, xz, yx, yy, yz, zx, zy, zz = (
            number for row in range(3) for number in self._numbers(key, 3, hint, row=row)
        )
        scale = max(map(abs, (xx, xy, xz, yx, yy, yz, zx, zy, zz)))
        for names, above, below in (("xy", xy, yx), ("xz", xz, zx), ("yz", yz, zy)):
            if abs(above - below) > MAX_ASYMMETRY * scale:
                self.refuse(key, f"has {above:g} and {below:g} for {names}, must be symmetric", hint)
        return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))

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

    def _numbers(
        self, key: str, count: int, hint: str, is_point: bool = False, row: int | None = None
    ) -> tuple[float, ...]:
        """The ``count`` finite numbers of a list, or of a row of it; NaN where they are not what they must be."""
        if key not in self.content:
            self.refuse(key, "is missing", hint)
            return (math.nan,) * count
        value = self.content[key] if row is None else self.content[key][row]
        if not isinstance(value, list):
            self.refuse(key, f"is {format_value(value)}, not a list of {count} numbers", hint, row)
        elif len(value) != count:
            self.refuse(key, f"has {len(value)} entries, must have {count}", hint, row)
        elif is_point:
            return tuple(self._coordinate(key, entry, each, hint) for entry, each in enumerate(value))
        else:
            entries = enumerate(value)
            return tuple(self._finite_number(key, each, hint, entry if row is None else row) for entry, each in entries)
        return (math.nan,) * count

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
