"""Notes of one journal as another one reads them."""

from pathlib import Path

import fmpy
import numpy as np
import pytest

from tautwire.cosimulation import CallJournal, Component, CouplingSolver, JournalledComponent, Port
from tautwire.cosimulation.call_journal import CALL_INDEX, CALL_TIME, CallEntry
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.fmus.packaging import RobotFmus

PORTS = [Port("left", "push"), Port("right", "push"), Port("right", "pull")]


def test_nothing_is_noted_at_first(tmp_path: Path) -> None:
    journal = CallJournal(tmp_path)
    assert not journal.has_entries
    assert journal.last_entry() == CallEntry(None, "", 0.0, {}, ())


def test_a_note_is_read_with_inputs_and_messages_of_its_component(tmp_path: Path) -> None:
    journal, reader = CallJournal(tmp_path), CallJournal(tmp_path)
    journal.register("left")
    places = journal.register("right")
    journal.state[CALL_INDEX] = places["fmi2SetReal"]
    assert reader.last_entry() == CallEntry("right", "fmi2SetReal", 0.0, {}, ())
    journal.allocate_inputs(PORTS)[:] = [1.0, 2.0, 3.0]
    journal.write_messages("right", ["one", "two\nlines"])
    journal.write_messages("left", ["other"])
    journal.state[CALL_TIME] = 0.5
    assert reader.last_entry() == CallEntry(
        "right", "fmi2SetReal", 0.5, {"push": 2.0, "pull": 3.0}, ("one", "two\\nlines")
    )
    journal.mark_idle(0.75)
    assert reader.has_entries
    assert reader.last_entry() == CallEntry(None, "", 0.75, {}, ())


def test_the_process_that_reads_can_stop_the_one_that_writes(tmp_path: Path) -> None:
    journal, reader = CallJournal(tmp_path), CallJournal(tmp_path)
    assert not journal.stop_requested
    reader.request_stop()
    assert journal.stop_requested


def test_a_system_may_have_no_inputs(tmp_path: Path) -> None:
    assert CallJournal(tmp_path).allocate_inputs([]).shape == (0,)


def test_a_closed_journal_lets_its_file_go(tmp_path: Path) -> None:
    journal = CallJournal(tmp_path)
    journal.close()
    with pytest.raises(ValueError, match="released"):
        journal.request_stop()


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
    seen: list[CallEntry] = []
    journal, reader = CallJournal(tmp_path), CallJournal(tmp_path)
    with instantiate_robot(three_fmus, journal) as graph:
        CouplingSolver(graph, inputs=journal.allocate_inputs(graph.input_ports))
        component = graph.components["cable_2"]
        block, saved = component.block(["tension"]), component.save()
        arguments = {"read": [block], "write": [block], "step": [0.25, 0.01], "restore": [saved], "release": [saved]}
        with monkeypatch.context() as patched:
            patched.setattr(
                Component,
                "_call" if method == "run" else method,
                lambda *given, **named: seen.append(reader.last_entry()),
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
        JournalledComponent(CallJournal(tmp_path), "left", three_fmus.platform)
    assert CallJournal(tmp_path).last_entry() == CallEntry("left", "unpacking", 0.0, {}, ())


def test_no_method_that_calls_the_fmu_is_forgotten() -> None:
    methods = {name for name, value in vars(Component).items() if callable(value) and not name.startswith("_")}
    assert methods - {"block", "raise_not_finite", "run"} == methods & set(vars(JournalledComponent))
