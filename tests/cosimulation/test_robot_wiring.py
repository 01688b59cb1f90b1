from collections.abc import Iterator

import pytest

from tautwire.cosimulation import Component, Connection, Port, WiringError
from tautwire.cosimulation.connections import check_connections
from tautwire.cosimulation.direct_feedthrough import dependency_groups
from tautwire.cosimulation.robot_wiring import robot_connections, robot_power_bonds, wire_robot
from tautwire.fmus.packaging import RobotFmus


@pytest.fixture
def components(three_fmus: RobotFmus) -> Iterator[dict[str, Component]]:
    paths = {"platform": three_fmus.platform} | {f"cable_{i + 1}": p for i, p in enumerate(three_fmus.cables)}
    made = {name: Component(name, path) for name, path in paths.items()}
    yield made
    for component in made.values():
        component.close()


def wire(source: str, target: str) -> Connection:
    return Connection(Port(*source.split(":")), Port(*target.split(":")))


def test_the_robots_wiring_passes(components: dict[str, Component]) -> None:
    check_connections(components, robot_connections(3))


def test_motion_comes_first_and_force_rates_last(components: dict[str, Component]) -> None:
    order = [
        {c.source.variable.split(".")[0] for c in group}
        for group in dependency_groups(components, robot_connections(3))
    ]
    assert order == [{"position", "velocity"}, {"force"}, {"acceleration"}, {"force_rate"}]


@pytest.mark.parametrize(
    ("source", "target", "said"),
    [
        ("winch:speed", "cable_1:winch_speed", "no component 'winch'"),
        ("platform:positon.x", "cable_1:position.x", "no variable 'positon.x'"),
        ("cable_1:winch_speed", "platform:force_1.x", "is input, it must be output"),
        ("platform:position.x", "cable_1:tension", "is output, it must be input"),
        ("platform:position.x", "cable_1:velocity.x", "units differ, 'm' and 'm/s'"),
    ],
)
def test_a_wrong_connection_is_refused(components: dict[str, Component], source: str, target: str, said: str) -> None:
    with pytest.raises(WiringError, match=said):
        check_connections(components, [wire(source, target)])


def test_an_input_has_one_source(components: dict[str, Component]) -> None:
    twice = [wire(f"platform:position.{axis}", "cable_1:position.x") for axis in "xy"]
    with pytest.raises(WiringError, match="also connected to platform"):
        check_connections(components, twice)


def test_a_loop_without_delay_is_named(components: dict[str, Component]) -> None:
    loop = [
        wire("cable_1:force.x", "platform:force_1.x"),
        wire("platform:acceleration.x", "cable_1:acceleration.x"),
        wire("cable_1:force_rate.x", "cable_2:acceleration.y"),
        wire("cable_2:tension_rate", "cable_1:acceleration.y"),
    ]
    dependency_groups(components, loop[:3])
    with pytest.raises(WiringError, match="outputs form an algebraic loop"):
        dependency_groups(components, [*loop, wire("cable_2:force_rate.x", "cable_1:acceleration.z")])


def test_a_rigid_platforms_lacking_derivatives_are_those_of_the_same_attachment() -> None:
    lacking = [Port("platform", f"acceleration_2.{axis}") for axis in "xyz"]
    wiring = wire_robot(2, missing_ports=lacking, is_rigid=True)
    expected = {wire(f"platform:velocity_2.{axis}", f"cable_2:acceleration.{axis}") for axis in "xyz"}
    assert set(wiring.derivative_connections) == expected


def test_each_cable_exchanges_power_at_its_own_attachment() -> None:
    bonds = robot_power_bonds(2, is_rigid=True)
    flows = {(bond.flow.source.variable, bond.effort.target.variable) for bond in bonds}
    assert flows == {(f"velocity_{i}.{axis}", f"force_{i}.{axis}") for i in (1, 2) for axis in "xyz"}
