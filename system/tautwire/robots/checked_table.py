"""A table of a robot file that checks what it hands out."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, NamedTuple

from ..errors import RobotFileError, shown

# Beyond this no quantity of a cable robot lies, and squares of numbers still stay finite.
LARGEST = 1e15


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
    """One table; every method raises RobotFileError, which names the file and the full key."""

    def __init__(self, file: str, key: str, content: Any) -> None:
        self.file = file
        self.key = key
        if not isinstance(content, dict):
            raise self.refusal("", f"is {shown(content)}, not a table", "write it as a table")
        self.content: dict[str, Any] = content

    def refusal(self, key: str, problem: str, mend: str) -> RobotFileError:
        """The error about one key of this table, or about the table where ``key`` is empty."""
        path = ".".join(part for part in (self.key, key) if part)
        return RobotFileError(f"{self.file}: {path}" if path else self.file, problem, mend)

    def require_known(self, known: Iterable[str]) -> None:
        """Refuses a key that is not among the known ones and names the nearest."""
        names = tuple(known)
        for key in self.content:
            if key not in names:
                mend = f"write {nearest(key, names)}, or remove it"
                raise self.refusal(key[:80], "is not a known key", mend)

    def number(self, key: str, rule: NumberRule) -> float:
        """The number under a key, or the rule's default."""
        if key not in self.content:
            if rule.default is None:
                raise self.refusal(key, "is missing", rule.mend())
            return rule.default
        value = self._finite(key, self.content[key], rule.mend())
        bound = rule.broken_bound(value)
        if bound:
            raise self.refusal(key, f"is {value!r}, must be {bound}", rule.mend())
        return value

    def optional_number(self, key: str, rule: NumberRule) -> float | None:
        """The number under a key; None where the key is absent."""
        return self.number(key, rule) if key in self.content else None

    def point(self, key: str, meaning: str) -> tuple[float, float, float]:
        """Three coordinates, in m."""
        mend = f"give {meaning} as [x, y, z] in m"
        if key not in self.content:
            raise self.refusal(key, "is missing", mend)
        value = self.content[key]
        if not isinstance(value, list):
            raise self.refusal(key, f"is {shown(value)}, not a list of 3 numbers", mend)
        if len(value) != 3:
            raise self.refusal(key, f"has {len(value)} entries, must have 3", mend)
        x, y, z = (self._coordinate(f"{key}[{place}]", entry, mend) for place, entry in enumerate(value, 1))
        return (x, y, z)

    def text(self, key: str, mend: str) -> str:
        """The text under a key."""
        if key not in self.content:
            raise self.refusal(key, "is missing", mend)
        value = self.content[key]
        if not isinstance(value, str):
            raise self.refusal(key, f"is {shown(value)}, not text", mend)
        return value

    def table(self, key: str) -> "CheckedTable":
        """The table under a key."""
        path = f"{self.key}.{key}" if self.key else key
        return CheckedTable(self.file, path, self.content[key])

    def tables(self, key: str) -> "tuple[CheckedTable, ...]":
        """The array of tables under a key, their paths counted from 1."""
        path = f"{self.key}.{key}" if self.key else key
        value = self.content[key]
        if not isinstance(value, list):
            raise self.refusal(key, f"is {shown(value)}, not an array of tables", f"write it as [[{path}]]")
        entries = enumerate(value, 1)
        return tuple(CheckedTable(self.file, f"{path}[{place}]", entry) for place, entry in entries)

    def _finite(self, key: str, value: Any, mend: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.refusal(key, f"is {shown(value)}, not a number", mend)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.refusal(key, f"is {shown(value)}, must be finite", mend)
        return number

    def _coordinate(self, key: str, value: Any, mend: str) -> float:
        number = self._finite(key, value, mend)
        if abs(number) > LARGEST:
            raise self.refusal(key, f"is {number!r}, must be at most {LARGEST:g} m from the origin", mend)
        return number


def nearest(name: str, known: Iterable[str]) -> str:
    """The known name that looks most like ``name``, quoted; letter case does not count."""
    by_lower_case = {candidate.lower(): candidate for candidate in known}
    found = get_close_matches(name[:80].lower(), by_lower_case, n=1, cutoff=0.0)
    return f"'{by_lower_case[found[0]]}'" if found else "one that is known"
