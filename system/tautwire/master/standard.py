"""What the versions of FMI have in common for the master, and what each calls it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any, Protocol

from fmpy.model_description import ScalarVariable

FMI_WARNING = 1
STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
REALS = ("Real", "Float64")

Log = Callable[[int, bytes], None]
Fail = Callable[[str, str], None]


@dataclass(frozen=True)
class Calls:
    """The names of the functions that the master calls; ``set_up`` is None where a version has no such function."""

    instantiate: str
    set_up: str | None
    enter: str
    leave: str
    read: str
    write: str
    step: str
    save: str
    restore: str
    release: str
    free: str

    def named(self) -> tuple[str, ...]:
        """All names there are."""
        return tuple(name for name in astuple(self) if name is not None)


FMI_2 = Calls(
    "fmi2Instantiate",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2GetReal",
    "fmi2SetReal",
    "fmi2DoStep",
    "fmi2GetFMUstate",
    "fmi2SetFMUstate",
    "fmi2FreeFMUstate",
    "fmi2FreeInstance",
)
FMI_3 = Calls(
    "fmi3InstantiateCoSimulation",
    None,
    "fmi3EnterInitializationMode",
    "fmi3ExitInitializationMode",
    "fmi3GetFloat64",
    "fmi3SetFloat64",
    "fmi3DoStep",
    "fmi3GetFMUState",
    "fmi3SetFMUState",
    "fmi3FreeFMUState",
    "fmi3FreeInstance",
)


@dataclass(frozen=True)
class Functions:
    """What is called in a step, whatever the version: ``handle`` first, then as FMI 2.0 has it; returns a status."""

    handle: Any
    read: Callable[..., int]
    write: Callable[..., int]
    step: Callable[..., int]
    save: Callable[..., int]
    restore: Callable[..., int]
    release: Callable[..., int]


class Instance(Protocol):
    """A loaded FMU, to be instantiated and initialised once; each method raises what fmpy raises.

    ``real`` is the type of its numbers.
    """

    calls: Calls
    real: str

    def instantiate(self, log: Log, fail: Fail) -> Functions:
        """Make the instance: it tells ``log`` status and message, the functions ``fail`` a call and its outcome."""
        ...

    def set_up(self, start: float) -> None:
        """What comes before parameters are set, from the start time (s)."""
        ...

    def enter(self, start: float) -> None:
        """Enter initialization mode."""
        ...

    def leave(self) -> None:
        """Leave initialization mode."""
        ...

    def free(self) -> None:
        """Free the instance and its library."""
        ...


def is_real(variable: ScalarVariable) -> bool:
    """Whether a variable is one number of double precision that may be read and written between any steps."""
    return variable.type in REALS and not variable.dimensions and not variable.clocks


def kind_of(variable: ScalarVariable) -> str:
    """The type of a variable in words, such as ``Float64 array``."""
    return f"{'clocked ' * bool(variable.clocks)}{variable.type}{' array' * bool(variable.dimensions)}"
