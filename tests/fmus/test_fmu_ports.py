"""What an FMU shows of itself, for people and for machines."""

import json

import pytest

from tautwire.cli import run
from tautwire.fmus.fmu_ports import fmu_ports, group_vectors
from tautwire.fmus.packaging import RobotFmus
from tautwire_fmu.units import UNITS
from tests.support.robots import EXAMPLES

ROBOT = str(EXAMPLES / "three" / "robot.toml")


def test_ports_have_units_and_descriptions(three_fmus: RobotFmus) -> None:
    for path in three_fmus.paths:
        for port in fmu_ports(path):
            assert port.unit in UNITS
            assert port.description
            assert port.causality in ("input", "output", "parameter")


def test_vectors_stand_as_one(three_fmus: RobotFmus) -> None:
    ports = fmu_ports(three_fmus.cables[0])
    rows = {port.name: port for port in group_vectors(ports)}
    assert "position.x" not in rows and "tension" in rows
    position = rows["position.x .y .z"]
    assert (position.start, position.unit, position.description) == (
        "28.86, 0, 5",
        "m",
        "position of the cable's end on the platform",
    )
    assert sum(3 if name.endswith(".x .y .z") else 1 for name in rows) == len(ports)


@pytest.mark.validate
def test_the_command_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["fmus", ROBOT]) == 0
    stdout = capsys.readouterr().out
    assert "cable_1.fmu, cable_2.fmu, cable_3.fmu" in stdout and "platform.fmu" in stdout
    assert any(line.split()[:4] == ["winch_speed", "input", "m/s", "0.0"] for line in stdout.splitlines())
    assert run(["fmus", ROBOT, "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [each["fmu"] for each in listed["fmus"]] == ["platform", "cable_1", "cable_2", "cable_3"]
    (speed,) = [port for port in listed["fmus"][1]["ports"] if port["name"] == "winch_speed"]
    assert (speed["causality"], speed["unit"]) == ("input", "m/s")
