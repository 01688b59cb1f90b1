"""An instance of an FMI 3.0 co-simulation FMU, without event mode: it handles its events within its steps."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from fmpy.fmi3 import FMU3Slave

from .standard import FMI_3, FMI_WARNING, Fail, Functions, Log


class Fmi3Instance:
    """See :class:`tautwire.master.standard.Instance`."""

    calls = FMI_3
    real = "Float64"

    def __init__(self, **arguments: Any) -> None:
        self._slave = FMU3Slave(**arguments)

    def instantiate(self, log: Log, fail: Fail) -> Functions:
        """See :meth:`tautwire.master.standard.Instance.instantiate`."""

        def tell(environment: Any, status: int, category: bytes, message: bytes) -> None:
            log(status, message)

        self._slave.instantiate(loggingOn=True, logMessage=tell)
        library = self._slave.dll
        return Functions(
            ctypes.c_void_p(self._slave.component),
            _scalars(library.fmi3GetFloat64),
            _scalars(library.fmi3SetFloat64),
            _whole_step(library.fmi3DoStep, fail),
            library.fmi3GetFMUState,
            library.fmi3SetFMUState,
            library.fmi3FreeFMUState,
        )

    def set_up(self, start: float) -> None:
        """Nothing: FMI 3.0 takes the start time with initialization mode."""

    def enter(self, start: float) -> None:
        """See :meth:`tautwire.master.standard.Instance.enter`."""
        self._slave.enterInitializationMode(startTime=start)

    def leave(self) -> None:
        """See :meth:`tautwire.master.standard.Instance.leave`."""
        self._slave.exitInitializationMode()

    def free(self) -> None:
        """See :meth:`tautwire.master.standard.Instance.free`."""
        self._slave.freeInstance()


def _scalars(function: Callable[..., int]) -> Callable[..., int]:
    """Reads or writes variables of one value each."""
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


def _whole_step(do_step: Callable[..., int], fail: Fail) -> Callable[..., int]:
    """Steps that end where they are to end, or fail in words."""
    event, end, early, reached = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool(), ctypes.c_double()
    told = [ctypes.byref(value) for value in (event, end, early, reached)]

    def step(handle: Any, time: float, length: float, keep: int) -> int:
        status = do_step(handle, time, length, keep, *told)
        if status <= FMI_WARNING and (event.value or end.value or early.value):
            if end.value:
                fail(FMI_3.step, f"a request to end the run at {reached.value:.6g} s")
            if early.value:
                fail(FMI_3.step, f"an early return at {reached.value:.6g} s, which it was not allowed")
            fail(FMI_3.step, "an event for the master to handle, though it was told to handle its own")
        return status

    return step
