"""An FMI 3.0 co-simulation FMU instance without event mode: it handles its events within its steps."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from fmpy.fmi3 import FMU3Slave

from .standard import FMI_3, FMI_WARNING, Fail, Log, StepFunctions


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

    def setup_experiment(self, start: float) -> None:
        """Nothing: FMI 3.0 takes the start time with initialization mode."""

    def enter_initialization(self, start: float) -> None:
        """See :meth:`FmuInstance.enter_initialization`."""
        self._slave.enterInitializationMode(startTime=start)

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
