"""Which cases a call means, and which version of the tracer answers them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from fnmatch import fnmatchcase

from tests.support.robots import EXAMPLES

from .cases import Case, empty_cases, main_cases, quick_cases
from .lifelike_cases import ALARM as LIFELIKE_ALARM
from .lifelike_cases import lifelike_cases, lifelike_empty_cases
from .platform_cases import platform_cases

ALARM = "alarm"
MOST_EMPTY = 100_000
# Where the verdict comes from: the tracer, the laws, and what builds and runs them.
FOLDERS = (
    *(f"system/tautwire/{name}" for name in ("estimation", "recordings", "cosimulation", "fmus", "robot")),
    "fmu_src/tautwire_fmu",
)


def alarm_cases(count: int) -> tuple[Case, ...]:
    """Empty recordings that count false alarms."""
    return empty_cases(ALARM, count)


def lifelike_alarm_cases(count: int) -> tuple[Case, ...]:
    """Lifelike recordings with nothing but the little things that count false alarms."""
    return lifelike_empty_cases(LIFELIKE_ALARM, count)


def case_called(key: str) -> Case:
    """The case of a name. Raises KeyError where there is none."""
    if key.startswith(LIFELIKE_ALARM):
        return lifelike_alarm_cases(int(key.removeprefix(LIFELIKE_ALARM)) + 1)[-1]
    if key.startswith(f"{ALARM}-"):
        return alarm_cases(int(key.removeprefix(f"{ALARM}-")) + 1)[-1]
    return {case.key: case for case in (*main_cases(), *quick_cases(), *lifelike_cases(), *platform_cases())}[key]


def chosen(cases: Sequence[Case], only: Sequence[str]) -> tuple[Case, ...]:
    """The cases whose name is one of ``only`` or holds it, where it has no wildcard; all without any."""
    patterns = [text if any(c in text for c in "*?[") else f"*{text}*" for text in only]
    return tuple(case for case in cases if not only or any(fnmatchcase(case.key, pattern) for pattern in patterns))


def code_version() -> str:
    """Of the sources that a verdict depends on; lines of another version are made again."""
    root = EXAMPLES.parents[2]
    content = hashlib.sha256()
    paths = [path for folder in FOLDERS for path in sorted((root / folder).rglob("*.py"))]
    for path in paths:
        content.update(path.relative_to(root).as_posix().encode())
        content.update(path.read_bytes())
    return content.hexdigest()[:16]
