"""Suggestion of the known name that a misspelt one is likely meant to be, and lists of names, for error messages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches

from .errors import format_value

# Ratio of difflib; below it names share little but a few letters.
MIN_NAME_SIMILARITY = 0.6
MAX_COMPARED_LENGTH = 80
MAX_UNABBREVIATED_SERIES, MAX_LISTED_NAMES = 2, 30

_DIGITS = re.compile("[0-9]+")


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
    lower_case_name = name[:MAX_COMPARED_LENGTH].lower()
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
