"""A table of a robot file that checks what it hands out."""

import math
import re
from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches
from typing import Any, NamedTuple

from ..errors import RobotFileError, at_once, shown

Refuse = Callable[[RobotFileError], None]
Place = tuple[str | int, ...]

# Beyond this no quantity of a cable robot lies, and squares of numbers still stay finite.
LARGEST = 1e15
LONGEST_KEY = 80
# Of difflib's ratio; below it names have little but a few letters in common.
ALIKE = 0.6
SHORT_SERIES, MOST_LISTED = 2, 30

_NUMBER = re.compile("[0-9]+")


class NumberRule(NamedTuple):
    """What a number must satisfy; ``positive`` excludes zero; ``meaning`` and ``unit`` are for messages."""

    meaning: str
    unit: str
    minimum: float = -LARGEST
    maximum: float = LARGEST
    positive: bool = False
    default: float | None = None

    def broken_bound(self, value: float) -> str | None:
        """The bound that a finite number breaks, such as ``above 0 kg``; None where it breaks none."""
        if self.positive and value <= 0.0:
            return f"above 0{self._unit()}"
        if value < self.minimum:
            return f"at least {self.minimum:g}{self._unit()}"
        return f"at most {self.maximum:g}{self._unit()}" if value > self.maximum else None

    def mend(self) -> str:
        """What to write."""
        return f"give {self.meaning}" + (f" in{self._unit()}" if self._unit() else "")

    def _unit(self) -> str:
        return f" {self.unit}" if self.unit not in ("", "1") else ""


class CheckedTable:
    """One table at a ``place`` of a file.

    What is wrong in it goes to ``sink`` as a RobotFileError, which names the file and the full key. Where that does
    not raise, as :func:`tautwire.errors.at_once` does, reading goes on: with NaN for a number, None for a text.
    """

    def __init__(self, file: str, key: str, content: dict[str, Any], sink: Refuse = at_once, place: Place = ()) -> None:
        self.file = file
        self.key = key
        self.content = content
        self.sink = sink
        self.place = place

    def refuse(self, key: str, problem: str, mend: str, entry: int | None = None) -> None:
        """Refuse a key of this table, or an entry of its list; or the table where ``key`` is empty."""
        named = key[:LONGEST_KEY] if entry is None else f"{key}[{entry + 1}]"
        path = ".".join(part for part in (self.key, named) if part)
        place = (*self.place, *([key] if key else []), *([] if entry is None else [entry]))
        self.sink(RobotFileError(f"{self.file}: {path}" if path else self.file, problem, mend, place))

    def require_known(self, known: Iterable[str]) -> None:
        """Refuses a key that is not among the known ones; names the one that is likely meant, or all."""
        names = tuple(known)
        for key in self.content:
            if key not in names:
                self.refuse(key, "is not a known key", f"write {nearest(key, names)}, or remove it")

    def number(self, key: str, rule: NumberRule) -> float:
        """The number under a key, or the rule's default."""
        if key not in self.content:
            if rule.default is None:
                self.refuse(key, "is missing", rule.mend())
                return math.nan
            return rule.default
        value = self._finite(key, self.content[key], rule.mend())
        bound = rule.broken_bound(value)
        if bound:
            self.refuse(key, f"is {value!r}, must be {bound}", rule.mend())
            return math.nan
        return value

    def optional_number(self, key: str, rule: NumberRule) -> float | None:
        """The number under a key; None where the key is absent."""
        return self.number(key, rule) if key in self.content else None

    def point(self, key: str, meaning: str) -> tuple[float, float, float]:
        """Three coordinates, in m."""
        mend = f"give {meaning} as [x, y, z] in m"
        value = self.content.get(key)
        if key not in self.content:
            self.refuse(key, "is missing", mend)
        elif not isinstance(value, list):
            self.refuse(key, f"is {shown(value)}, not a list of 3 numbers", mend)
        elif len(value) != 3:
            self.refuse(key, f"has {len(value)} entries, must have 3", mend)
        else:
            x, y, z = (self._coordinate(key, entry, each, mend) for entry, each in enumerate(value))
            return (x, y, z)
        return (math.nan, math.nan, math.nan)

    def text(self, key: str, mend: str) -> str | None:
        """The text under a key."""
        value = self.content.get(key)
        if key not in self.content:
            self.refuse(key, "is missing", mend)
        elif not isinstance(value, str):
            self.refuse(key, f"is {shown(value)}, not text", mend)
        else:
            return value
        return None

    def table(self, key: str) -> "CheckedTable | None":
        """The table under a key; None where there is none."""
        if key not in self.content:
            return None
        return self._inner(f"{self.key}.{key}" if self.key else key, self.content[key], (*self.place, key))

    def tables(self, key: str) -> "tuple[CheckedTable, ...]":
        """The array of tables under a key, their paths counted from 1."""
        path = f"{self.key}.{key}" if self.key else key
        value = self.content[key]
        if not isinstance(value, list):
            self.refuse(key, f"is {shown(value)}, not an array of tables", f"write it as [[{path}]]")
            return ()
        inner = (self._inner(f"{path}[{at + 1}]", one, (*self.place, key, at)) for at, one in enumerate(value))
        return tuple(table for table in inner if table is not None)

    def one_or_several(self, key: str) -> "tuple[CheckedTable, ...]":
        """The table under a key, or the array of tables."""
        if isinstance(self.content[key], list):
            return self.tables(key)
        table = self.table(key)
        return () if table is None else (table,)

    def _inner(self, path: str, content: Any, place: Place) -> "CheckedTable | None":
        if isinstance(content, dict):
            return CheckedTable(self.file, path, content, self.sink, place)
        problem = f"is {shown(content)}, not a table"
        self.sink(RobotFileError(f"{self.file}: {path}", problem, "write it as a table", place))
        return None

    def _finite(self, key: str, value: Any, mend: str, entry: int | None = None) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.refuse(key, f"is {shown(value)}, not a number", mend, entry)
            return math.nan
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.refuse(key, f"is {shown(value)}, must be finite", mend, entry)
            return math.nan
        return number

    def _coordinate(self, key: str, entry: int, value: Any, mend: str) -> float:
        number = self._finite(key, value, mend, entry)
        if abs(number) > LARGEST:
            self.refuse(key, f"is {number!r}, must be at most {LARGEST:g} m from the origin", mend, entry)
        return number


def nearest(name: str, known: Iterable[str]) -> str:
    """The known name that ``name`` is likely meant to be, quoted; else ``one of`` and all that are known."""
    names = tuple(known)
    found = likely(name, names)
    if found is not None or len(names) == 1:
        return shown(found or names[0])
    return f"one of {listed(names)}" if names else "one that is known"


def likely(name: str, known: Iterable[str]) -> str | None:
    """The known name that looks most like ``name``, letter case aside; None where none does.

    A name with other numbers in it is of something else, however alike: ``cable_9`` is no slip for ``cable_3``.
    """
    given = name[:LONGEST_KEY].lower()
    by_lower_case = {candidate.lower(): candidate for candidate in known}
    numbers = _numbers(given)
    alike = [each for each in by_lower_case if not (numbers and _numbers(each)) or numbers == _numbers(each)]
    found = get_close_matches(given, alike, n=1, cutoff=ALIKE)
    return by_lower_case[found[0]] if found else None


def listed(names: Sequence[str]) -> str:
    """Names with commas; of a long series, such as ``cable_1 ... cable_8``, the ends."""
    parts: list[str] = []
    for series in _series(names):
        parts += series if len(series) <= SHORT_SERIES else [f"{series[0]} ... {series[-1]}"]
    return ", ".join(parts[:MOST_LISTED]) + (" ..." if len(parts) > MOST_LISTED else "")


def _series(names: Sequence[str]) -> list[list[str]]:
    """Neighbours together that differ in their numbers only."""
    found: list[list[str]] = []
    for name in names:
        if found and _NUMBER.search(name) and _NUMBER.sub("", name) == _NUMBER.sub("", found[-1][-1]):
            found[-1].append(name)
        else:
            found.append([name])
    return found


def _numbers(name: str) -> list[str]:
    # As digits: Python refuses to count beyond some thousands of them.
    return [digits.lstrip("0") for digits in _NUMBER.findall(name)]
