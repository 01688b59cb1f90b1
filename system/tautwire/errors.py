"""What Tautwire raises on purpose; each error carries its values, and its text is one line."""

from collections.abc import Sequence
from typing import NoReturn


class TautwireError(Exception):
    """Any error that Tautwire raises on purpose; it may be pickled, whatever its constructor takes."""

    def __reduce__(self) -> tuple[object, ...]:
        return _revived, (type(self), self.args, vars(self))


def _revived(kind: type[TautwireError], arguments: tuple[object, ...], values: dict[str, object]) -> TautwireError:
    error = kind.__new__(kind, *arguments)
    vars(error).update(values)
    return error


class InputError(TautwireError):
    """The input is wrong, and whoever wrote it can mend it.

    ``where`` names the file and the line or key (``hall.toml: cable[2].modulus``), ``problem`` the offending
    value and its bound, ``mend`` what to write instead. The text is the one line ``where: problem; mend``.
    """

    def __init__(self, where: str, problem: str, mend: str) -> None:
        super().__init__(where, problem, mend)
        self.where = where
        self.problem = problem
        self.mend = mend

    def __str__(self) -> str:
        return one_line(f"{self.where}: {self.problem}; {self.mend}")


class ArgumentError(InputError):
    """A function of the library was given what it cannot work with.

    ``where`` names the function and its argument (``cosimulate: step``); ``value`` is what it was given.
    """

    def __init__(self, where: str, value: object, problem: str, mend: str) -> None:
        super().__init__(where, problem, mend)
        self.value = value


class RobotFileError(InputError):
    """A robot file that cannot be read or declares something impossible.

    ``place`` leads to what is wrong: keys and, from 0, places in lists; empty where it is the whole file. ``line``,
    from 1, is known of what is not even TOML.
    """

    def __init__(
        self, where: str, problem: str, mend: str, place: tuple[str | int, ...] = (), line: int | None = None
    ) -> None:
        super().__init__(where, problem, mend)
        self.place = place
        self.line = line


class RecordingError(InputError):
    """A recording that cannot be read or does not fit the robot; ``line``, from 1, or the row of a binary file."""

    def __init__(self, where: str, problem: str, mend: str, line: int | None = None) -> None:
        super().__init__(where, problem, mend)
        self.line = line


class MaterialTableError(InputError):
    """A table of a dynamic test that cannot be read or declares something impossible."""


class UnreachableError(InputError):
    """A position where cables that only pull cannot hold the platform.

    ``position`` in m; ``cable``, from 1, is the one that fails first, and ``tension``, in N, what it would
    need there; both None where no single cable is to blame. ``reason`` says why in a few words.
    """

    def __init__(
        self,
        where: str,
        position: Sequence[float],
        cable: int | None,
        tension: float | None,
        reason: str = "a cable cannot push",
        mend: str = "choose a position that the cables can hold, below and between the anchors",
    ) -> None:
        place = ", ".join(f"{coordinate:g}" for coordinate in position)
        need = "" if cable is None or tension is None else f", cable {cable} would need {tension:.6g} N"
        super().__init__(where, f"the platform cannot be held at [{place}] m: {reason}{need}", mend)
        self.position = tuple(position)
        self.cable = cable
        self.tension = tension
        self.reason = reason


class DiskFullError(TautwireError):
    """There was no room to write ``target``; ``reason`` is the system's, ``temporary`` the temporary folder."""

    def __init__(self, target: str, reason: str, temporary: str) -> None:
        mend = f"make room there or in {temporary}, or choose another --out"
        super().__init__(one_line(f"{target}: was not written, the disk refuses more ({reason}); {mend}"))
        self.target = target
        self.reason = reason
        self.temporary = temporary


def at_once(error: InputError) -> NoReturn:
    """What readers do with an error unless they are told otherwise: raise it."""
    raise error


def one_line(text: str) -> str:
    """The text with line breaks and other unprintable characters written as escapes."""
    return "".join(character if character.isprintable() else ascii(character)[1:-1] for character in text)


def shown(value: object, longest: int = 60) -> str:
    """A value from a file as an error message shows it: one line of at most about ``longest`` characters."""
    if isinstance(value, int) and value.bit_length() > 1000:
        return f"a whole number of {value.bit_length()} bits"
    if isinstance(value, str):
        text = repr(value[: longest + 1])
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, dict):
        text = f"a table of {len(value)} keys"
    elif isinstance(value, list):
        text = f"a list of {len(value)}"
    else:
        text = str(value)
    return text if len(text) <= longest else f"{text[:longest]}..."


def described(value: object) -> str:
    """A value that a program handed over as an error message shows it: a text or number itself, others by class."""
    if value is None or isinstance(value, str | int | float):
        return shown(value)
    return f"the class {value.__name__}" if isinstance(value, type) else with_article(type(value).__name__)


def with_article(name: str) -> str:
    """A name as in ``a Robot``, ``an array``."""
    return f"{'an' if name[:1].lower() in 'aeio' else 'a'} {name}"
