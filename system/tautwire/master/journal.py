"""Notes each call of an FMU before it is made, where another process reads it when the call takes this one down."""

from __future__ import annotations

import json
import mmap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import one_line
from .standard import FMI_2, FMI_3
from .wiring import Port

Array = NDArray[np.float64]

UNPACKING = "unpacking"
CALLS = (UNPACKING, *FMI_2.named(), *FMI_3.named())
# What stands where in the mapped memory. A place counts all calls of all components from one; zero is before them.
PLACE, TIME, STEPS, STOPPED = range(4)
NO_CALL = -1.0


@dataclass(frozen=True)
class Entry:
    """The call noted last: of which component, at which time (s), with its inputs and what it had logged by then.

    ``component`` is None where no FMU was being called.
    """

    component: str | None
    call: str
    time: float
    inputs: dict[str, float]
    messages: tuple[str, ...]


class Journal:
    """What a process does with its FMUs, in the files of a ``folder`` that another one may read at any time.

    A note is a write or two into mapped memory, and the inputs of all components live there, so that nothing has to
    be copied: the operating system keeps such memory when the process dies.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._mapped = _mapped(folder / "now", 4)
        self.now = memoryview(self._mapped).cast("d")
        self._components: list[str] = []

    def close(self) -> None:
        """Let the mapped memory go."""
        self.now.release()
        self._mapped.close()

    def enter(self, name: str) -> dict[str, float]:
        """A component that is about to be instantiated; returns the place of each of its calls."""
        first = 1 + len(self._components) * len(CALLS)
        self._components.append(name)
        self._write("components", self._components)
        return {call: float(first + number) for number, call in enumerate(CALLS)}

    def inputs(self, ports: Sequence[Port]) -> Array:
        """Memory for the values of all inputs, shape (number of ports,)."""
        memory = np.frombuffer(_mapped(self._folder / "inputs", max(len(ports), 1)), count=len(ports))
        self._write("ports", [[port.component, port.variable] for port in ports])
        return memory

    def say(self, name: str, messages: Sequence[str]) -> None:
        """What a component has logged lately."""
        self._write(f"messages_{self._components.index(name)}", [one_line(message) for message in messages])

    def rest(self, time: float) -> None:
        """From ``time`` (s) on no FMU is being called."""
        self.now[PLACE], self.now[TIME] = NO_CALL, time

    def stop(self) -> None:
        """Ask the process that calls FMUs to end."""
        self.now[STOPPED] = 1.0

    @property
    def stopped(self) -> bool:
        """Whether the process that calls FMUs is asked to end."""
        return self.now[STOPPED] != 0.0

    @property
    def begun(self) -> bool:
        """Whether any call was noted."""
        return self.now[PLACE] != 0.0

    def mark(self) -> bytes:
        """What is another one after every step, and mostly after every call."""
        return bytes(self.now)

    def last(self) -> Entry:
        """The call noted last."""
        time, place = self.now[TIME], self.now[PLACE]
        if place <= 0.0:
            return Entry(None, "", time, {}, ())
        number, call = divmod(int(place) - 1, len(CALLS))
        name = self._read("components")[number]
        ports = self._read("ports")
        values = np.fromfile(self._folder / "inputs", count=len(ports)).tolist() if ports else []
        given = {variable: value for (who, variable), value in zip(ports, values, strict=True) if who == name}
        return Entry(name, CALLS[call], time, given, tuple(self._read(f"messages_{number}")))

    def _write(self, what: str, content: list[str] | list[list[str]]) -> None:
        beside = self._folder / "beside"
        beside.write_text(json.dumps(content), encoding="utf-8")
        beside.replace(self._folder / what)

    def _read(self, what: str) -> list:
        place = self._folder / what
        return json.loads(place.read_text(encoding="utf-8")) if place.exists() else []


def _mapped(place: Path, count: int) -> mmap.mmap:
    """A file as memory for numbers that processes share, zeros at first."""
    with place.open("a+b") as file:
        file.truncate(8 * count)
        return mmap.mmap(file.fileno(), 8 * count)
