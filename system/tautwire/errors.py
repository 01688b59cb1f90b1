"""Exceptions that Tautwire raises on purpose; each carries its values, and its text is one line."""

from collections.abc import Sequence
from typing import NoReturn


class TautwireError(Exception):
    """Base class of all exceptions that Tautwire raises on purpose; picklable whatever its constructor takes."""

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild_error, (type(self), self.args, vars(self))


def _rebuild_error(
    error_class: type[TautwireError], arguments: tuple[object, ...], attributes: dict[str, object]
) -> TautwireError:
    error = error_class.__new__(error_class, *arguments)
    vars(error).update(attributes)
    return error


class InputError(TautwireError):
    """The user's input is invalid, and the user can correct it.

    ``where`` names the file and the line or key (``hall.toml: cable[2].modulus``), ``problem`` the offending
    value and its bound, ``hint`` what to write instead. The text is the one line ``where: problem; hint``.
    """

    def __init__(self, where: str, problem: str, hint: str) -> None:
        super().__init__(where, problem, hint)
        self.where = where
        self.problem = problem
        self.hint = hint

    def __str__(self) -> str:
        return one_line(f"{self.where}: {self.problem}; {self.hint}")


class ArgumentError(InputError):
    """An argument of a library function is invalid.

    ``where`` names the function and its argument (``cosimulate: step``); ``value`` is the value passed.
    """

    def __init__(self, where: str, value: object, problem: str, hint: str) -> None:
        super().__init__(where, problem, hint)
        self.value = value


class ToolchainError(TautwireError):
    """FMUs cannot be compiled here: ``problem`` says why, ``hint`` what to do."""

    def __init__(self, problem: str, hint: str) -> None:
        super().__init__(problem, hint)
        self.problem = problem
        self.hint = hint

    def __str__(self) -> str:
        return one_line(f"{self.problem}; {self.hint}")


class RobotFileError(InputError):
    """A robot file cannot be read or declares something impossible.

    ``key_path`` leads to the invalid entry: keys and, from 0, indices of lists; empty where the whole file is invalid.
    ``line``, from 1, is set where the file is not valid TOML.
    """

    def __init__(
        self, where: str, problem: str, hint: str, key_path: tuple[str | int, ...] = (), line: int | None = None
    ) -> None:
        super().__init__(where, problem, hint)
        self.key_path = key_path
        self.line = line


class RecordingError(InputError):
    """A recording cannot be read or does not fit the robot; ``line``, from 1, or the row of a binary file."""

    def __init__(self, where: str, problem: str, hint: str, line: int | None = None) -> None:
        super().__init__(where, problem, hint)
        self.line = line


class AbsentColumnsError(RecordingError):
    """A recording has none of the columns that were declared by the laboratory's names."""


class UnknownColumnsError(RecordingError):
    """A recording has no winch column by a standard name, or a tracker's file no time."""


class NumericalError(TautwireError):
    """A trace has no finite numbers to go on with; carries what linear algebra says of them."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(
            f"the model cannot follow this recording ({reason}): compare the units of the robot file and the recording"
        )


class MaterialTableError(InputError):
    """A table of a dynamic test cannot be read or declares something impossible."""


class UnreachableError(InputError):
    """The platform cannot be held at a position by cables that only pull.

    ``position`` in m; ``cable``, from 1, is the one that fails first, and ``tension``, in N, the tension it would
    need there; both None where no single cable is the cause. ``reason`` says why in a few words.
    """

    def __init__(
        self,
        where: str,
        position: Sequence[float],
        cable: int | None,
        tension: float | None,
        reason: str = "a cable cannot push",
        hint: str = "choose a position that the cables can hold, below and between the anchors",
    ) -> None:
        coordinates = ", ".join(f"{coordinate:g}" for coordinate in position)
        required_tension = "" if cable is None or tension is None else f", cable {cable} would need {tension:.6g} N"
        super().__init__(where, f"the platform cannot be held at [{coordinates}] m: {reason}{required_tension}", hint)
        self.position = tuple(position)
        self.cable = cable
        self.tension = tension
        self.reason = reason


class DiskFullError(TautwireError):
    """No disk space was left to write ``target``; ``reason`` is the system's, ``temporary`` the temporary folder."""

    def __init__(self, target: str, reason: str, temporary: str) -> None:
        hint = f"make room there or in {temporary}, or choose another --out"
        super().__init__(one_line(f"{target}: was not written, no disk space left ({reason}); {hint}"))
        self.target = target
        self.reason = reason
        self.temporary = temporary


def raise_error(error: InputError) -> NoReturn:
    """The default error handler of readers: raises the error."""
    raise error


def one_line(text: str) -> str:
    """Escapes line breaks and other unprintable characters, so that the text is one line."""
    return "".join(character if character.isprintable() else ascii(character)[1:-1] for character in text)


def format_value(value: object, max_length: int = 60) -> str:
    """Formats a value from a file for an error message: one line of at most about ``max_length`` characters."""
    if isinstance(value, int) and value.bit_length() > 1000:
        return f"a whole number of {value.bit_length()} bits"
    if isinstance(value, str):
        text = repr(value[: max_length + 1])
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, dict):
        text = f"a table of {len(value)} keys"
    elif isinstance(value, list):
        text = f"a list of {len(value)}"
    else:
        text = str(value)
    return text if len(text) <= max_length else f"{text[:max_length]}..."


def describe_value(value: object) -> str:
    """Formats an argument for an error message: a text or number by its value, anything else by its class."""
    if value is None or isinstance(value, str | int | float):
        return format_value(value)
    return f"the class {value.__name__}" if isinstance(value, type) else with_article(type(value).__name__)


def with_article(name: str) -> str:
    """The name with its indefinite article, as in ``a Robot``, ``an array``."""
    return f"{'an' if name[:1].lower() in 'aeio' else 'a'} {name}"
