"""An instance of an FMI 2.0 co-simulation FMU."""

from __future__ import annotations

import ctypes
from typing import Any

import fmpy
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

from .standard import FMI_2, Fail, Functions, Log


class Fmi2Instance:
    """See :class:`tautwire.master.standard.Instance`."""

    calls = FMI_2
    real = "Real"

    def __init__(self, **arguments: Any) -> None:
        self._slave = FMU2Slave(**arguments)

    def instantiate(self, log: Log, fail: Fail) -> Functions:
        """See :meth:`tautwire.master.standard.Instance.instantiate`."""

        def tell(environment: Any, instance: bytes, status: int, category: bytes, message: bytes) -> None:
            log(status, message)

        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(tell)
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
        self._slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        library = self._slave.dll
        library.fmi2DoStep.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
        for function in (library.fmi2GetReal, library.fmi2SetReal):
            function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
        return Functions(
            ctypes.c_void_p(self._slave.component),
            library.fmi2GetReal,
            library.fmi2SetReal,
            library.fmi2DoStep,
            library.fmi2GetFMUstate,
            library.fmi2SetFMUstate,
            library.fmi2FreeFMUstate,
        )

    def set_up(self, start: float) -> None:
        """See :meth:`tautwire.master.standard.Instance.set_up`."""
        self._slave.setupExperiment(startTime=start)

    def enter(self, start: float) -> None:
        """See :meth:`tautwire.master.standard.Instance.enter`."""
        self._slave.enterInitializationMode()

    def leave(self) -> None:
        """See :meth:`tautwire.master.standard.Instance.leave`."""
        self._slave.exitInitializationMode()

    def free(self) -> None:
        """See :meth:`tautwire.master.standard.Instance.free`."""
        self._slave.freeInstance()
