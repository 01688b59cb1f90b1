"""What the library's own functions take: single values, checked where a program hands them in."""

from __future__ import annotations

import math
from numbers import Integral, Real
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import TypeVar

from .errors import ArgumentError, described, shown, with_article
from .input_file import path_of
from .robots.checked_table import NumberRule
from .robots.robot import Robot

Kind = TypeVar("Kind")


def of_kind(where: str, value: object, kind: type[Kind], mend: str) -> Kind:
    """The value if it is of a class; raises ArgumentError."""
    if isinstance(value, kind):
        return value
    raise ArgumentError(where, value, f"is {described(value)}, must be {with_article(kind.__name__)}", mend)


def robot_of(where: str, value: object) -> Robot:
    """The value if it is a robot; raises ArgumentError."""
    return of_kind(where, value, Robot, "give what read_robot returns")


def having(where: str, value: Kind, names: tuple[str, ...], wanted: str, mend: str) -> Kind:
    """The value if it has all these attributes, as a protocol asks; ``wanted`` is what it should be.

    Raises ArgumentError.
    """
    # A class has the names of its instances, and is none.
    lacking = [name for name in names if isinstance(value, type) or not hasattr(value, name)]
    if lacking:
        problem = f"is {described(value)}, which is no {wanted}: it has no {', '.join(lacking)}"
        raise ArgumentError(where, value, problem, mend)
    return value


def callable_or_none(where: str, value: Kind) -> Kind:
    """The value if it can be called, or None; raises ArgumentError."""
    if value is None or callable(value):
        return value
    raise ArgumentError(where, value, f"is {described(value)}, cannot be called", "give a function, or leave it out")


def folder_of(where: str, value: object) -> Path:
    """The path of a folder, which need not be there; raises ArgumentError where something else is, or none can be."""
    folder = path_of(where, value)
    mode = _mode_of(where, value, folder, "name a folder")
    if mode is not None and not S_ISDIR(mode):
        raise ArgumentError(where, value, f"is {shown(str(folder))}, which is no folder", "name a folder")
    return folder


def file_of(where: str, value: object) -> Path:
    """The path of a file that is there; raises ArgumentError."""
    file = path_of(where, value)
    mode = _mode_of(where, value, file, "check the path")
    if mode is None or not S_ISREG(mode):
        raise ArgumentError(where, value, f"is {shown(str(file))}, where no file is", "check the path")
    return file


def _mode_of(where: str, value: object, path: Path, mend: str) -> int | None:
    """What kind of thing a path leads to, as ``os.stat`` tells; None where nothing is there.

    Raises ArgumentError where the system takes no such path: a name in it is too long, or cannot be encoded.
    """
    try:
        return path.stat().st_mode
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or getattr(error, "reason", None) or str(error)
        raise ArgumentError(
            where, value, f"is {shown(str(path))}, which cannot be looked up ({reason})", mend
        ) from error


def number_of(where: str, value: object, rule: NumberRule, or_infinite: bool = False) -> float:
    """The number that keeps a rule; raises ArgumentError. Infinity may pass where it means that there is no bound."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ArgumentError(where, value, f"is {described(value)}, not a number", rule.mend())
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if or_infinite and number == math.inf:
        return number
    if not math.isfinite(number):
        raise ArgumentError(where, value, f"is {shown(number)}, must be finite", rule.mend())
    bound = rule.broken_bound(number)
    if bound is not None:
        raise ArgumentError(where, value, f"is {number!r}, must be {bound}", rule.mend())
    return number


def whole_number_of(where: str, value: object, least: int, mend: str, most: int | None = None) -> int:
    """The whole number from ``least`` to ``most``, where there is such a bound; raises ArgumentError."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ArgumentError(where, value, f"is {described(value)}, not a whole number", mend)
    number = int(value)
    if number < least:
        raise ArgumentError(where, value, f"is {shown(number)}, must be at least {least}", mend)
    if most is not None and number > most:
        raise ArgumentError(where, value, f"is {shown(number)}, must be at most {most}", mend)
    return number
