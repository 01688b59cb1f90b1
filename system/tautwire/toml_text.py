"""Parsing of TOML text, and the line on which a key stands, which the parser does not tell."""

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

MAX_STATEMENT_LINES = 1000  # lines


def parse_toml(text: str) -> dict[str, Any]:
    """Parses a TOML text; raises ValueError where it is none, RecursionError where it is nested too deeply."""
    content: dict[str, Any] = tomllib.loads(text)
    return content


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
            return parse_toml("\n".join(lines[:last]) + "\n")
    return {}


def _matched_depth(content: Any, key_path: Sequence[str | int]) -> int:
    """How many keys of the path exist."""
    for depth, key in enumerate(key_path):
        keys = content if isinstance(content, dict) else range(len(content) if isinstance(content, list) else 0)
        if key not in keys:
            return depth
        content = content[key]
    return len(key_path)
