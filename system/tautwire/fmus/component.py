"""A co-simulation FMU instance, called through preallocated arrays."""

from __future__ import annotations

import ctypes
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription, ScalarVariable
from numpy.typing import NDArray

from ..errors import TautwireError
from .fmi_binding import FMI_WARNING, STATUS_NAMES, Fmi2Instance, Fmi3Instance, FmuInstance, is_real_scalar
from .fmu_archive import read_model_description, unpack

Array = NDArray[np.float64]

INSTANCE_TYPES: Mapping[str, type[Fmi2Instance] | type[Fmi3Instance]] = {"2.0": Fmi2Instance, "3.0": Fmi3Instance}
MAX_MESSAGES = 20
RECOVERABLE_STATUSES = ("discard", "error")


class ComponentError(TautwireError):
    """An FMU failed; carries which one, in which call, at which time (s), with which inputs, and what it logged."""

    def __init__(
        self,
        component: str,
        call: str,
        status: str,
        time: float,
        inputs: dict[str, float],
        messages: Sequence[str],
    ) -> None:
        self.component = component
        self.call = call
        self.status = status
        self.time = time
        self.inputs = inputs
        self.messages = tuple(messages)
        logged = f"; it logged: {' | '.join(messages[-3:])}" if messages else ""
        input_values = ", ".join(f"{name}={value:.6g}" for name, value in inputs.items())
        context = f"at {time:.6g} s" + (f" with {input_values}" if input_values else "")
        super().__init__(f"FMU {component}: {call} {self.outcome} {context}{logged}")

    @property
    def outcome(self) -> str:
        """The outcome of the call, in words."""
        return f"gave '{self.status}'"

    @property
    def is_recoverable(self) -> bool:
        """Whether the standard allows a rollback to a saved state after this status."""
        return self.status in RECOVERABLE_STATUSES


@dataclass(frozen=True)
class VariableBlock:
    """Real variables of one FMU with the buffer that they are read into or written from, shape (n,).

    ``arguments`` are value references, count and buffer as the FMU's functions take them.
    """

    names: tuple[str, ...]
    values: Array
    arguments: tuple[Any, ...]

    @property
    def count(self) -> int:
        """Number of variables."""
        return len(self.names)


class Component:
    """An FMU instance: extracted, loaded, and freed again on leaving its ``with`` block.

    Raises ArchiveError where the FMU is not a valid archive, ComponentError where it cannot be instantiated or any of
    its calls fails.
    """

    def __init__(self, name: str, path: Path) -> None:
        self.name = name
        self.path = path
        self.time = 0.0
        self.messages: list[str] = []
        self.description: ModelDescription = read_model_description(path)
        version = self.description.fmiVersion
        if version not in INSTANCE_TYPES:
            raise ComponentError(name, "reading its version", f"FMI {version}", 0.0, {}, ())
        self._instance_type = INSTANCE_TYPES[version]
        self._call_names = self._instance_type.call_names
        self.variables: dict[str, ScalarVariable] = {v.name: v for v in self.description.modelVariables}
        self.supports_rollback = bool(self.description.coSimulation.canGetAndSetFMUstate)
        self.supports_variable_step = bool(self.description.coSimulation.canHandleVariableCommunicationStepSize)
        self.folder = tempfile.mkdtemp(prefix="tautwire-fmu-")
        try:
            unpack(path, Path(self.folder))
            self._load()
        except Exception:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise

    def _load(self) -> None:
        working_directory = os.getcwd()
        try:
            self._instance: FmuInstance = self._instance_type(
                guid=self.description.guid,
                unzipDirectory=self.folder,
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                instanceName=self.name,
            )
        except Exception as error:
            # fmpy changes into the library's folder to load it, and stays there where that fails.
            os.chdir(working_directory)
            raise ComponentError(self.name, "loading its library", str(error), 0.0, {}, ()) from error
        try:
            functions = self._instance.instantiate(self._log, self._raise_error)
        except Exception as error:
            raise ComponentError(self.name, self._call_names.instantiate, str(error), 0.0, {}, self.messages) from error
        self._handle = functions.handle
        self._get, self._set, self._step = functions.read, functions.write, functions.step
        self._save, self._restore, self._release = functions.save, functions.restore, functions.release

    def __enter__(self) -> Component:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the instance and the folder into which the FMU was extracted."""
        self._instance.free()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _log(self, status: int, message: bytes) -> None:
        if status >= FMI_WARNING:
            self.messages.append(" ".join(message.decode("utf-8", "replace").split()))
            del self.messages[:-MAX_MESSAGES]

    def block(self, names: Sequence[str], values: Array | None = None) -> VariableBlock:
        """A block of variables by name, over the contiguous buffer ``values``, or over a new one."""
        references = [self.variables[name].valueReference for name in names]
        values = np.zeros(len(names)) if values is None else values
        reference_array = ctypes.cast((ctypes.c_uint * len(names))(*references), ctypes.c_void_p)
        return VariableBlock(
            tuple(names), values, (reference_array, ctypes.c_size_t(len(names)), values.ctypes.data_as(ctypes.c_void_p))
        )

    def initialize(
        self, start: float, parameters: Mapping[str, float], relative_tolerance: float | None = None
    ) -> None:
        """Set parameters and enter initialization mode.

        ``relative_tolerance`` is that of the FMU's own integration; None leaves it to the FMU.
        """
        self.time = start
        experiment = {"start": start, "relative_tolerance": relative_tolerance}
        if self._call_names.setup_experiment is not None:
            self._call(self._call_names.setup_experiment, self._instance.setup_experiment, **experiment)
        for name, value in parameters.items():
            block = self.block([name])
            block.values[0] = value
            self.write(block)
        self._call(self._call_names.enter_initialization, self._instance.enter_initialization, **experiment)

    def run(self) -> None:
        """Leave initialization mode."""
        self._call(self._call_names.exit_initialization, self._instance.exit_initialization)

    def _call(self, call: str, function: Callable[..., Any], **arguments: Any) -> None:
        """Make a call whose status fmpy checks; these are made once a run."""
        try:
            function(**arguments)
        except FMICallException as error:
            self._fail(call, error.status)

    def read(self, block: VariableBlock) -> None:
        """Read variables into the block's values."""
        status = self._get(self._handle, *block.arguments)
        if status > FMI_WARNING:
            self._fail(self._call_names.read, status)

    def write(self, block: VariableBlock) -> None:
        """Write the block's values."""
        status = self._set(self._handle, *block.arguments)
        if status > FMI_WARNING:
            self._fail(self._call_names.write, status)

    def step(self, time: float, step: float) -> None:
        """One macro step."""
        self.time = time
        status = self._step(self._handle, time, step, 0)
        if status > FMI_WARNING:
            self._fail(self._call_names.step, status)

    def save(self) -> ctypes.c_void_p:
        """Save the FMU state; it has to be freed with :meth:`release`."""
        saved = ctypes.c_void_p()
        status = self._save(self._handle, ctypes.byref(saved))
        if status > FMI_WARNING:
            self._fail(self._call_names.save, status)
        return saved

    def restore(self, saved: ctypes.c_void_p) -> None:
        """Roll back to a saved FMU state."""
        status = self._restore(self._handle, saved)
        if status > FMI_WARNING:
            self._fail(self._call_names.restore, status)

    def release(self, saved: ctypes.c_void_p) -> None:
        """Free a saved FMU state."""
        self._release(self._handle, ctypes.byref(saved))

    def raise_not_finite(self, block: VariableBlock) -> None:
        """Raise ComponentError for values that are not finite."""
        values = ", ".join(f"{n}={v}" for n, v in zip(block.names, block.values, strict=True) if not np.isfinite(v))
        raise ComponentError(
            self.name, f"output {values}", "not finite", self.time, self._input_values(), self.messages
        )

    def _fail(self, call: str, status: int) -> None:
        self._raise_error(
            call, STATUS_NAMES[min(status, 5)], call != self._call_names.read and status < STATUS_NAMES.index("fatal")
        )

    def _raise_error(self, call: str, outcome: str, can_read_inputs: bool = True) -> None:
        inputs = self._input_values() if can_read_inputs else {}
        raise ComponentError(self.name, call, outcome, self.time, inputs, self.messages)

    def _input_values(self) -> dict[str, float]:
        block = self.block([v.name for v in self.variables.values() if v.causality == "input" and is_real_scalar(v)])
        if self._get(self._handle, *block.arguments) > FMI_WARNING:
            return {}
        return dict(zip(block.names, block.values.tolist(), strict=True))
