"""FMUs by FMI 3.0 in slots: results and errors as of the same FMUs by FMI 2.0."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from tautwire.cosimulation import CallAbortedError, CallJournal, Component, ComponentError, JournalledComponent
from tautwire.cosimulation.call_journal import CallEntry
from tautwire.cosimulation.direct_feedthrough import direct_feedthrough
from tautwire.cosimulation.robot_cosimulation import CosimulationResult, RunError, cosimulate
from tautwire.cosimulation.ssp_archive import write_ssp
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.schema import UserFmu
from tests.support.own_fmus import LAG, compiler, lag_winch, lag_winch_3, packed_3
from tests.support.robots import paper_robot

needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")
TIMES = np.linspace(0.0, 0.5, 6)
SPEEDS = np.sin(3.0 * TIMES)[:, None] * np.array([0.3, 0.25, -0.25])


@pytest.fixture(scope="module")
def winch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return lag_winch_3(tmp_path_factory.mktemp("winch"))


def moved(winches: dict[int, Path], folder: Path, patience: float | None = None, **chosen: float) -> CosimulationResult:
    """The paper's robot with these winches, by number."""
    robot = replace(paper_robot(), fmus=tuple(UserFmu(f"winch_{number}", path) for number, path in winches.items()))
    return cosimulate(build_fmus(robot, folder), TIMES, SPEEDS, patience=patience, **chosen)


@needs_compiler
def test_the_test_fmu_is_valid(winch: Path) -> None:
    assert validate_fmu(str(winch)) == []


@pytest.mark.validate
@needs_compiler
@pytest.mark.parametrize("chosen", [{"step": 0.01}, {"tolerance": 1e-5}])
def test_the_same_winch_by_either_version_gives_the_same_figures(
    winch: Path, tmp_path: Path, chosen: dict[str, float]
) -> None:
    twin = lag_winch(tmp_path)
    runs = [
        moved(dict.fromkeys((1, 2, 3), path), tmp_path / str(number), **chosen)
        for number, path in enumerate((winch, twin))
    ]
    assert np.max(np.abs(runs[0].winch_speed[1])) > 0.1
    for name in ("position", "velocity", "tension"):
        assert np.array_equal(*(getattr(motion, name) for motion in runs)), name
    assert runs[0].statistics == runs[1].statistics


@pytest.mark.validate
@needs_compiler
def test_both_versions_run_side_by_side_and_isolated(winch: Path, tmp_path: Path) -> None:
    winches = {1: winch, 2: lag_winch(tmp_path)}
    here = moved(winches, tmp_path / "here")
    apart = moved(winches, tmp_path / "apart", patience=60.0)
    assert np.array_equal(here.position, apart.position)
    assert here.statistics.iterations == apart.statistics.iterations > 0
    assert len([line for line in here.statistics.fallback_notes() if line.endswith("FMU winch_1, winch_2")]) == 2


@pytest.mark.validate(but=["ERROR", "EARLY"])
@needs_compiler
@pytest.mark.parametrize(
    ("fault", "outcome", "logged"),
    [
        ("ERROR", "gave 'error'", "; it logged: the drum is stuck"),
        ("EVENT", "gave 'an event for the master to handle, though it was told to handle its own'", ""),
        ("END", "gave 'a request to end the run at 0.11 s'", ""),
        ("EARLY", "gave 'an early return at 0.105 s, which it was not allowed'", ""),
    ],
)
def test_a_step_that_does_not_reach_its_end_is_named_with_time_and_inputs(
    tmp_path: Path, fault: str, outcome: str, logged: str
) -> None:
    with pytest.raises(RunError) as caught:
        moved({2: lag_winch_3(tmp_path, fault)}, tmp_path / "fmus")
    cause = caught.value.cause
    assert (cause.component, cause.call, cause.time) == ("winch_2", "fmi3DoStep", pytest.approx(0.1))
    assert cause.inputs == {"speed_command": pytest.approx(np.interp(0.105, TIMES, SPEEDS[:, 1]))}
    given = f"speed_command={cause.inputs['speed_command']:.6g}"
    assert str(cause) == f"FMU winch_2: fmi3DoStep {outcome} at 0.1 s with {given}{logged}"
    assert caught.value.result.time.tolist() == [0.0, 0.1]


@needs_compiler
def test_one_that_ends_its_process_is_named(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"FMU winch_3: fmi3DoStep ended its process by SIGABRT at 0\.1 s") as caught:
        moved({3: lag_winch_3(tmp_path, "CRASH")}, tmp_path / "fmus", patience=60.0)
    assert isinstance(caught.value.cause, CallAbortedError)


@needs_compiler
def test_parameters_are_set_and_states_restored(winch: Path) -> None:
    with Component("winch", winch) as component:
        component.initialize(2.0, {"lag": 2.0 * LAG})
        component.run()
        asked, shown = component.block(["speed_command"]), component.block(["winch_speed"])
        asked.values[0] = 1.0
        component.write(asked)
        saved = component.save()
        for _ in range(2):
            component.step(2.0, 2.0 * LAG)
            component.read(shown)
            assert shown.values[0] == pytest.approx(1.0 - np.exp(-1.0))
            component.restore(saved)
        component.read(shown)
        assert shown.values[0] == 0.0
        component.release(saved)


@needs_compiler
def test_variables_that_it_does_not_have_are_refused_by_it(winch: Path) -> None:
    with Component("winch", winch) as component:
        component.initialize(0.0, {})
        component.run()
        # The standard's time is none of the winch's own variables.
        with pytest.raises(ComponentError, match="FMU winch: fmi3GetFloat64 gave 'error' at 0 s"):
            component.read(component.block(["time"]))


@needs_compiler
@pytest.mark.parametrize(
    ("method", "call"),
    [
        ("read", "fmi3GetFloat64"),
        ("write", "fmi3SetFloat64"),
        ("step", "fmi3DoStep"),
        ("save", "fmi3GetFMUState"),
        ("restore", "fmi3SetFMUState"),
        ("release", "fmi3FreeFMUState"),
        ("run", "fmi3ExitInitializationMode"),
    ],
)
def test_every_call_is_noted_by_its_name(winch: Path, tmp_path: Path, method: str, call: str) -> None:
    journal, reader = CallJournal(tmp_path), CallJournal(tmp_path)
    with JournalledComponent(journal, "winch", winch) as component:
        assert reader.last_entry().call == "fmi3InstantiateCoSimulation"
        component.initialize(0.5, {})
        assert reader.last_entry() == CallEntry("winch", "fmi3EnterInitializationMode", 0.5, {}, ())
        block, saved = component.block(["speed_command"]), component.save()
        arguments = {"read": [block], "write": [block], "step": [0.75, 0.01], "restore": [saved], "release": [saved]}
        getattr(component, method)(*arguments.get(method, []))
        assert reader.last_entry() == CallEntry("winch", call, 0.75 if method == "step" else 0.5, {}, ())


@pytest.mark.validate
@needs_compiler
def test_other_names_of_a_variable_are_as_good(tmp_path: Path, winch: Path) -> None:
    command = '<Float64 name="speed_command" valueReference="0" causality="input" declaredType="Speed" start="0"'
    shown = '<Float64 name="winch_speed" valueReference="1" causality="output" initial="exact" declaredType="Speed"'
    changes = {
        f"{command}/>": f'{command.replace("speed_command", "u")}><Alias name="speed_command"/></Float64>',
        f'{shown} start="0"/>': f'{shown.replace("winch_speed", "y")} start="0"><Alias name="winch_speed"/></Float64>',
        'dependencies=""': 'dependencies="0"',
    }
    renamed = packed_3(tmp_path / "renamed.fmu", library_of(winch), changes)
    with Component("winch", renamed) as component:
        assert direct_feedthrough(component) == {name: {"u", "speed_command"} for name in ("y", "winch_speed")}
    motion = moved({1: renamed}, tmp_path / "renamed")
    assert np.allclose(motion.position, moved({1: winch}, tmp_path / "own").position, rtol=0.0, atol=1e-8)


@needs_compiler
def test_it_goes_into_the_archive_of_the_wired_robot(winch: Path, tmp_path: Path) -> None:
    robot = replace(paper_robot(), fmus=(UserFmu("winch_1", winch),))
    archive = write_ssp(robot, build_fmus(robot, tmp_path), tmp_path / "robot.ssp")
    with zipfile.ZipFile(archive) as content:
        structure = content.read("SystemStructure.ssd").decode()
        assert content.read("resources/winch_1.fmu") == winch.read_bytes()
    assert f'<ssv:Parameter name="lag"><ssv:Real value="{LAG}" unit="s" />' in "".join(
        line.strip() for line in structure.splitlines()
    )


def test_another_version_is_named(tmp_path: Path) -> None:
    later = packed_3(tmp_path / "a.fmu", b"", {'fmiVersion="3.0"': 'fmiVersion="3.1"'})
    with pytest.raises(ComponentError, match=r"FMU winch: reading its version gave 'FMI 3\.1'"):
        Component("winch", later)


def test_a_library_where_fmi_2_has_it_is_not_found(tmp_path: Path) -> None:
    misplaced = tmp_path / "a.fmu"
    with zipfile.ZipFile(packed_3(tmp_path / "b.fmu", b"")) as whole, zipfile.ZipFile(misplaced, "w") as changed:
        changed.writestr("modelDescription.xml", whole.read("modelDescription.xml"))
        changed.writestr(f"binaries/{fmpy.platform}/lag_winch.so", b"")
    with pytest.raises(ComponentError, match="FMU winch: loading its library gave 'Cannot find shared library"):
        Component("winch", misplaced)


def library_of(fmu: Path) -> bytes:
    """What is compiled in an FMU of a winch."""
    with zipfile.ZipFile(fmu) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith(".so")]
        return archive.read(name)
