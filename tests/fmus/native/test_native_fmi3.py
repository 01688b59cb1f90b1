"""Native FMUs of FMI 3.0: the variables, the numbers and the states of those of FMI 2.0."""

from __future__ import annotations

import io
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from PIL import Image

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.errors import ArgumentError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tests.support.effect_cases import same
from tests.support.effects import with_effects
from tests.support.robots import LIMITED, example, gentle_speeds, paper_robot, with_winch

ROBOT = with_winch(
    with_effects(example("three"), same("hysteresis", force=60.0, yield_strain=1e-4), same("drag", drag_area=5.0)),
    LIMITED,
)


@pytest.fixture(scope="module")
def both_versions(tmp_path_factory: pytest.TempPathFactory) -> tuple[RobotFmus, RobotFmus]:
    folder = tmp_path_factory.mktemp("versions")
    fmi2, fmi3 = (build_fmus(ROBOT, folder / str(fmi), native=True, fmi=fmi) for fmi in (2, 3))
    return fmi2, fmi3


def test_variables_are_the_same_and_time_is_behind_them(both_versions: tuple[RobotFmus, RobotFmus]) -> None:
    for path, other in zip(*(fmus.paths for fmus in both_versions), strict=True):
        former, latter = (fmpy.read_model_description(str(each)).modelVariables for each in (path, other))
        assert latter[-1].causality == "independent"
        for one, two in zip(former, latter[:-1], strict=True):
            assert (one.name, one.valueReference, one.unit, one.nominal) == (
                two.name,
                two.valueReference,
                two.unit,
                two.nominal,
            )
            assert (one.causality, one.start) == (two.causality, two.start)
            names = [each.derivative.name if each.derivative else None for each in (one, two)]
            assert names[0] == names[1]


def test_nothing_is_wrong_with_them(both_versions: tuple[RobotFmus, RobotFmus]) -> None:
    assert [validate_fmu(str(path)) for path in both_versions[1].paths] == [[]] * 7


def test_documentation_licenses_and_icon_lie_where_each_version_has_them(
    both_versions: tuple[RobotFmus, RobotFmus],
) -> None:
    for fmus, version, icon_path in zip(
        both_versions, ("2.0", "3.0"), ("model.png", "terminalsAndIcons/icon.png"), strict=True
    ):
        for path in fmus.paths:
            with zipfile.ZipFile(path) as archive:
                page, license_text = (
                    archive.read(f"documentation/{name}").decode("utf-8")
                    for name in ("index.html", "licenses/license.txt")
                )
                icon = Image.open(io.BytesIO(archive.read(icon_path)))
                icons = [name for name in archive.namelist() if name.endswith(".png")]
            assert f"FMI {version} co-simulation FMU by Tautwire" in page
            for variable in fmpy.read_model_description(str(path)).modelVariables:
                assert variable.causality == "independent" or f"<tr><td>{variable.name}</td>" in page
            assert "Copyright (c) 2026 The Tautwire developers" in license_text
            assert icon.format == "PNG" and icons == [icon_path]


def test_the_master_gets_the_same_bits_from_either_version(both_versions: tuple[RobotFmus, RobotFmus]) -> None:
    time, speed = gentle_speeds(ROBOT, 0.3, 0.02)
    one, other = (cosimulate(fmus, time, speed).frame().to_numpy() for fmus in both_versions)
    assert np.array_equal(one, other)


def extracted(path: Path, folder: Path) -> tuple[Callable[[], FMU3Slave], dict[str, int]]:
    """What makes instances of an FMU, and its value references."""
    fmpy.extract(str(path), str(folder))
    description = fmpy.read_model_description(str(path))

    def instance() -> FMU3Slave:
        name = description.coSimulation.modelIdentifier
        fmu = FMU3Slave(guid=description.guid, unzipDirectory=str(folder), modelIdentifier=name)
        fmu.instantiate()
        return fmu

    return instance, {variable.name: variable.valueReference for variable in description.modelVariables}


def running(instance: Callable[[], FMU3Slave]) -> FMU3Slave:
    fmu = instance()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu


def test_calls_are_allowed_in_their_states_only(both_versions: tuple[RobotFmus, RobotFmus], tmp_path: Path) -> None:
    instance, _ = extracted(both_versions[1].platform, tmp_path)
    fmu = instance()
    for call in (fmu.exitInitializationMode, fmu.terminate, lambda: fmu.doStep(0.0, 0.01)):
        with pytest.raises(FMICallException):
            call()
    fmu.enterInitializationMode()
    with pytest.raises(FMICallException):
        fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.doStep(0.0, 0.01)
    fmu.terminate()
    with pytest.raises(FMICallException):
        fmu.doStep(0.01, 0.01)
    fmu.reset()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.doStep(0.0, 0.01)


def test_what_is_computed_cannot_be_set(
    both_versions: tuple[RobotFmus, RobotFmus], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    instance, references = extracted(both_versions[1].cables[0], tmp_path)
    fmu = running(instance)
    for name in ("tension", "middle_force.x", "unstrained_length", "effect.hysteresis.memory"):
        (before,) = fmu.getFloat64([references[name]])
        with pytest.raises(FMICallException):
            fmu.setFloat64([references[name]], [before + 1.0])
        assert f"{name} is no input and no parameter" in capsys.readouterr().out
        assert fmu.getFloat64([references[name]]) == [before]


def test_time_is_that_of_the_state(both_versions: tuple[RobotFmus, RobotFmus], tmp_path: Path) -> None:
    instance, references = extracted(both_versions[1].cables[0], tmp_path)
    first, second = running(instance), running(instance)
    first.doStep(0.0, 0.01)
    saved = first.getFMUState()
    first.doStep(0.01, 0.01)
    assert first.getFloat64([references["time"]]) == [0.02]
    first.setFMUState(saved)
    second.setFMUState(second.deserializeFMUState(first.serializeFMUState(saved)))
    assert [fmu.getFloat64([references["time"]]) for fmu in (first, second)] == [[0.01], [0.01]]


def test_a_serialised_state_goes_on_in_another_instance(
    both_versions: tuple[RobotFmus, RobotFmus], tmp_path: Path
) -> None:
    instance, references = extracted(both_versions[1].cables[0], tmp_path)
    shown = [references[name] for name in ("tension", "effect.hysteresis.memory", "time")]
    first = running(instance)
    first.setFloat64([references["winch_speed"]], [0.3])
    first.doStep(0.0, 0.01)
    content = first.serializeFMUState(first.getFMUState())
    first.doStep(0.01, 0.01)
    expected = first.getFloat64(shown)
    second = running(instance)
    state = second.deserializeFMUState(content)
    second.setFMUState(state)
    second.doStep(0.01, 0.01)
    assert second.getFloat64(shown) == expected
    assert expected[2] == 0.02 and expected[1] != 0.0


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
def test_a_plain_c_compiler_takes_its_source(both_versions: tuple[RobotFmus, RobotFmus], tmp_path: Path) -> None:
    with zipfile.ZipFile(both_versions[1].winches[0] or "") as archive:
        archive.extractall(tmp_path)
    description = fmpy.read_model_description(str(tmp_path))
    (configuration,) = description.buildConfigurations
    assert configuration.sourceFileSets[0].sourceFiles == ["all.c"]
    headers = Path(fmpy.__file__).parent / "c-code"
    call = ["gcc", "-std=c99", "-pedantic-errors", "-c", "-o", str(tmp_path / "all.o"), f"-I{headers}"]
    subprocess.run([*call, str(tmp_path / "sources" / "all.c")], check=True)
    symbols = subprocess.run(["nm", "-g", "--defined-only", str(tmp_path / "all.o")], capture_output=True, check=True)
    names = [line.split()[-1] for line in symbols.stdout.decode().splitlines()]
    assert len(names) > 50
    assert all(name.startswith("winch_1_fmi3") for name in names)


def test_other_versions_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="fmi"):
        build_fmus(paper_robot(), tmp_path, native=True, fmi=1)
