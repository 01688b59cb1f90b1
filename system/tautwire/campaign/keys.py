"""Numbers of a robot file by the paths of their keys, such as ``cable[2].modulus`` or ``platform.start[1]``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any, NamedTuple

STEP = re.compile(r"(?P<name>[A-Za-z0-9_-]+)(?:\[(?P<entry>\d+|\*)\])?\Z")
EACH = "*"


class Step(NamedTuple):
    """One step of a path: a key, and the entry of a list, counted from 1, where there is one."""

    name: str
    entry: str = ""


class KeyPathError(ValueError):
    """A path that leads to no number: ``problem`` in a few words, and how to ``mend`` it."""

    def __init__(self, problem: str, mend: str) -> None:
        super().__init__(problem, mend)
        self.problem = problem
        self.mend = mend


def steps_of(path: str) -> tuple[Step, ...]:
    """The steps of a path; raises KeyPathError where it has no such form."""
    found = [STEP.match(part) for part in path.split(".")]
    if not all(found):
        raise KeyPathError("is no path of a key", "write it as cable.modulus, cable[2].modulus or platform.start[1]")
    return tuple(Step(match["name"], match["entry"] or "") for match in found if match)


def paths_of(content: Mapping[str, Any], path: str) -> tuple[str, ...]:
    """The path itself, or one for each entry of the list at its ``[*]``."""
    steps = steps_of(path)
    for place, step in enumerate(steps):
        if step.entry == EACH:
            found = _inside(content, steps[:place]).get(step.name)
            if not isinstance(found, list):
                raise KeyPathError(f"{step.name} is no list in the robot file", f"leave [{EACH}] out")
            numbered = [_joined((*steps[:place], Step(step.name, str(i)), *steps[place + 1 :])) for i in _count(found)]
            return tuple(each for one in numbered for each in paths_of(content, one))
    return (path,)


def with_values(content: Mapping[str, Any], values: Mapping[str, float | str]) -> dict[str, Any]:
    """The content with values in place of those at some paths; a path through a list without entry is for all of it.

    Raises KeyPathError where a path leads nowhere.
    """
    changed: dict[str, Any] = deepcopy(dict(content))
    for path, value in values.items():
        _put(changed, steps_of(path), value)
    return changed


def _put(table: dict[str, Any], steps: Sequence[Step], value: float | str) -> None:
    step, rest = steps[0], steps[1:]
    if not rest:
        _put_last(table, step, value)
        return
    inner = table.setdefault(step.name, {})
    tables = inner if isinstance(inner, list) else [inner]
    if step.entry:
        if not isinstance(inner, list):
            raise KeyPathError(f"{step.name} is no list in the robot file", f"leave [{step.entry}] out")
        tables = [_entry(inner, step)]
    for each in tables:
        if not isinstance(each, dict):
            raise KeyPathError(f"{step.name} is no table in the robot file", "name a number of the robot file")
        _put(each, rest, value)


def _put_last(table: dict[str, Any], step: Step, value: float | str) -> None:
    old = table.get(step.name)
    if step.entry:
        if not isinstance(old, list):
            raise KeyPathError(f"{step.name} is no list in the robot file", f"leave [{step.entry}] out")
        _entry(old, step)
        old[int(step.entry) - 1] = value
    elif isinstance(old, list | dict):
        mend = f"name one entry, as in {step.name}[1]" if isinstance(old, list) else "name a key inside it"
        raise KeyPathError(f"{step.name} is no number in the robot file", mend)
    else:
        table[step.name] = value


def _entry(entries: Sequence[Any], step: Step) -> Any:
    if not 1 <= int(step.entry) <= len(entries):
        raise KeyPathError(f"{step.name} has no entry {step.entry}", f"give one from 1 to {len(entries)}")
    return entries[int(step.entry) - 1]


def _inside(content: Mapping[str, Any], steps: Sequence[Step]) -> Mapping[str, Any]:
    found: Any = content
    for step in steps:
        found = found.get(step.name, {}) if isinstance(found, Mapping) else {}
        if step.entry and isinstance(found, list):
            found = _entry(found, step)
    return found if isinstance(found, Mapping) else {}


def _count(entries: Sequence[Any]) -> range:
    return range(1, len(entries) + 1)


def _joined(steps: Sequence[Step]) -> str:
    return ".".join(f"{step.name}[{step.entry}]" if step.entry else step.name for step in steps)
