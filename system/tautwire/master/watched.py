"""A component whose calls are noted before they are made."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .component import FMI_WARNING, Block, Component
from .journal import PLACE, STEPS, TIME, Journal


class WatchedComponent(Component):
    """See :class:`Component`; whoever reads the journal knows which call did not come back."""

    # The calls of a step name their base class: ``super()`` would cost twice what the note does.

    def __init__(self, journal: Journal, name: str, path: Path) -> None:
        self._journal = journal
        self._now = journal.now
        self._places = places = journal.enter(name)
        self._reading, self._writing, self._stepping = (places[f"fmi2{c}"] for c in ("GetReal", "SetReal", "DoStep"))
        self._saving, self._restoring, self._releasing = (places[f"fmi2{c}FMUstate"] for c in ("Get", "Set", "Free"))
        self._now[PLACE] = places["fmi2Instantiate"]
        super().__init__(name, path)

    def _call(self, call: str, function: Callable[..., Any], **arguments: Any) -> None:
        self._now[PLACE] = self._places[call]
        super()._call(call, function, **arguments)

    def _log(self, environment: Any, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        super()._log(environment, instance, status, category, message)
        if status >= FMI_WARNING:
            self._journal.say(self.name, self.messages)

    def initialize(self, start: float, parameters: dict[str, float]) -> None:
        """See :meth:`Component.initialize`."""
        self._now[TIME] = start
        super().initialize(start, parameters)

    def read(self, block: Block) -> None:
        """See :meth:`Component.read`."""
        self._now[PLACE] = self._reading
        Component.read(self, block)

    def write(self, block: Block) -> None:
        """See :meth:`Component.write`."""
        self._now[PLACE] = self._writing
        Component.write(self, block)

    def step(self, time: float, step: float) -> None:
        """See :meth:`Component.step`."""
        now = self._now
        now[PLACE], now[TIME] = self._stepping, time
        now[STEPS] += 1.0
        Component.step(self, time, step)

    def save(self) -> ctypes.c_void_p:
        """See :meth:`Component.save`."""
        self._now[PLACE] = self._saving
        return Component.save(self)

    def restore(self, saved: ctypes.c_void_p) -> None:
        """See :meth:`Component.restore`."""
        self._now[PLACE] = self._restoring
        Component.restore(self, saved)

    def release(self, saved: ctypes.c_void_p) -> None:
        """See :meth:`Component.release`."""
        self._now[PLACE] = self._releasing
        Component.release(self, saved)

    def close(self) -> None:
        """See :meth:`Component.close`."""
        self._now[PLACE] = self._places["fmi2FreeInstance"]
        super().close()
        self._journal.rest(self.time)
