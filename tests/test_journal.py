"""Notes of one journal as another one reads them."""

from pathlib import Path

import fmpy
import numpy as np
import pytest

from tautwire.fmus.packaging import RobotFmus
from tautwire.master import Component, Journal, Port, WatchedComponent
from tautwire.master.journal import PLACE, TIME, Entry
from tautwire.runs.cosimulation import instantiated

PORTS = [Port("left", "push"), Port("right", "push"), Port("right", "pull")]


def test_nothing_is_noted_at_first(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    assert not journal.begun
    assert journal.last() == Entry(None, "", 0.0, {}, ())


def test_a_note_is_read_with_inputs_and_messages_of_its_component(tmp_path: Path) -> None:
    journal, reader = Journal(tmp_path), Journal(tmp_path)
    journal.enter("left")
    places = journal.enter("right")
    journal.now[PLACE] = places["fmi2SetReal"]
    assert reader.last() == Entry("right", "fmi2SetReal", 0.0, {}, ())
    journal.inputs(PORTS)[:] = [1.0, 2.0, 3.0]
    journal.say("right", ["one", "two\nlines"])
    journal.say("left", ["other"])
    journal.now[TIME] = 0.5
    assert reader.last() == Entry("right", "fmi2SetReal", 0.5, {"push": 2.0, "pull": 3.0}, ("one", "two\\nlines"))
    journal.rest(0.75)
    assert reader.begun
    assert reader.last() == Entry(None, "", 0.75, {}, ())


def test_the_process_that_reads_can_stop_the_one_that_writes(tmp_path: Path) -> None:
    journal, reader = Journal(tmp_path), Journal(tmp_path)
    assert not journal.stopped
    reader.stop()
    assert journal.stopped


def test_a_system_may_have_no_inputs(tmp_path: Path) -> None:
    assert Journal(tmp_path).inputs([]).shape == (0,)


def test_a_closed_journal_lets_its_file_go(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.close()
    with pytest.raises(ValueError, match="released"):
        journal.stop()


@pytest.mark.parametrize(
    ("method", "call"),
    [
        ("read", "fmi2GetReal"),
        ("write", "fmi2SetReal"),
        ("step", "fmi2DoStep"),
        ("save", "fmi2GetFMUstate"),
        ("restore", "fmi2SetFMUstate"),
        ("release", "fmi2FreeFMUstate"),
        ("run", "fmi2ExitInitializationMode"),
        ("close", "fmi2FreeInstance"),
    ],
)
def test_every_call_is_noted_before_it_is_made(
    three_fmus: RobotFmus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str, call: str
) -> None:
    seen: list[Entry] = []
    journal, reader = Journal(tmp_path), Journal(tmp_path)
    with instantiated(three_fmus, journal) as coupling:
        component = coupling.components["cable_2"]
        block, saved = component.block(["tension"]), component.save()
        arguments = {"read": [block], "write": [block], "step": [0.25, 0.01], "restore": [saved], "release": [saved]}
        with monkeypatch.context() as patched:
            patched.setattr(
                Component, "_call" if method == "run" else method, lambda *given, **named: seen.append(reader.last())
            )
            getattr(component, method)(*arguments.get(method, []))
    assert seen[0].component == "cable_2"
    assert seen[0].call == call
    assert seen[0].time == (0.25 if method == "step" else 0.0)
    assert np.isfinite(list(seen[0].inputs.values())).all() and "position.x" in seen[0].inputs


def test_unpacking_is_noted_as_such(three_fmus: RobotFmus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class StoppedError(Exception):
        pass

    def stop(path: str, folder: str) -> str:
        raise StoppedError

    monkeypatch.setattr(fmpy, "extract", stop)
    with pytest.raises(StoppedError):
        WatchedComponent(Journal(tmp_path), "left", three_fmus.platform)
    assert Journal(tmp_path).last() == Entry("left", "unpacking", 0.0, {}, ())


def test_no_method_that_calls_the_fmu_is_forgotten() -> None:
    methods = {name for name, value in vars(Component).items() if callable(value) and not name.startswith("_")}
    assert methods - {"block", "refuse", "run"} == methods & set(vars(WatchedComponent))
