"""The table ``[vary]`` of a plan: distributions by the keys of the robot file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import shown
from ..robots.checked_table import CheckedTable
from .distributions import KINDS, LINSPACE, LIST, SHAPES, Distribution, problem_of
from .keys import KeyPathError, paths_of
from .plan import Input


def inputs_of(table: CheckedTable, content: Mapping[str, Any]) -> tuple[Input, ...]:
    """What varies by ``[vary]``; a key with ``[*]`` gives each entry of a list a draw of its own."""
    found: list[Input] = []
    for key, given in _flat(table.content, ""):
        distribution = _distribution(table, key, given)
        try:
            paths = paths_of(content, key)
        except KeyPathError as problem:
            table.refuse(key, problem.problem, problem.mend)
            continue
        found += [Input(path, distribution) for path in paths]
    if not found:
        table.refuse("", "is empty", 'add a key of the robot file, as in "cable.modulus" = {normal = [1e11, 2e9]}')
    return tuple(found)


def _flat(content: Mapping[str, Any], before: str) -> Iterator[tuple[str, Any]]:
    """Keys with what stands there; TOML nests a table where dots are not quoted."""
    for name, value in content.items():
        key = f"{before}.{name}" if before else name
        is_nested = isinstance(value, dict) and value and not set(value) & set(KINDS)
        # A list is what a distribution has, if of a kind that is not known.
        if is_nested and not any(isinstance(each, list) for each in value.values()):
            yield from _flat(value, key)
        else:
            yield key, value


def _distribution(table: CheckedTable, key: str, given: Any) -> Distribution:
    mend = f"write one of {', '.join(KINDS)}, as in {{normal = [1e11, 2e9]}}"
    if not isinstance(given, dict) or len(given) != 1 or next(iter(given)) not in KINDS:
        told = "several" if isinstance(given, dict) and len(given) > 1 else shown(given)
        table.refuse(key, f"is {told}, not one distribution", mend)
    ((kind, numbers),) = given.items()
    if kind == LIST and isinstance(numbers, list) and numbers and all(isinstance(each, str) for each in numbers):
        return Distribution(kind, tuple(map(float, range(len(numbers)))), tuple(numbers))
    shape = f"{kind} = [{', '.join(SHAPES.get(kind, ('value', '...')))}]"
    if not isinstance(numbers, list) or not all(map(_is_number, numbers)):
        table.refuse(key, f"has {shown(numbers)}, not finite numbers", f"write {shape}")
    if kind in (LIST, LINSPACE) and len(numbers) > 1_000_000:
        table.refuse(key, f"has {len(numbers)} values", "give fewer")
    problem = problem_of(kind, numbers)
    if problem is not None:
        table.refuse(key, problem, f"write {shape}")
    return Distribution(kind, tuple(map(float, numbers)))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
