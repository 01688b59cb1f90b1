"""The table ``[vary]`` of a plan: distributions by key path of the robot file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import format_value
from ..robots.checked_table import CheckedTable
from .distributions import DISTRIBUTION_KINDS, LINSPACE, LIST, PARAMETER_NAMES, Distribution, parameter_problem
from .keys import KeyPathError, expand_key_path
from .plan import Input


def read_parameter_space(table: CheckedTable, content: Mapping[str, Any]) -> tuple[Input, ...]:
    """The parameter space of ``[vary]``; a key with ``[*]`` makes each entry of a list an independent input."""
    inputs: list[Input] = []
    for key, entry in _flatten_keys(table.content, ""):
        distribution = _read_distribution(table, key, entry)
        try:
            paths = expand_key_path(content, key)
        except KeyPathError as problem:
            table.refuse(key, problem.problem, problem.hint)
            continue
        inputs += [Input(path, distribution) for path in paths]
    if not inputs:
        table.refuse("", "is empty", 'add a key of the robot file, as in "cable.modulus" = {normal = [1e11, 2e9]}')
    return tuple(inputs)


def _flatten_keys(content: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Flat key paths with their entries; TOML nests a table where dots are not quoted."""
    for name, value in content.items():
        key = f"{prefix}.{name}" if prefix else name
        is_nested = isinstance(value, dict) and value and not set(value) & set(DISTRIBUTION_KINDS)
        # A table with a list is a distribution, possibly of an unknown kind.
        if is_nested and not any(isinstance(each, list) for each in value.values()):
            yield from _flatten_keys(value, key)
        else:
            yield key, value


def _read_distribution(table: CheckedTable, key: str, entry: Any) -> Distribution:
    hint = f"write one of {', '.join(DISTRIBUTION_KINDS)}, as in {{normal = [1e11, 2e9]}}"
    if not isinstance(entry, dict) or len(entry) != 1 or next(iter(entry)) not in DISTRIBUTION_KINDS:
        actual = "several" if isinstance(entry, dict) and len(entry) > 1 else format_value(entry)
        table.refuse(key, f"is {actual}, not one distribution", hint)
    ((kind, numbers),) = entry.items()
    if kind == LIST and isinstance(numbers, list) and numbers and all(isinstance(each, str) for each in numbers):
        return Distribution(kind, tuple(map(float, range(len(numbers)))), tuple(numbers))
    expected = f"{kind} = [{', '.join(PARAMETER_NAMES.get(kind, ('value', '...')))}]"
    if not isinstance(numbers, list) or not all(map(_is_number, numbers)):
        table.refuse(key, f"has {format_value(numbers)}, not finite numbers", f"write {expected}")
    if kind in (LIST, LINSPACE) and len(numbers) > 1_000_000:
        table.refuse(key, f"has {len(numbers)} values", "give fewer")
    problem = parameter_problem(kind, numbers)
    if problem is not None:
        table.refuse(key, problem, f"write {expected}")
    return Distribution(kind, tuple(map(float, numbers)))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
