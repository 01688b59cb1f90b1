"""FMUs as other tools see them."""

import shutil
import signal
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from tautwire.fmus import pythonfmu_builder
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import EffectSetting
from tests.support.fmus import in_hand
from tests.support.robots import paper_robot


def all_of(fmus: RobotFmus) -> tuple[Path, ...]:
    return (*fmus.cables, fmus.platform)


def test_there_is_one_fmu_a_cable_and_one_for_the_platform(three_fmus: RobotFmus) -> None:
    assert [path.name for path in all_of(three_fmus)] == ["cable_1.fmu", "cable_2.fmu", "cable_3.fmu", "platform.fmu"]
    assert all(path.is_file() for path in all_of(three_fmus))


def test_there_is_one_more_a_winch_where_the_robot_has_them(winch_fmus: RobotFmus) -> None:
    assert list(winch_fmus.by_component) == [
        "platform",
        *(f"{kind}_{i}" for kind in ("winch", "cable") for i in (1, 2, 3)),
    ]
    assert all(path.name == f"{name}.fmu" and path.is_file() for name, path in winch_fmus.by_component.items())


@pytest.mark.validate
def test_fmpy_finds_nothing_to_complain_about(
    three_fmus: RobotFmus, eight_fmus: RobotFmus, winch_fmus: RobotFmus
) -> None:
    for path in (*all_of(three_fmus), *all_of(eight_fmus), *winch_fmus.by_component.values()):
        assert validate_fmu(str(path)) == []


def test_every_variable_says_what_it_is(winch_fmus: RobotFmus) -> None:
    for path in winch_fmus.by_component.values():
        description = fmpy.read_model_description(str(path))
        units = {unit.name for unit in description.unitDefinitions}
        for variable in description.modelVariables:
            assert variable.description
            assert variable.unit in units
            assert (variable.start is not None) == (variable.causality in {"input", "parameter"})


def test_start_values_are_written_to_the_last_bit(three_fmus: RobotFmus) -> None:
    variables = {v.name: v for v in fmpy.read_model_description(str(three_fmus.cables[0])).modelVariables}
    assert float(variables["area"].start) == np.pi * 0.002**2


def test_outputs_name_the_inputs_that_act_without_delay(three_fmus: RobotFmus, winch_fmus: RobotFmus) -> None:
    outputs = {
        unknown.variable.name: {known.name for known in unknown.dependencies}
        for unknown in fmpy.read_model_description(str(three_fmus.cables[0])).outputs
    }
    assert "position.x" in outputs["force.x"]
    assert "acceleration.x" not in outputs["force.x"]
    assert "acceleration.x" in outputs["force_rate.x"]
    winch = fmpy.read_model_description(str(winch_fmus.by_component["winch_2"])).outputs
    assert {u.variable.name: [known.name for known in u.dependencies] for u in winch} == {
        "winch_speed": [],
        "motor_speed": [],
        "speed_margin": ["speed_command"],
        "winch_acceleration": ["speed_command"],
        "command_margin": ["speed_command"],
        "acceleration_margin": ["speed_command"],
    }
    platform = fmpy.read_model_description(str(three_fmus.platform)).outputs
    assert {u.variable.name: u.dependencies for u in platform}["position.x"] == []


def test_only_standard_library_and_pythonfmu_travel_inside(three_fmus: RobotFmus) -> None:
    with zipfile.ZipFile(three_fmus.cables[0]) as archive:
        names = {Path(name).parts[1] for name in archive.namelist() if name.startswith("resources/")}
    own = {name for name in names if name.startswith(("tautwire_fmu_", "cable_1_"))}
    assert names - own == {"pythonfmu", "cable.json", "slavemodule.txt"}


def test_the_same_robot_gives_the_same_guid(three_fmus: RobotFmus, tmp_path: Path) -> None:
    again = build_fmus(paper_robot(), tmp_path)
    assert [fmpy.read_model_description(str(p)).guid for p in all_of(again)] == [
        fmpy.read_model_description(str(p)).guid for p in all_of(three_fmus)
    ]


@pytest.mark.validate
def test_building_leaves_nothing_behind(tmp_path: Path) -> None:
    before, modules = list(sys.path), set(sys.modules)
    build_fmus(paper_robot(damping=1e9), tmp_path)
    assert sys.path == before
    assert not {name for name in set(sys.modules) - modules if "tautwire_fmu_" in name}
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "cable_1.fmu",
        "cable_2.fmu",
        "cable_3.fmu",
        "platform.fmu",
    ]


def test_two_robots_run_their_own_physics_in_one_process(three_fmus: RobotFmus, damped_fmus: RobotFmus) -> None:
    tensions = []
    for fmus in (three_fmus, damped_fmus, three_fmus):
        with in_hand(fmus.cables[0]) as cable:
            cable.set(velocity__z=-0.1)
            tensions += cable.get("tension")
    assert tensions[0] == tensions[2]
    assert tensions[1] - tensions[0] == pytest.approx(2.08e9 * np.pi * 0.002**2 * 0.1 * 45.0 / 73.2**2, rel=1e-3)


@pytest.mark.validate
def test_an_fmu_can_be_instantiated_over_and_over(three_fmus: RobotFmus) -> None:
    for _ in range(30):
        with in_hand(three_fmus.platform) as platform:
            assert platform.get("position.z") == [5.0]


@pytest.mark.validate
def test_effects_are_parameters_of_the_fmu(tmp_path: Path) -> None:
    robot = paper_robot().with_effect(EffectSetting("damping", {"damping": 1e9}, (2,)))
    fmus = build_fmus(robot.with_effect(EffectSetting("payload", {"mass": 12.0})), tmp_path)
    with in_hand(fmus.cables[1]) as second, in_hand(fmus.cables[0]) as first, in_hand(fmus.platform) as platform:
        assert second.get("effect.damping.damping") == [1e9]
        assert "effect.damping.damping" not in first.references
        assert platform.get("effect.payload.mass") == [12.0]


def test_it_runs_in_a_fresh_process(three_fmus: RobotFmus) -> None:
    code = (
        "import sys, fmpy; r = fmpy.simulate_fmu(sys.argv[1], stop_time=0.1, output_interval=0.01,"
        " output=['tension']); assert len(r) == 11 and 1590 < r['tension'][-1] < 1600, r"
    )
    subprocess.run([sys.executable, "-c", code, str(three_fmus.cables[0])], check=True, timeout=120)


def test_an_interrupt_while_pythonfmu_works_ends_the_build_and_leaves_no_fmu(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*arguments: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(pythonfmu_builder, "patch_wrapper_exit", interrupted)
    with pytest.raises(KeyboardInterrupt):
        build_fmus(paper_robot(), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_before_the_first_fmu_waits_for_the_imports_and_restores_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*arguments: object, **options: object) -> None:
        signal.raise_signal(signal.SIGINT)
        copied.append(copy_folder(*arguments, **options))

    copied: list[Path] = []
    copy_folder, search_path = shutil.copytree, list(sys.path)
    monkeypatch.setattr(shutil, "copytree", interrupted)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(KeyboardInterrupt):
        build_fmus(paper_robot(), tmp_path)
    assert copied
    assert (list(tmp_path.iterdir()), sys.path) == ([], search_path)
