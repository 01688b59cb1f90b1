"""A component whose calls are noted in the call journal before they are made."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .component import Component, VariableBlock
from .journal import CALL_INDEX, CALL_TIME, STEP_COUNT, UNPACKING, CallJournal
from .standard import FMI_WARNING


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

    def initialize(self, start: float, parameters: dict[str, float]) -> None:
        """See :meth:`Component.initialize`."""
        self._journal_state[CALL_TIME] = start
        super().initialize(start, parameters)

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
