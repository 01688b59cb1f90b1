"""Validation of arguments that a program passes to the library's functions: numbers, paths, objects."""

from __future__ import annotations

import math
from numbers import Integral, Real
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import NamedTuple, TypeVar

from .errors import ArgumentError, describe_value, format_value, with_article
from .input_files import validate_path

Kind = TypeVar("Kind")

# No quantity of a cable robot is larger, and squares of numbers stay finite.
MAX_MAGNITUDE = 1e15


class NumberRule(NamedTuple):
    """Validity range of a number; ``positive`` excludes zero; ``meaning`` and ``unit`` are for messages."""

    meaning: str
    unit: str
    minimum: float = -MAX_MAGNITUDE
    maximum: float = MAX_MAGNITUDE
    positive: bool = False
    default: float | None = None

    def violated_bound(self, value: float) -> str | None:
        """The bound that a finite number violates, such as ``above 0 kg``; None if it violates none."""
        if self.positive and value <= 0.0:
            return f"above 0{self._unit()}"
        if value < self.minimum:
            return f"at least {self.minimum:g}{self._unit()}"
        return f"at most {self.maximum:g}{self._unit()}" if value > self.maximum else None

    def hint(self) -> str:
        """Hint about what to write."""
        return f"give {self.meaning}" + (f" in{self._unit()}" if self._unit() else "")

    def _unit(self) -> str:
        return f" {self.unit}" if self.unit not in ("", "1") else ""


def validate_instance(where: str, value: object, expected_class: type[Kind], hint: str) -> Kind:
    """Returns the value if it is an instance of ``expected_class``; raises ArgumentError otherwise."""
    if isinstance(value, expected_class):
        return value
    raise ArgumentError(
        where, value, f"is {describe_value(value)}, must be {with_article(expected_class.__name__)}", hint
    )


def validate_attributes(where: str, value: Kind, attribute_names: tuple[str, ...], expected: str, hint: str) -> Kind:
    """Returns the value if it has all attributes of a protocol; ``expected`` names the protocol in messages.

    Raises ArgumentError.
    """
    # A class has its instances' attributes, but is not an instance.
    missing = [name for name in attribute_names if isinstance(value, type) or not hasattr(value, name)]
    if missing:
        problem = f"is {describe_value(value)}, which is no {expected}: it has no {', '.join(missing)}"
        raise ArgumentError(where, value, problem, hint)
    return value


def validate_callable(where: str, value: Kind) -> Kind:
    """Returns the value if it is callable or None; raises ArgumentError otherwise."""
    if value is None or callable(value):
        return value
    raise ArgumentError(where, value, f"is {describe_value(value)}, not a function", "give a function, or leave it out")


def validate_folder(where: str, value: object) -> Path:
    """The path of a folder, which need not exist; raises ArgumentError where it is no folder or cannot be one."""
    folder = validate_path(where, value)
    file_mode = _file_mode_of(where, value, folder, "name a folder")
    if file_mode is not None and not S_ISDIR(file_mode):
        raise ArgumentError(where, value, f"is {format_value(str(folder))}, not a folder", "name a folder")
    return folder


def validate_file(where: str, value: object) -> Path:
    """The path of an existing regular file; raises ArgumentError otherwise."""
    file = validate_path(where, value)
    file_mode = _file_mode_of(where, value, file, "check the path")
    if file_mode is None or not S_ISREG(file_mode):
        raise ArgumentError(where, value, f"is {format_value(str(file))}, but there is no file", "check the path")
    return file


def _file_mode_of(where: str, value: object, path: Path, hint: str) -> int | None:
    """The file mode (``st_mode``) of what a path leads to; None where nothing exists there.

    Raises ArgumentError where the system rejects the path: a name in it is too long, or cannot be encoded.
    """
    try:
        return path.stat().st_mode
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or getattr(error, "reason", None) or str(error)
        raise ArgumentError(
            where, value, f"is {format_value(str(path))}, which cannot be looked up ({reason})", hint
        ) from error


def validate_number(where: str, value: object, rule: NumberRule, allow_infinite: bool = False) -> float:
    """Returns the number as a float if it satisfies a rule; raises ArgumentError otherwise.

    ``allow_infinite`` accepts positive infinity, where it means that there is no bound.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ArgumentError(where, value, f"is {describe_value(value)}, not a number", rule.hint())
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if allow_infinite and number == math.inf:
        return number
    if not math.isfinite(number):
        raise ArgumentError(where, value, f"is {format_value(number)}, must be finite", rule.hint())
    bound = rule.violated_bound(number)
    if bound is not None:
        raise ArgumentError(where, value, f"is {number!r}, must be {bound}", rule.hint())
    return number


def validate_integer(where: str, value: object, minimum: int, hint: str, maximum: int | None = None) -> int:
    """Returns an integer of ``minimum`` to ``maximum`` (None: unbounded); raises ArgumentError otherwise."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ArgumentError(where, value, f"is {describe_value(value)}, not a whole number", hint)
    number = int(value)
    if number < minimum:
        raise ArgumentError(where, value, f"is {format_value(number)}, must be at least {minimum}", hint)
    if maximum is not None and number > maximum:
        raise ArgumentError(where, value, f"is {format_value(number)}, must be at most {maximum}", hint)
    return number
