"""The common interface to FMI 2.0 and FMI 3.0 instances, and the function names of each version."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any, Protocol

from fmpy.model_description import ScalarVariable

FMI_WARNING = 1
STATUS_NAMES = ("ok", "warning", "discard", "error", "fatal", "pending")
REAL_TYPES = ("Real", "Float64")

Log = Callable[[int, bytes], None]
Fail = Callable[[str, str], None]


@dataclass(frozen=True)
class CallNames:
    """The FMI functions that the master calls; ``setup_experiment`` is None where a version has no such function."""

    instantiate: str
    setup_experiment: str | None
    enter_initialization: str
    exit_initialization: str
    read: str
    write: str
    step: str
    save: str
    restore: str
    release: str
    free: str

    def all_names(self) -> tuple[str, ...]:
        """The names of all functions that the version has."""
        return tuple(name for name in astuple(self) if name is not None)


FMI_2 = CallNames(
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
FMI_3 = CallNames(
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
class StepFunctions:
    """The functions called in a step, with FMI 2.0 signatures for either version; each returns a status."""

    handle: Any
    read: Callable[..., int]
    write: Callable[..., int]
    step: Callable[..., int]
    save: Callable[..., int]
    restore: Callable[..., int]
    release: Callable[..., int]


class FmuInstance(Protocol):
    """A loaded FMU, to be instantiated and initialised once; each method raises what fmpy raises.

    ``real`` is the type of its numbers.
    """

    call_names: CallNames
    real_type: str

    def instantiate(self, log: Log, fail: Fail) -> StepFunctions:
        """Instantiate the FMU; ``log`` gets status and message, ``fail`` a call and its outcome."""
        ...

    def setup_experiment(self, start: float) -> None:
        """Set up the experiment from the start time (s), before parameters are set."""
        ...

    def enter_initialization(self, start: float) -> None:
        """Enter initialization mode."""
        ...

    def exit_initialization(self) -> None:
        """Leave initialization mode."""
        ...

    def free(self) -> None:
        """Free the instance and its library."""
        ...


def is_real_scalar(variable: ScalarVariable) -> bool:
    """Whether a variable is a scalar of double precision without clocks."""
    return variable.type in REAL_TYPES and not variable.dimensions and not variable.clocks


def type_name(variable: ScalarVariable) -> str:
    """The type name of a variable, such as ``Float64 array``."""
    return f"{'clocked ' * bool(variable.clocks)}{variable.type}{' array' * bool(variable.dimensions)}"
