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

from .standard import FMI_2, Fail, Log, StepFunctions


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

    def setup_experiment(self, start: float) -> None:
        """See :meth:`FmuInstance.setup_experiment`."""
        self._slave.setupExperiment(startTime=start)

    def enter_initialization(self, start: float) -> None:
        """See :meth:`FmuInstance.enter_initialization`."""
        self._slave.enterInitializationMode()

    def exit_initialization(self) -> None:
        """See :meth:`FmuInstance.exit_initialization`."""
        self._slave.exitInitializationMode()

    def free(self) -> None:
        """See :meth:`FmuInstance.free`."""
        self._slave.freeInstance()
