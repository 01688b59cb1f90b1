"""Where in a robot file something stands."""

from __future__ import annotations

import sys
from bisect import bisect_left
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

LONGEST_STATEMENT = 1000  # lines


def line_of(text: str, place: Sequence[str | int]) -> int | None:
    """The line, from 1, of the statement in a TOML text that declares a place; of what is there of it if it is missing.

    The beginnings of a text that are TOML have more and more of it: the first that has the place ends with its
    statement. None where nothing of the place is there.
    """
    lines = text.split("\n")
    whole = _depth(_beginning(lines, len(lines)), place)
    if not whole:
        return None
    return bisect_left(range(len(lines) + 1), whole, key=lambda count: _depth(_beginning(lines, count), place))


def _beginning(lines: Sequence[str], count: int) -> Any:
    """What the first lines say, with as many more as end the statement that they break off in."""
    for last in range(count, min(count + LONGEST_STATEMENT, len(lines)) + 1):
        with suppress(ValueError):
            return tomllib.loads("\n".join(lines[:last]) + "\n")
    return {}


def _depth(content: Any, place: Sequence[str | int]) -> int:
    """How many steps of the way to a place are there."""
    for depth, step in enumerate(place):
        known = content if isinstance(content, dict) else range(len(content) if isinstance(content, list) else 0)
        if step not in known:
            return depth
        content = content[step]
    return len(place)
