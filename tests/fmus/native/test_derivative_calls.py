"""FMI's calls for partial derivatives: what they take and refuse, in both versions."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Real, fmi2ValueReference
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from tautwire.fmus.packaging import RobotFmus, build_fmus
from tests.support.effect_cases import same
from tests.support.effects import with_effects
from tests.support.fmus import Hand, in_hand
from tests.support.robots import LIMITED, example, with_winch

ROBOT = with_winch(with_effects(example("three"), same("damping", damping=1.7e9)), LIMITED)
FMI_OK, FMI_WARNING = 0, 1


@pytest.fixture(scope="module")
def native_fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(ROBOT, tmp_path_factory.mktemp("native"), native=True)


def status_of(hand: Hand, unknowns: Sequence[str], knowns: Sequence[str]) -> tuple[int, list[float]]:
    """Status of the call with ones as seed, and what it gives."""
    references = [[hand.references[name] for name in names] for names in (unknowns, knowns)]
    first, second = ((fmi2ValueReference * len(each))(*each) for each in references)
    sensitivity = (fmi2Real * len(unknowns))()
    status = hand.fmu.fmi2GetDirectionalDerivative(
        hand.fmu.component,
        first,
        len(first),
        second,
        len(second),
        (fmi2Real * len(second))(*[1.0] * len(second)),
        sensitivity,
    )
    return int(status), list(sensitivity)


def test_where_the_law_has_no_value_they_are_not_a_number_with_a_warning(native_fmus: RobotFmus) -> None:
    with in_hand(native_fmus.cables[0]) as cable:
        cable.run()
        before = status_of(cable, ["tension"], ["position.x"])
        position = cable.get("position.x", "position.y", "position.z")
        anchor = cable.get("anchor.x", "anchor.y", "anchor.z")
        cable.set(**{f"position__{axis}": value for axis, value in zip("xyz", anchor, strict=True)})
        status, (value,) = status_of(cable, ["tension"], ["position.x"])
        assert status == FMI_WARNING and np.isnan(value)
        cable.set(**{f"position__{axis}": value for axis, value in zip("xyz", position, strict=True)})
        assert status_of(cable, ["tension"], ["position.x"]) == before


@pytest.mark.parametrize(
    ("unknowns", "knowns", "message"),
    [
        (["unstrained_length"], ["position.x"], "unstrained_length is no output"),
        (["force.x", "modulus"], ["position.x"], "modulus is no output"),
        (["force.x"], ["force.y"], "force.y is no input"),
        (["force.x"], ["position.x", "area"], "area is no input"),
        (["nothing"], ["position.x"], "no real variable has the value reference 9999"),
        (["force.x"], ["nothing"], "no real variable has the value reference 9999"),
    ],
)
def test_only_those_of_outputs_with_respect_to_inputs_are_given(
    unknowns: list[str],
    knowns: list[str],
    message: str,
    native_fmus: RobotFmus,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with in_hand(native_fmus.cables[0]) as cable:
        cable.run()
        cable.references["nothing"] = 9999
        with pytest.raises(FMICallException):
            status_of(cable, unknowns, knowns)
        assert message in capsys.readouterr().out
        assert status_of(cable, ["force.x"], ["position.x"])[0] == 0


def test_before_initialization_there_are_none(native_fmus: RobotFmus) -> None:
    with in_hand(native_fmus.cables[0]) as cable:
        cable.fmu.reset()
        with pytest.raises(FMICallException):
            status_of(cable, ["force.x"], ["position.x"])


def running(path: Path, folder: Path) -> tuple[FMU3Slave, list[int], list[int]]:
    """An instance of FMI 3.0 after initialization, and the references of its outputs and inputs."""
    description = fmpy.read_model_description(str(path))
    fmpy.extract(str(path), str(folder))
    name = description.coSimulation.modelIdentifier
    fmu = FMU3Slave(guid=description.guid, unzipDirectory=str(folder), modelIdentifier=name)
    fmu.instantiate(loggingOn=True)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    outputs, inputs = (
        [v.valueReference for v in description.modelVariables if v.causality == each] for each in ("output", "input")
    )
    return fmu, outputs, inputs


@pytest.mark.validate
def test_by_fmi_3_they_are_the_same_and_the_adjoint_is_the_transpose(native_fmus: RobotFmus, tmp_path: Path) -> None:
    fmus = build_fmus(ROBOT, tmp_path, native=True, fmi=3)
    random = np.random.default_rng(7)
    for path, former in zip(fmus.paths[2:5], native_fmus.paths[2:5], strict=True):
        with in_hand(former) as hand:
            hand.run()
            expected = hand.jacobian()
        fmu, outputs, inputs = running(path, tmp_path / path.stem)
        columns = [fmu.getDirectionalDerivative(outputs, [known], [1.0]) for known in inputs]
        rows = [fmu.getAdjointDerivative([unknown], inputs, [1.0], len(inputs)) for unknown in outputs]
        seed = random.standard_normal(len(outputs))
        adjoint = np.array(fmu.getAdjointDerivative(outputs, inputs, list(seed), len(inputs)))
        fmu.freeInstance()
        assert np.array_equal(np.array(columns).T, expected) and np.array_equal(np.array(rows), expected)
        assert np.allclose(adjoint, expected.T @ seed, rtol=1e-12, atol=1e-12 * np.max(np.abs(adjoint)))


def test_by_fmi_3_other_unknowns_knowns_and_counts_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = build_fmus(ROBOT, tmp_path, native=True, fmi=3).platform
    fmu, outputs, inputs = running(path, tmp_path / "platform")
    for call, count in ((fmu.getDirectionalDerivative, 1), (fmu.getAdjointDerivative, 1)):
        assert len(call(outputs[:1], inputs[:1], [1.0], count)) == 1
        for arguments in (
            (inputs[:1], inputs[:1], [1.0], 1),
            (outputs[:1], outputs[:1], [1.0], 1),
            (outputs[:1], inputs[:1], [1.0, 1.0], 1),
            (outputs[:1], inputs[:1], [1.0], 2),
        ):
            with pytest.raises(FMICallException):
                call(*arguments)
    time = fmpy.read_model_description(str(path)).modelVariables[-1].valueReference
    for unknowns, knowns, message in (
        ([time], inputs[:1], "time is no output"),
        (outputs[:1], [time], "time is no input"),
    ):
        with pytest.raises(FMICallException):
            fmu.getDirectionalDerivative(unknowns, knowns, [1.0])
        assert message in capsys.readouterr().out
    fmu.freeInstance()


def test_an_adjoint_derivative_that_has_no_value_is_told_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = build_fmus(ROBOT, tmp_path, native=True, fmi=3).cables[0]
    references = {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}
    fmu, outputs, inputs = running(path, tmp_path / "cable")
    fmu.setFloat64([references[f"position.{axis}"] for axis in "xyz"], list(ROBOT.cables[0].anchor))
    capsys.readouterr()
    adjoint = fmu.getAdjointDerivative(outputs, inputs, [1.0] * len(outputs), len(inputs))
    fmu.freeInstance()
    assert np.isnan(list(adjoint)).all()
    assert capsys.readouterr().out.count("no derivatives: the law has none") == 1


def test_model_descriptions_tell_of_them(native_fmus: RobotFmus, tmp_path: Path) -> None:
    path = native_fmus.platform
    assert fmpy.read_model_description(str(path)).coSimulation.providesDirectionalDerivative
    latter = build_fmus(ROBOT, tmp_path, native=True, fmi=3).platform
    with zipfile.ZipFile(latter) as archive:
        cosimulation = ElementTree.fromstring(archive.read("modelDescription.xml")).find("CoSimulation")
    assert cosimulation is not None
    for kind in ("Directional", "Adjoint"):
        assert cosimulation.get(f"provides{kind}Derivatives") == "true"
    assert validate_fmu(str(path)) == validate_fmu(str(latter)) == []
