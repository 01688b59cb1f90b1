"""The parameter space of a campaign: varied numbers of the robot file, by key path, and their distributions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from typing import Any, NamedTuple

from ..errors import format_value
from ..robot.checked_table import CheckedTable
from .campaign_plan import DISTRIBUTION_KINDS, LINSPACE, LIST, PARAMETER_NAMES, Distribution, Input, parameter_problem

KEY_STEP_PATTERN = re.compile(r"(?P<name>[A-Za-z0-9_-]+)(?:\[(?P<entry>\d+|\*)\])?(?:\[(?P<column>\d+)\])?\Z")
ALL_ENTRIES = "*"
# A text that no robot file contains.
LEAF_MARK = "\0"


class KeyStep(NamedTuple):
    """One step of a key path: a key, the entry of a list, and the ``column`` of a matrix in that row, from 1."""

    name: str
    entry: str = ""
    column: str = ""


class KeyPathError(ValueError):
    """A key path that leads to no number: ``problem`` in a few words, and a ``hint`` how to correct it."""

    def __init__(self, problem: str, hint: str) -> None:
        super().__init__(problem, hint)
        self.problem = problem
        self.hint = hint


def parse_key_path(path: str) -> tuple[KeyStep, ...]:
    """The steps of a key path; raises KeyPathError where its syntax is wrong."""
    matches = [KEY_STEP_PATTERN.match(part) for part in path.split(".")]
    if not all(matches):
        raise KeyPathError("is not a key path", "write it as cable.modulus, cable[2].modulus or platform.start[1]")
    return tuple(KeyStep(match["name"], match["entry"] or "", match["column"] or "") for match in matches if match)


def expand_key_path(content: Mapping[str, Any], path: str) -> tuple[str, ...]:
    """The key path itself, or one for each entry of the list at its ``[*]``."""
    steps = parse_key_path(path)
    for index, step in enumerate(steps):
        if step.entry == ALL_ENTRIES:
            entries = _table_at(content, steps[:index]).get(step.name)
            if not isinstance(entries, list):
                raise KeyPathError(f"{step.name} is not a list in the robot file", f"leave [{ALL_ENTRIES}] out")
            entry_paths = [
                _format_key_path((*steps[:index], step._replace(entry=str(i)), *steps[index + 1 :]))
                for i in _entry_numbers(entries)
            ]
            return tuple(each for one in entry_paths for each in expand_key_path(content, one))
    return (path,)


def with_values(content: Mapping[str, Any], values: Mapping[str, float | str]) -> dict[str, Any]:
    """A copy of the content with values set at key paths; a path through a list without an entry sets all entries.

    Raises KeyPathError where a key path leads nowhere.
    """
    changed: dict[str, Any] = deepcopy(dict(content))
    for path, value in values.items():
        _set_value(changed, parse_key_path(path), value)
    return changed


def leaves_of(content: Mapping[str, Any], path: str) -> frozenset[tuple[str | int, ...]]:
    """Leaves of the content, as keys and indices, whose value a key path sets in :func:`with_values`.

    Raises KeyPathError where it leads nowhere.
    """
    return frozenset(_marked_leaves(with_values(content, {path: LEAF_MARK})))


def _marked_leaves(node: Any) -> Iterator[tuple[str | int, ...]]:
    entries = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, each in entries:
        if each == LEAF_MARK:
            yield (key,)
        yield from ((key, *leaf) for leaf in _marked_leaves(each))


def _set_value(table: dict[str, Any], steps: Sequence[KeyStep], value: float | str) -> None:
    step, remaining = steps[0], steps[1:]
    if not remaining:
        _set_last_value(table, step, value)
        return
    inner = table.setdefault(step.name, {})
    tables = inner if isinstance(inner, list) else [inner]
    if step.entry:
        if not isinstance(inner, list):
            raise KeyPathError(f"{step.name} is not a list in the robot file", f"leave [{step.entry}] out")
        tables = [_entry(inner, step)]
    for each in tables:
        if not isinstance(each, dict):
            raise KeyPathError(f"{step.name} is not a table in the robot file", "name a number of the robot file")
        _set_value(each, remaining, value)


def _set_last_value(table: dict[str, Any], step: KeyStep, value: float | str) -> None:
    current = table.get(step.name)
    if step.entry:
        if current is None:
            raise KeyPathError(f"{step.name} is not in the robot file", f"write {step.name} there, or another key here")
        if not isinstance(current, list):
            raise KeyPathError(f"{step.name} is not a list in the robot file", f"leave [{step.entry}] out")
        row = _entry(current, step)
        if step.column:
            _set_matrix_entry(current, step, value)
        elif isinstance(row, list):
            hint = f"name one entry of the matrix, as in {step.name}[{step.entry}][1]"
            raise KeyPathError(f"{step.name}[{step.entry}] is not a number in the robot file", hint)
        else:
            current[int(step.entry) - 1] = value
    elif isinstance(current, list | dict):
        hint = f"name one entry, as in {step.name}[1]" if isinstance(current, list) else "name a key inside it"
        raise KeyPathError(f"{step.name} is not a number in the robot file", hint)
    else:
        table[step.name] = value


def _set_matrix_entry(rows: list[Any], step: KeyStep, value: float | str) -> None:
    """Sets an entry of a matrix and the one across its diagonal: all matrices of a robot file are symmetric."""
    across = KeyStep(step.name, step.column)
    row, column = int(step.entry) - 1, int(step.column) - 1
    if not isinstance(_entry(rows, step), list) or not isinstance(_entry(rows, across), list):
        raise KeyPathError(f"{step.name} is not a matrix in the robot file", f"leave [{step.column}] out")
    rows[row][column] = rows[column][row] = value


def _entry(entries: Sequence[Any], step: KeyStep) -> Any:
    if not 1 <= int(step.entry) <= len(entries):
        raise KeyPathError(f"{step.name} has no entry {step.entry}", f"give one from 1 to {len(entries)}")
    return entries[int(step.entry) - 1]


def _table_at(content: Mapping[str, Any], steps: Sequence[KeyStep]) -> Mapping[str, Any]:
    node: Any = content
    for step in steps:
        node = node.get(step.name, {}) if isinstance(node, Mapping) else {}
        if step.entry and isinstance(node, list):
            node = _entry(node, step)
    return node if isinstance(node, Mapping) else {}


def _entry_numbers(entries: Sequence[Any]) -> range:
    return range(1, len(entries) + 1)


def _format_key_path(steps: Sequence[KeyStep]) -> str:
    return ".".join(
        step.name + "".join(f"[{number}]" for number in (step.entry, step.column) if number) for step in steps
    )


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
