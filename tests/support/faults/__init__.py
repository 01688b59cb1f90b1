"""A winch with faults, and two of it coupled."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tautwire.cosimulation import (
    CallJournal,
    Connection,
    CouplingGraph,
    JournalledComponent,
    Port,
    Wiring,
    build_coupling_graph,
)
from tests.support.pythonfmu_command import build_by_command

HERE = Path(__file__).parent
NAMES = ("left", "right")
# What environment variables of these names tell the FMU: "name:where:how:time", and a file for process numbers.
FAULT, NUMBERS = "TAUTWIRE_TEST_FAULT", "TAUTWIRE_TEST_NUMBERS"


def build_faulty(folder: Path) -> Path:
    """The FMU of ``faulty.py``."""
    return build_by_command(HERE / "faulty.py", folder / "Faulty.fmu")


@contextmanager
def coupled(path: Path, journal: CallJournal) -> Iterator[CouplingGraph]:
    """Two of the FMU: ``left`` is driven, and ``right`` is asked for what it shows."""
    with ExitStack() as stack:
        components = {name: stack.enter_context(JournalledComponent(journal, name, path)) for name in NAMES}
        for component in components.values():
            component.initialize(0.0, {})
        connections = (Connection(Port("left", "winch_speed"), Port("right", "speed_command")),)
        external_inputs = (Port("left", "speed_command"), Port("left", "speed_command_rate"))
        yield build_coupling_graph(components, Wiring(connections=connections, external_inputs=external_inputs))
