"""The archive of a robot: valid, complete, and the same as what the master wires."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import fmpy
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, validate_tree
from lxml import etree

from tautwire.cosimulation.robot_wiring import recorded_ports, robot_connections, winch_input_ports
from tautwire.cosimulation.ssp_archive import COMPONENTS_ONLY, SYSTEM_STRUCTURE, ssp_name, write_ssp
from tautwire.errors import InputError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import EffectSetting, UserFmu
from tautwire_fmu.units import UNITS
from tests.support.robots import LIMITED, paper_robot, with_winch

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SSC = "{http://ssp-standard.org/SSP1/SystemStructureCommon}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
STRUCTURES = (SYSTEM_STRUCTURE, COMPONENTS_ONLY)


@pytest.fixture(scope="module")
def archive(three_fmus: RobotFmus, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ssp(paper_robot(), three_fmus, tmp_path_factory.mktemp("ssp") / "paper.ssp")


@pytest.fixture(scope="module")
def winch_archive(winch_fmus: RobotFmus, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ssp(with_winch(paper_robot(), LIMITED), winch_fmus, tmp_path_factory.mktemp("ssp") / "winch.ssp")


def rectangle(node: etree._Element) -> tuple[float, float, float, float]:
    x1, y1, x2, y2 = (float(node.get(name)) for name in ("x1", "y1", "x2", "y2"))
    return x1, y1, x2, y2


def structure(archive: Path, name: str) -> etree._Element:
    with zipfile.ZipFile(archive) as packed:
        return etree.fromstring(packed.read(name))


def wires(root: etree._Element) -> set[tuple[str | None, ...]]:
    ends = ("startElement", "startConnector", "endElement", "endConnector")
    return {tuple(node.get(end) for end in ends) for node in root.iter(f"{SSD}Connection")}


@pytest.mark.parametrize("name", STRUCTURES)
def test_it_is_valid_against_the_schema(archive: Path, name: str) -> None:
    root = structure(archive, name)
    validate_tree(root, "SystemStructureDescription.xsd")
    for values in root.iter(f"{SSV}ParameterSet"):
        validate_tree(values, "SystemStructureParameterValues.xsd")


def test_fmpy_reads_it(archive: Path) -> None:
    description = read_ssd(str(archive))
    assert description.name == "paper"
    assert [part.name for part in description.system.elements] == ["platform", "cable_1", "cable_2", "cable_3"]


def test_components_are_wired_as_the_master_wires_them(archive: Path) -> None:
    expected = {
        (w.source.component, w.source.variable, w.target.component, w.target.variable) for w in robot_connections(3)
    }
    assert wires(structure(archive, COMPONENTS_ONLY)) == expected
    assert expected < wires(structure(archive, SYSTEM_STRUCTURE))


def test_winches_come_in_and_what_a_run_shows_goes_out(archive: Path) -> None:
    outer = wires(structure(archive, SYSTEM_STRUCTURE)) - wires(structure(archive, COMPONENTS_ONLY))
    inward = {(end, variable) for start, _, end, variable in outer if start is None}
    outward = {(start, variable) for start, variable, end, _ in outer if end is None}
    assert inward == {(port.component, port.variable) for port in winch_input_ports(3)}
    assert outward == {(port.component, port.variable) for port in recorded_ports(3)}
    assert {("cable_2", "tension", None, "tension_2"), ("platform", "position.z", None, "position.z")} < outer


def test_connectors_are_those_of_the_fmus_inside(archive: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(tmp_path)
    for component in structure(archive, SYSTEM_STRUCTURE).iter(f"{SSD}Component"):
        description = fmpy.read_model_description(str(tmp_path / component.get("source")))
        variables = {v.name: (v.causality, v.unit) for v in description.modelVariables}
        connectors = component.findall(f"{SSD}Connectors/{SSD}Connector")
        assert connectors
        for connector in connectors:
            kind, unit = connector.get("kind"), connector.find(f"{SSC}Real").get("unit")
            assert variables[connector.get("name")] == (kind, unit)


def test_fmus_are_packed_as_they_are(archive: Path, three_fmus: RobotFmus) -> None:
    with zipfile.ZipFile(archive) as packed:
        for path in (three_fmus.platform, *three_fmus.cables):
            assert packed.read(f"resources/{path.name}") == path.read_bytes()


@pytest.mark.validate
def test_every_parameter_has_its_exact_value(tmp_path: Path) -> None:
    robot = paper_robot().with_effect(EffectSetting("modulus", {"modulus": 0.7e11}, (2,)))
    description = read_ssd(str(write_ssp(robot, build_fmus(robot, tmp_path), tmp_path / "robot.ssp")))
    for component in description.system.elements:
        (values,) = component.parameterBindings[0].parameterValues
        variables = fmpy.read_model_description(str(tmp_path / f"{component.name}.fmu")).modelVariables
        expected = {v.name: (float(v.start), v.unit) for v in variables if v.causality == "parameter"}
        assert {p.name: (float(p.value), p.unit) for p in values.parameters} == expected
        assert ("effect.modulus.modulus" in expected) == (component.name == "cable_2")


def test_a_users_fmu_gets_the_start_of_the_robot_file(three_fmus: RobotFmus, tmp_path: Path) -> None:
    robot = paper_robot()
    moved = replace(robot, platform=replace(robot.platform, start=(28.5, 0.25, 5.5)))
    own = replace(moved, fmus=(UserFmu("platform", three_fmus.platform),))
    description = read_ssd(str(write_ssp(own, build_fmus(own, tmp_path), tmp_path / "robot.ssp")))
    (values,) = description.system.elements[0].parameterBindings[0].parameterValues
    starts = {p.name: float(p.value) for p in values.parameters}
    assert [starts[f"start.{axis}"] for axis in "xyz"] == [28.5, 0.25, 5.5]


@pytest.mark.parametrize("name", STRUCTURES)
def test_the_default_experiment_is_that_of_the_fmus(archive: Path, three_fmus: RobotFmus, name: str) -> None:
    experiment = structure(archive, name).find(f"{SSD}DefaultExperiment")
    own = fmpy.read_model_description(str(three_fmus.platform)).defaultExperiment
    times = [float(experiment.get(key)) for key in ("startTime", "stopTime")]
    assert times == [float(own.startTime), float(own.stopTime)]


@pytest.mark.parametrize("name", STRUCTURES)
def test_blocks_lie_within_the_system_and_apart_from_each_other(winch_archive: Path, name: str) -> None:
    system = structure(winch_archive, name).find(f"{SSD}System")
    left, bottom, right, top = rectangle(system.find(f"{SSD}SystemGeometry"))
    blocks = [rectangle(node) for node in system.iter(f"{SSD}ElementGeometry")]
    assert len(blocks) == 7
    assert all(left < x1 < x2 < right and bottom < y1 < y2 < top for x1, y1, x2, y2 in blocks)
    for a, b in combinations(blocks, 2):
        assert a[2] < b[0] or b[2] < a[0] or a[3] < b[1] or b[3] < a[1]


@pytest.mark.parametrize("name", STRUCTURES)
def test_connectors_lie_apart_on_the_edges_of_their_blocks(winch_archive: Path, name: str) -> None:
    for connectors in structure(winch_archive, name).iter(f"{SSD}Connectors"):
        points = set()
        for connector in connectors:
            geometry = connector.find(f"{SSD}ConnectorGeometry")
            points.add((float(geometry.get("x")), float(geometry.get("y"))))
            assert geometry.get("x") == ("0.0" if connector.get("kind") == "input" else "1.0")
        assert len(points) == len(connectors)
        assert all(0.0 < y < 1.0 for _, y in points)


@pytest.mark.parametrize("name", STRUCTURES)
def test_every_unit_that_is_used_is_defined(archive: Path, name: str) -> None:
    root = structure(archive, name)
    for scope, used in [
        (root.find(f"{SSD}Units"), root.iter(f"{SSC}Real")),
        *((values.find(f"{SSV}Units"), values.iter(f"{SSV}Real")) for values in root.iter(f"{SSV}ParameterSet")),
    ]:
        defined = {unit.get("name"): dict(unit.find(f"{SSC}BaseUnit").attrib) for unit in scope}
        assert {number.get("unit") for number in used} == set(defined)
        assert defined == {unit: {base: str(power) for base, power in UNITS[unit].items()} for unit in defined}


def test_fmpy_steps_it(archive: Path) -> None:
    rows = simulate_ssp(str(archive), stop_time=0.0025, step_size=0.001)
    assert len(rows) == 3
    assert {"winch_speed_1", "tension_3", "position.x"} <= set(rows.dtype.names)


def test_the_same_fmus_give_the_same_bytes(archive: Path, three_fmus: RobotFmus, tmp_path: Path) -> None:
    again = write_ssp(paper_robot(), three_fmus, tmp_path / "again.ssp")
    assert again.read_bytes() == archive.read_bytes()


@pytest.mark.parametrize("name", ['Q&A <"7">', "two\nlines", "a\x00b\x1f\ufffe\udc80", "kabelrobot Åse 索", ""])
def test_any_name_makes_a_valid_archive(name: str, three_fmus: RobotFmus, tmp_path: Path) -> None:
    robot = replace(paper_robot(), name=name)
    description = read_ssd(str(write_ssp(robot, three_fmus, tmp_path / ssp_name(robot))))
    assert description.name == name or not name.isprintable()


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("three", "three.ssp"),
        ("my robot, v1.2", "my_robot_v1.2.ssp"),
        ("../../etc/passwd", "etc_passwd.ssp"),
        ("C:\\robots\\one", "C_robots_one.ssp"),
        (".hidden", "hidden.ssp"),
        ("a\x00\nb", "a_b.ssp"),
        ("a\udc80b", "a_b.ssp"),
        ("Åse 索", "Åse_索.ssp"),
        ("A\u030ase", "Åse.ssp"),
        ("", "robot.ssp"),
        ("///", "robot.ssp"),
        ("con", "robot_con.ssp"),
        ("Nul.x", "robot_Nul.x.ssp"),
        ("console", "console.ssp"),
        ("x" * 300, "x" * 100 + ".ssp"),
    ],
)
def test_its_file_name_is_one_that_any_file_system_takes(name: str, file: str) -> None:
    assert ssp_name(replace(paper_robot(), name=name)) == file


def test_a_long_name_is_not_cut_within_a_letter(tmp_path: Path) -> None:
    file = ssp_name(replace(paper_robot(), name="索" * 100))
    (tmp_path / file).touch()
    assert set(file.removesuffix(".ssp")) == {"索"}


def test_a_failure_leaves_what_was_there(
    three_fmus: RobotFmus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "out" / "paper.ssp"
    target.parent.mkdir()
    target.write_bytes(b"before")
    write = zipfile.ZipFile.writestr

    def fail_late(self: zipfile.ZipFile, entry: zipfile.ZipInfo, data: bytes) -> None:
        if entry.filename.endswith("cable_3.fmu"):
            raise OSError("disk full")
        write(self, entry, data)

    monkeypatch.setattr(zipfile.ZipFile, "writestr", fail_late)
    with pytest.raises(OSError, match="disk full"):
        write_ssp(paper_robot(), three_fmus, target)
    assert target.read_bytes() == b"before"
    assert list(target.parent.iterdir()) == [target]


def test_a_folder_is_refused(three_fmus: RobotFmus, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        write_ssp(paper_robot(), three_fmus, tmp_path)
