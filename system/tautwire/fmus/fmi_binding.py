"""FMI 2.0 and FMI 3.0 co-simulation instances behind one interface."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any, Protocol

import fmpy
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.fmi3 import FMU3Slave
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

    ``real_type`` is the FMI type of its numbers.
    """

    call_names: CallNames
    real_type: str

    def instantiate(self, log: Log, fail: Fail) -> StepFunctions:
        """Instantiate the FMU; ``log`` gets status and message, ``fail`` a call and its outcome."""
        ...

    def setup_experiment(self, start: float, relative_tolerance: float | None) -> None:
        """Set up the experiment from the start time (s), before parameters are set.

        The tolerance is that of the FMU's own integration; None leaves it to the FMU.
        """
        ...

    def enter_initialization(self, start: float, relative_tolerance: float | None) -> None:
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


class Fmi2Instance:
    """See :class:`FmuInstance`."""

    call_names = FMI_2
    real_type = "Real"

    def __init__(self, **arguments: Any) -> None:
        self._slave = FMU2Slave(**arguments)

    def instantiate(self, log: Log, fail: Fail) -> StepFunctions:
        """See :meth:`FmuInstance.instantiate`."""

        def log_message(environment: Any, instance: bytes, status: int, category: bytes, message: bytes) -> None:
            log(status, message)

        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(log_message)
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
        self._slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        library = self._slave.dll
        library.fmi2DoStep.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
        for function in (library.fmi2GetReal, library.fmi2SetReal):
            function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
        return StepFunctions(
            ctypes.c_void_p(self._slave.component),
            library.fmi2GetReal,
            library.fmi2SetReal,
            library.fmi2DoStep,
            library.fmi2GetFMUstate,
            library.fmi2SetFMUstate,
            library.fmi2FreeFMUstate,
        )

    def setup_experiment(self, start: float, relative_tolerance: float | None) -> None:
        """See :meth:`FmuInstance.setup_experiment`."""
        self._slave.setupExperiment(tolerance=relative_tolerance, startTime=start)

    def enter_initialization(self, start: float, relative_tolerance: float | None) -> None:
        """See :meth:`FmuInstance.enter_initialization`."""
        self._slave.enterInitializationMode()

    def exit_initialization(self) -> None:
        """See :meth:`FmuInstance.exit_initialization`."""
        self._slave.exitInitializationMode()

    def free(self) -> None:
        """See :meth:`FmuInstance.free`."""
        self._slave.freeInstance()


class Fmi3Instance:
    """See :class:`FmuInstance`."""

    call_names = FMI_3
    real_type = "Float64"

    def __init__(self, **arguments: Any) -> None:
        self._slave = FMU3Slave(**arguments)

    def instantiate(self, log: Log, fail: Fail) -> StepFunctions:
        """See :meth:`FmuInstance.instantiate`."""

        def log_message(environment: Any, status: int, category: bytes, message: bytes) -> None:
            log(status, message)

        self._slave.instantiate(loggingOn=True, logMessage=log_message)
        library = self._slave.dll
        return StepFunctions(
            ctypes.c_void_p(self._slave.component),
            _with_value_count(library.fmi3GetFloat64),
            _with_value_count(library.fmi3SetFloat64),
            _complete_step(library.fmi3DoStep, fail),
            library.fmi3GetFMUState,
            library.fmi3SetFMUState,
            library.fmi3FreeFMUState,
        )

    def setup_experiment(self, start: float, relative_tolerance: float | None) -> None:
        """Nothing: FMI 3.0 takes the start time and the tolerance with initialization mode."""

    def enter_initialization(self, start: float, relative_tolerance: float | None) -> None:
        """See :meth:`FmuInstance.enter_initialization`."""
        self._slave.enterInitializationMode(tolerance=relative_tolerance, startTime=start)

    def exit_initialization(self) -> None:
        """See :meth:`FmuInstance.exit_initialization`."""
        self._slave.exitInitializationMode()

    def free(self) -> None:
        """See :meth:`FmuInstance.free`."""
        self._slave.freeInstance()


def _with_value_count(function: Callable[..., int]) -> Callable[..., int]:
    """A get or set function for scalars: as many values as value references."""
    function.argtypes = [  # type: ignore[attr-defined]
        ctypes.c_void_p,
        ctypes.c_void_p,
        ctypes.c_size_t,
        ctypes.c_void_p,
        ctypes.c_size_t,
    ]

    def call(handle: Any, references: Any, count: int, memory: Any) -> int:
        return function(handle, references, count, memory, count)

    return call


def _complete_step(do_step: Callable[..., int], fail: Fail) -> Callable[..., int]:
    """fmi3DoStep that either reaches the end of the step or fails with a reason."""
    event_needed, terminate, early_return, last_time = (
        ctypes.c_bool(),
        ctypes.c_bool(),
        ctypes.c_bool(),
        ctypes.c_double(),
    )
    flags = [ctypes.byref(value) for value in (event_needed, terminate, early_return, last_time)]

    def step(handle: Any, time: float, length: float, keep: int) -> int:
        status = do_step(handle, time, length, keep, *flags)
        if status <= FMI_WARNING and (event_needed.value or terminate.value or early_return.value):
            if terminate.value:
                fail(FMI_3.step, f"a request to end the run at {last_time.value:.6g} s")
            if early_return.value:
                fail(FMI_3.step, f"an early return at {last_time.value:.6g} s, which it was not allowed")
            fail(FMI_3.step, "an event for the master to handle, though it was told to handle its own")
        return status

    return step
