"""A user's FMU in a slot of the robot: what is refused before anything runs, and with which words."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import fmpy
import pytest

from tautwire.errors import InputError
from tautwire.fmus.fmu_slots import (
    SlotError,
    check_user_fmus,
    notes_on_user_fmus,
    parse_user_fmus,
    require_step_support,
    slot_ports,
)
from tautwire.fmus.packaging import RobotFmus, build_fmus, with_user_fmus_copied
from tautwire.robot.schema import EffectSetting, Formula, UserFmu, fmu_slots
from tests.support.own_fmus import falling_mass, packed, packed_3
from tests.support.robots import paper_robot

SHOWN = 'name="winch_speed"'
SPEED_UNIT = '<Real unit="m.s-1" start="0"/>'
INPUT = 'causality="input" variability="continuous"'
COMMAND_3 = '<Float64 name="speed_command" valueReference="0" causality="input" declaredType="Speed" start="0"/>'
ARRAY = COMMAND_3.replace('"0"/>', '"0 0"><Dimension start="2"/></Float64>')
CLOCK = '<Clock name="tick" valueReference="5" causality="input" intervalVariability="triggered"/>'
CLOCKED = COMMAND_3.replace("/>", ' variability="discrete" clocks="5"/>') + CLOCK
SINGLE = COMMAND_3.replace("Float64", "Float32").replace('declaredType="Speed" ', "")


def refused(path: Path, slot: str = "winch_2") -> SlotError:
    """The error about an FMU in a slot, after checking what every such error has."""
    with pytest.raises(SlotError) as caught:
        check_user_fmus(replace(paper_robot(), fmus=(UserFmu(slot, path),)))
    error = caught.value
    assert str(error).startswith(f"{path}: ")
    assert f"the FMU {slot}" in str(error)
    assert len(str(error).splitlines()) == 1
    return error


def test_our_own_fmus_fit_their_slots(three_fmus: RobotFmus, winch_fmus: RobotFmus) -> None:
    for slot, path in winch_fmus.by_component.items():
        check_user_fmus(replace(paper_robot(), fmus=(UserFmu(slot, path),)))
        variables = {v.name: v for v in fmpy.read_model_description(str(path)).modelVariables}
        for port in slot_ports(slot, 3):
            assert (variables[port.name].causality, variables[port.name].unit) == (port.causality, port.unit)


def test_a_plain_platform_without_units_fits(tmp_path: Path) -> None:
    check_user_fmus(replace(paper_robot(), fmus=(UserFmu("platform", falling_mass(tmp_path)),)))


def test_a_unit_by_another_name_is_the_same_unit(tmp_path: Path) -> None:
    check_user_fmus(replace(paper_robot(), fmus=(UserFmu("winch_2", packed(tmp_path / "a.fmu", b"")),)))


@pytest.mark.parametrize(
    ("change", "port", "words"),
    [
        ({SHOWN: 'name="speed"'}, "winch_speed", ["missing", "a Real output in m/s"]),
        ({INPUT: 'causality="parameter" variability="fixed"'}, "speed_command", ["Real parameter", "a Real input"]),
        ({SPEED_UNIT: '<Integer start="0"/>', "continuous": "discrete"}, "speed_command", ["Integer", "a Real input"]),
        ({'<BaseUnit m="1" s="-1"/>': '<BaseUnit m="1" s="-2"/>'}, "speed_command", ["'m.s-1'", "m/s"]),
        ({'<BaseUnit m="1" s="-1"/>': '<BaseUnit m="1" s="-1" factor="0.001"/>'}, "speed_command", ["m/s"]),
        ({'unit="m.s-1"': 'unit="s"'}, "speed_command", ["'s'", "m/s"]),
    ],
)
def test_a_port_that_does_not_fit_is_named(
    tmp_path: Path, change: Mapping[str, str], port: str, words: list[str]
) -> None:
    error = refused(packed(tmp_path / "a.fmu", b"", change))
    assert error.port == port
    assert port in error.problem
    assert not [word for word in words if word not in str(error)], str(error)


@pytest.mark.parametrize(
    ("change", "port", "words"),
    [
        ({SHOWN: 'name="speed"'}, "winch_speed", ["missing", "a Float64 output in m/s"]),
        ({COMMAND_3: COMMAND_3.replace('declaredType="Speed"', 'unit="s"')}, "speed_command", ["'s'", "Float64"]),
        ({COMMAND_3: ARRAY}, "speed_command", ["is a Float64 array input", "make it a Float64 input in m/s"]),
        ({COMMAND_3: CLOCKED}, "speed_command", ["is a clocked Float64 input"]),
        ({COMMAND_3: SINGLE}, "speed_command", ["is a Float32 input", "make it a Float64 input"]),
    ],
)
def test_so_is_one_of_an_fmi_3_fmu(tmp_path: Path, change: Mapping[str, str], port: str, words: list[str]) -> None:
    error = refused(packed_3(tmp_path / "a.fmu", b"", change))
    assert error.port == port
    assert not [word for word in words if word not in str(error)], str(error)


def test_effects_of_what_an_fmu_replaces_are_told(tmp_path: Path) -> None:
    own = tuple(UserFmu(slot, packed_3(tmp_path / f"{slot}.fmu", b"")) for slot in ("winch_2", "cable_2", "platform"))
    gain, drag = EffectSetting("sensor_gain", {"tension_gain": 1.1}, (2,)), EffectSetting("drag", {"linear": 5.0}, ())
    settings = (gain, drag, EffectSetting("damping", {"damping": 1e8}, (1, 2)))
    formulas = (Formula("force_x", "-20*vx", ()),)
    notes = notes_on_user_fmus(replace(paper_robot(), fmus=own, effects=settings, formulas=formulas))
    assert [note for note in notes if "effects" in note] == [
        f"{own[1].path}: effects of the robot file do not act in a user's FMU: sensor_gain, damping",
        f"{own[2].path}: effects of the robot file do not act in a user's FMU: drag, formula",
    ]


def test_an_fmi_3_fmu_fits(tmp_path: Path) -> None:
    own = UserFmu("winch_2", packed_3(tmp_path / "a.fmu", b""))
    check_user_fmus(replace(paper_robot(), fmus=(own,)))
    assert notes_on_user_fmus(replace(paper_robot(), fmus=(own,))) == ()
    require_step_support({"winch_2": own.path}, adaptive=True, equidistant=False)
    fixed = packed_3(tmp_path / "b.fmu", b"", {'canGetAndSetFMUState="true"': ""})
    with pytest.raises(SlotError, match="cannot save its state"):
        require_step_support({"winch_2": fixed}, adaptive=True, equidistant=False)


def test_what_is_no_fmu_for_this_machine_is_refused(tmp_path: Path) -> None:
    assert "no such file" in str(refused(tmp_path / "absent.fmu"))
    assert "no such file" in str(refused(tmp_path))
    text = tmp_path / "text.fmu"
    text.write_text("no archive")
    assert "cannot be read" in str(refused(text))
    with zipfile.ZipFile(tmp_path / "empty.fmu", "w") as archive:
        archive.writestr("a", "b")
    assert "cannot be read" in str(refused(tmp_path / "empty.fmu"))
    broken = packed(tmp_path / "broken.fmu", b"", {"</fmiModelDescription>": ""})
    assert "cannot be read" in str(refused(broken))


def test_other_kinds_and_machines_are_named(tmp_path: Path) -> None:
    step = 'canHandleVariableCommunicationStepSize="true" '
    exchange = packed(tmp_path / "a.fmu", b"", {"CoSimulation": "ModelExchange", step: ""})
    assert "model exchange only" in str(refused(exchange))
    later = packed_3(tmp_path / "b.fmu", b"", {'fmiVersion="3.0"': 'fmiVersion="3.1"'})
    assert refused(later).problem == "cannot be the FMU winch_2: it is FMI 3.1"
    assert refused(later).hint == "export it as FMI 2.0 or 3.0 co-simulation"
    step_3 = 'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true"'
    scheduled = packed_3(tmp_path / "d.fmu", b"", {"CoSimulation": "ScheduledExecution", step_3: ""})
    assert "scheduled execution only" in str(refused(scheduled))
    elsewhere = packed(tmp_path / "c.fmu", b"", platform="elsewhere")
    assert f"none for {fmpy.platform}" in str(refused(elsewhere))


def test_an_fmu_for_one_instance_takes_one_slot(tmp_path: Path) -> None:
    single = {'canGetAndSetFMUstate="true"': 'canBeInstantiatedOnlyOncePerProcess="true"'}
    path = packed(tmp_path / "a.fmu", b"", single)
    check_user_fmus(replace(paper_robot(), fmus=(UserFmu("winch_1", path),)))
    with pytest.raises(SlotError, match="slot winch_1 and can be instantiated only once"):
        check_user_fmus(replace(paper_robot(), fmus=(UserFmu("winch_1", path), UserFmu("winch_3", path))))


def test_users_fmus_are_copied_beside_ours_as_they_are(tmp_path: Path) -> None:
    own = packed(tmp_path / "mine.fmu", b"library")
    fmus = build_fmus(replace(paper_robot(), fmus=(UserFmu("winch_2", own),)), tmp_path / "out")
    assert fmus.by_component["winch_2"] == own
    fmus = with_user_fmus_copied(fmus, tmp_path / "out")
    assert fmus.winches == (None, tmp_path / "out" / "winch_2.fmu", None)
    assert set(fmus.user_start_values) == {"winch_2"}
    assert fmus.by_component["winch_2"].read_bytes() == own.read_bytes()
    assert list(fmus.by_component) == ["platform", "winch_2", "cable_1", "cable_2", "cable_3"]


def test_the_command_lines_fmus_are_slots_and_files() -> None:
    given = parse_user_fmus(["platform=a=b.fmu", "cable_2=c.fmu"], 3)
    assert given == (UserFmu("platform", Path("a=b.fmu")), UserFmu("cable_2", Path("c.fmu")))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["mine.fmu"], "names no slot"),
        (["cable_4=mine.fmu"], "winch_3"),
        (["platform="], "platform=mine.fmu"),
        (["platform=a.fmu", "platform=b.fmu"], "given twice"),
    ],
)
def test_what_is_no_slot_is_refused(given: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_user_fmus(given, 3)


def test_slots_are_platform_cables_and_winches() -> None:
    assert fmu_slots(2) == ("platform", "cable_1", "cable_2", "winch_1", "winch_2")
