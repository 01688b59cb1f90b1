"""A co-simulation FMU in a slot of the master, called through kept arrays."""

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
from .archive import description_of, unpack
from .fmi2 import Fmi2Instance
from .fmi3 import Fmi3Instance
from .standard import FMI_WARNING, STATUS, Instance, is_real

Array = NDArray[np.float64]

INSTANCES: Mapping[str, type[Fmi2Instance] | type[Fmi3Instance]] = {"2.0": Fmi2Instance, "3.0": Fmi3Instance}
KEPT_MESSAGES = 20
RESTORABLE = ("discard", "error")


class ComponentError(TautwireError):
    """An FMU failed; tells which, in which call, at which time (s), with which inputs, and what it logged."""

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
        said = f"; it logged: {' | '.join(messages[-3:])}" if messages else ""
        given = ", ".join(f"{name}={value:.6g}" for name, value in inputs.items())
        at = f"at {time:.6g} s" + (f" with {given}" if given else "")
        super().__init__(f"FMU {component}: {call} {self.outcome} {at}{said}")

    @property
    def outcome(self) -> str:
        """What became of the call, in words."""
        return f"gave '{self.status}'"

    @property
    def can_restore(self) -> bool:
        """Whether the standard lets the FMU go back to a saved state from there, to try a shorter step."""
        return self.status in RESTORABLE


@dataclass(frozen=True)
class Block:
    """Some real variables of one FMU with the memory through which they are read or written; shape (n,).

    ``arguments`` are references, count and memory as the FMU's functions take them.
    """

    names: tuple[str, ...]
    values: Array
    arguments: tuple[Any, ...]

    @property
    def count(self) -> int:
        """Number of variables."""
        return len(self.names)


class Component:
    """An instance of an FMU: extracted, loaded, and freed again on leaving its ``with`` block.

    Raises ArchiveError where the FMU is no sound archive, ComponentError where it cannot be instantiated or any of its
    calls fails.
    """

    def __init__(self, name: str, path: Path) -> None:
        self.name = name
        self.path = path
        self.time = 0.0
        self.messages: list[str] = []
        self.description: ModelDescription = description_of(path)
        version = self.description.fmiVersion
        if version not in INSTANCES:
            raise ComponentError(name, "reading its version", f"FMI {version}", 0.0, {}, ())
        self._kind = INSTANCES[version]
        self._calls = self._kind.calls
        self.variables: dict[str, ScalarVariable] = {v.name: v for v in self.description.modelVariables}
        self.can_restore = bool(self.description.coSimulation.canGetAndSetFMUstate)
        self.takes_any_step = bool(self.description.coSimulation.canHandleVariableCommunicationStepSize)
        self.folder = tempfile.mkdtemp(prefix="tautwire-fmu-")
        try:
            unpack(path, Path(self.folder))
            self._load()
        except Exception:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise

    def _load(self) -> None:
        here = os.getcwd()
        try:
            self._instance: Instance = self._kind(
                guid=self.description.guid,
                unzipDirectory=self.folder,
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                instanceName=self.name,
            )
        except Exception as error:
            # fmpy loads from the library's folder, and stays there where that fails.
            os.chdir(here)
            raise ComponentError(self.name, "loading its library", str(error), 0.0, {}, ()) from error
        try:
            functions = self._instance.instantiate(self._log, self._stop)
        except Exception as error:
            raise ComponentError(self.name, self._calls.instantiate, str(error), 0.0, {}, self.messages) from error
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
            self.messages.append(message.decode("utf-8", "replace"))
            del self.messages[:-KEPT_MESSAGES]

    def block(self, names: Sequence[str], values: Array | None = None) -> Block:
        """Memory for some variables, by name: the contiguous ``values`` handed in, or memory of its own."""
        references = [self.variables[name].valueReference for name in names]
        values = np.zeros(len(names)) if values is None else values
        kept = ctypes.cast((ctypes.c_uint * len(names))(*references), ctypes.c_void_p)
        return Block(tuple(names), values, (kept, ctypes.c_size_t(len(names)), values.ctypes.data_as(ctypes.c_void_p)))

    def initialize(self, start: float, parameters: dict[str, float]) -> None:
        """Set parameters and enter initialization mode."""
        self.time = start
        if self._calls.set_up is not None:
            self._call(self._calls.set_up, self._instance.set_up, start=start)
        for name, value in parameters.items():
            block = self.block([name])
            block.values[0] = value
            self.write(block)
        self._call(self._calls.enter, self._instance.enter, start=start)

    def run(self) -> None:
        """Leave initialization mode."""
        self._call(self._calls.leave, self._instance.leave)

    def _call(self, call: str, function: Callable[..., Any], **arguments: Any) -> None:
        """One of the calls that are made once a run, and whose status fmpy looks at."""
        try:
            function(**arguments)
        except FMICallException as error:
            self._fail(call, error.status)

    def read(self, block: Block) -> None:
        """Read variables into the block's values."""
        status = self._get(self._handle, *block.arguments)
        if status > FMI_WARNING:
            self._fail(self._calls.read, status)

    def write(self, block: Block) -> None:
        """Write the block's values."""
        status = self._set(self._handle, *block.arguments)
        if status > FMI_WARNING:
            self._fail(self._calls.write, status)

    def step(self, time: float, step: float) -> None:
        """One macro step."""
        self.time = time
        status = self._step(self._handle, time, step, 0)
        if status > FMI_WARNING:
            self._fail(self._calls.step, status)

    def save(self) -> ctypes.c_void_p:
        """A copy of the present state, to be let go with :meth:`release`."""
        saved = ctypes.c_void_p()
        status = self._save(self._handle, ctypes.byref(saved))
        if status > FMI_WARNING:
            self._fail(self._calls.save, status)
        return saved

    def restore(self, saved: ctypes.c_void_p) -> None:
        """Go back to a saved state."""
        status = self._restore(self._handle, saved)
        if status > FMI_WARNING:
            self._fail(self._calls.restore, status)

    def release(self, saved: ctypes.c_void_p) -> None:
        """Let a saved state go."""
        self._release(self._handle, ctypes.byref(saved))

    def refuse(self, block: Block) -> None:
        """Raise ComponentError for values that are not finite."""
        shown = ", ".join(f"{n}={v}" for n, v in zip(block.names, block.values, strict=True) if not np.isfinite(v))
        raise ComponentError(self.name, f"output {shown}", "not finite", self.time, self._inputs(), self.messages)

    def _fail(self, call: str, status: int) -> None:
        self._stop(call, STATUS[min(status, 5)], call != self._calls.read and status < STATUS.index("fatal"))

    def _stop(self, call: str, outcome: str, alive: bool = True) -> None:
        inputs = self._inputs() if alive else {}
        raise ComponentError(self.name, call, outcome, self.time, inputs, self.messages)

    def _inputs(self) -> dict[str, float]:
        block = self.block([v.name for v in self.variables.values() if v.causality == "input" and is_real(v)])
        if self._get(self._handle, *block.arguments) > FMI_WARNING:
            return {}
        return dict(zip(block.names, block.values.tolist(), strict=True))
