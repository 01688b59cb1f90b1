"""Journal of FMU calls in shared memory, written before each call, for a watchdog in another process."""

from __future__ import annotations

import ctypes
import json
import mmap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import one_line
from ..fmus.component import Component, VariableBlock
from ..fmus.fmi_binding import FMI_2, FMI_3, FMI_WARNING
from ..fmus.fmu_variables import Port

Array = NDArray[np.float64]

UNPACKING = "unpacking"
CALL_NAMES = (UNPACKING, *FMI_2.all_names(), *FMI_3.all_names())
# Layout of the mapped memory. A call index counts all calls of all components from one; zero is before them.
CALL_INDEX, CALL_TIME, STEP_COUNT, STOP_REQUESTED = range(4)
IDLE = -1.0


@dataclass(frozen=True)
class CallEntry:
    """The last call noted: its component, time (s), inputs, and what the component had logged by then.

    ``component`` is None where no FMU was being called.
    """

    component: str | None
    call: str
    time: float
    inputs: dict[str, float]
    messages: tuple[str, ...]


class CallJournal:
    """A call journal in files of a ``folder``, which another process may read at any time.

    A note is a write or two into mapped memory, and the inputs of all components live there, so that nothing has to
    be copied: the operating system keeps such memory when the process dies.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._memory_map = _map_numbers(folder / "now", 4)
        self.state = memoryview(self._memory_map).cast("d")
        self._component_names: list[str] = []

    def close(self) -> None:
        """Unmap the memory."""
        self.state.release()
        self._memory_map.close()

    def register(self, name: str) -> dict[str, float]:
        """Register a component before it is instantiated; returns the index of each of its calls."""
        first_index = 1 + len(self._component_names) * len(CALL_NAMES)
        self._component_names.append(name)
        self._write("components", self._component_names)
        return {call: float(first_index + number) for number, call in enumerate(CALL_NAMES)}

    def allocate_inputs(self, ports: Sequence[Port]) -> Array:
        """Mapped memory for the values of all inputs, shape (number of ports,)."""
        memory = np.frombuffer(_map_numbers(self._folder / "inputs", max(len(ports), 1)), count=len(ports))
        self._write("ports", [[port.component, port.variable] for port in ports])
        return memory

    def write_messages(self, name: str, messages: Sequence[str]) -> None:
        """Write the latest log messages of a component."""
        self._write(f"messages_{self._component_names.index(name)}", [one_line(message) for message in messages])

    def mark_idle(self, time: float) -> None:
        """Note that from ``time`` (s) on no FMU is being called."""
        self.state[CALL_INDEX], self.state[CALL_TIME] = IDLE, time

    def request_stop(self) -> None:
        """Ask the worker process to end."""
        self.state[STOP_REQUESTED] = 1.0

    @property
    def stop_requested(self) -> bool:
        """Whether the worker process is asked to end."""
        return self.state[STOP_REQUESTED] != 0.0

    @property
    def has_entries(self) -> bool:
        """Whether any call was noted."""
        return self.state[CALL_INDEX] != 0.0

    def snapshot(self) -> bytes:
        """A snapshot of the state, which differs after every step, and mostly after every call."""
        return bytes(self.state)

    def last_entry(self) -> CallEntry:
        """The last call noted."""
        time, call_index = self.state[CALL_TIME], self.state[CALL_INDEX]
        if call_index <= 0.0:
            return CallEntry(None, "", time, {}, ())
        number, call = divmod(int(call_index) - 1, len(CALL_NAMES))
        name = self._read("components")[number]
        ports = self._read("ports")
        values = np.fromfile(self._folder / "inputs", count=len(ports)).tolist() if ports else []
        inputs = {
            variable: value for (component, variable), value in zip(ports, values, strict=True) if component == name
        }
        return CallEntry(name, CALL_NAMES[call], time, inputs, tuple(self._read(f"messages_{number}")))

    def _write(self, name: str, content: list[str] | list[list[str]]) -> None:
        temporary_path = self._folder / "beside"
        temporary_path.write_text(json.dumps(content), encoding="utf-8")
        temporary_path.replace(self._folder / name)

    def _read(self, name: str) -> list:
        path = self._folder / name
        return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _map_numbers(path: Path, count: int) -> mmap.mmap:
    """A file mapped as shared memory for numbers, zeros at first."""
    with path.open("a+b") as file:
        file.truncate(8 * count)
        return mmap.mmap(file.fileno(), 8 * count)


class JournalledComponent(Component):
    """A :class:`Component` that notes each call in a journal, which then names a call that did not return."""

    # The calls of a step name their base class: ``super()`` would cost twice what the note does.

    def __init__(self, journal: CallJournal, name: str, path: Path) -> None:
        self._journal = journal
        self._journal_state = journal.state
        self._call_indices = journal.register(name)
        self._journal_state[CALL_INDEX] = self._call_indices[UNPACKING]
        super().__init__(name, path)

    def _load(self) -> None:
        call_indices, call_names = self._call_indices, self._call_names
        self._read_index, self._write_index, self._step_index = (
            call_indices[call_names.read],
            call_indices[call_names.write],
            call_indices[call_names.step],
        )
        self._save_index, self._restore_index, self._release_index = (
            call_indices[call] for call in (call_names.save, call_names.restore, call_names.release)
        )
        self._journal_state[CALL_INDEX] = call_indices[call_names.instantiate]
        super()._load()

    def _call(self, call: str, function: Callable[..., Any], **arguments: Any) -> None:
        self._journal_state[CALL_INDEX] = self._call_indices[call]
        super()._call(call, function, **arguments)

    def _log(self, status: int, message: bytes) -> None:
        super()._log(status, message)
        if status >= FMI_WARNING:
            self._journal.write_messages(self.name, self.messages)

    def initialize(
        self, start: float, parameters: Mapping[str, float], relative_tolerance: float | None = None
    ) -> None:
        """See :meth:`Component.initialize`."""
        self._journal_state[CALL_TIME] = start
        super().initialize(start, parameters, relative_tolerance)

    def read(self, block: VariableBlock) -> None:
        """See :meth:`Component.read`."""
        self._journal_state[CALL_INDEX] = self._read_index
        Component.read(self, block)

    def write(self, block: VariableBlock) -> None:
        """See :meth:`Component.write`."""
        self._journal_state[CALL_INDEX] = self._write_index
        Component.write(self, block)

    def step(self, time: float, step: float) -> None:
        """See :meth:`Component.step`."""
        journal_state = self._journal_state
        journal_state[CALL_INDEX], journal_state[CALL_TIME] = self._step_index, time
        journal_state[STEP_COUNT] += 1.0
        Component.step(self, time, step)

    def save(self) -> ctypes.c_void_p:
        """See :meth:`Component.save`."""
        self._journal_state[CALL_INDEX] = self._save_index
        return Component.save(self)

    def restore(self, saved: ctypes.c_void_p) -> None:
        """See :meth:`Component.restore`."""
        self._journal_state[CALL_INDEX] = self._restore_index
        Component.restore(self, saved)

    def release(self, saved: ctypes.c_void_p) -> None:
        """See :meth:`Component.release`."""
        self._journal_state[CALL_INDEX] = self._release_index
        Component.release(self, saved)

    def close(self) -> None:
        """See :meth:`Component.close`."""
        self._journal_state[CALL_INDEX] = self._call_indices[self._call_names.free]
        super().close()
        self._journal.mark_idle(self.time)
