"""A component whose calls are noted before they are made."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .component import Block, Component
from .journal import PLACE, STEPS, TIME, UNPACKING, Journal
from .standard import FMI_WARNING


class WatchedComponent(Component):
    """See :class:`Component`; whoever reads the journal knows which call did not come back."""

    # The calls of a step name their base class: ``super()`` would cost twice what the note does.

    def __init__(self, journal: Journal, name: str, path: Path) -> None:
        self._journal = journal
        self._now = journal.now
        self._places = journal.enter(name)
        self._now[PLACE] = self._places[UNPACKING]
        super().__init__(name, path)

    def _load(self) -> None:
        places, calls = self._places, self._calls
        self._reading, self._writing, self._stepping = places[calls.read], places[calls.write], places[calls.step]
        self._saving, self._restoring, self._releasing = (
            places[call] for call in (calls.save, calls.restore, calls.release)
        )
        self._now[PLACE] = places[calls.instantiate]
        super()._load()

    def _call(self, call: str, function: Callable[..., Any], **arguments: Any) -> None:
        self._now[PLACE] = self._places[call]
        super()._call(call, function, **arguments)

    def _log(self, status: int, message: bytes) -> None:
        super()._log(status, message)
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
        self._now[PLACE] = self._places[self._calls.free]
        super().close()
        self._journal.rest(self.time)
