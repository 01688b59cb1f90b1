"""The connections of a robot's FMUs, their external inputs, event indicators and recorded outputs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from ..fmus.fmu_variables import Port
from ..robot.schema import AXES
from .connections import Connection, PowerBond, Wiring
from .result_file import Column

PLATFORM = "platform"
ORIENTATION_AXES = ("w", "x", "y", "z")
# Columns of the platform's pose and its rate, with their units; those of the second only where it turns.
POINT_COLUMNS = {**dict.fromkeys(AXES, "m"), **{f"v{axis}": "m/s" for axis in AXES}}
TURNING_COLUMNS = {**{f"q{part}": "1" for part in ORIENTATION_AXES}, **{f"w{axis}": "rad/s" for axis in AXES}}
CABLE_QUANTITIES = {"tension": "N", "length": "m", "elongation": "m", "strain": "1"}
# Derivative and quantity; derivatives that an FMU does not provide are estimated from past values.
DERIVATIVES = {"acceleration": "velocity", "force_rate": "force", "winch_acceleration": "winch_speed"}


@dataclass(frozen=True, kw_only=True)
class RobotWiring(Wiring):
    """The wiring of a robot whose FMUs may lack some ports, and its recorded outputs.

    ``external_inputs`` are the entries of :func:`winch_input_ports` at ``external_indices``; ``outputs`` are the
    entries of :func:`recorded_ports` at ``output_indices``, in ``output_units``, and ``missing_columns`` the columns of
    the others.
    """

    external_indices: tuple[int, ...]
    outputs: tuple[Port, ...]
    output_indices: tuple[int, ...]
    output_units: tuple[str, ...]
    missing_columns: tuple[str, ...]


def wire_robot(
    cable_count: int,
    winches: Collection[int] = (),
    missing_ports: Collection[Port] = (),
    measured: bool = False,
    is_rigid: bool = False,
) -> RobotWiring:
    """Wire a robot; ``winches`` are the cables that have one, ``missing_ports`` those that its FMUs lack.

    With ``measured`` the recorded position is that of the platform's sensor. The platform is a point mass, or turns if
    it ``is_rigid``: then each cable gets the motion of its own attachment.
    """
    wires = robot_connections(cable_count, winches, is_rigid)
    available = [wire for wire in wires if wire.source not in missing_ports and wire.target not in missing_ports]
    underived = [wire for wire in wires if wire.source in missing_ports and wire.target not in missing_ports]
    available += _complete_targets(midpoint_connections(cable_count, is_rigid), missing_ports)
    external_inputs = _available_ports(winch_input_ports(cable_count, winches), missing_ports)
    outputs = _available_ports(recorded_ports(cable_count, winches, measured, is_rigid), missing_ports)
    columns = result_columns(cable_count, winches, is_rigid=is_rigid)[1:]
    return RobotWiring(
        connections=tuple(available),
        derivative_connections=tuple(Connection(_antiderivative_port(wire.source), wire.target) for wire in underived),
        external_inputs=tuple(external_inputs.values()),
        external_indices=tuple(external_inputs),
        power_bonds=tuple(robot_power_bonds(cable_count, is_rigid)),
        event_indicators=tuple(_available_ports(event_indicator_ports(cable_count, winches), missing_ports).values()),
        outputs=tuple(outputs.values()),
        output_indices=tuple(outputs),
        output_units=tuple(columns[index].unit for index in outputs),
        missing_columns=tuple(c.name for index, c in enumerate(columns) if index not in outputs),
    )


def with_connections(
    wiring: RobotWiring, cable_count: int, wires: Sequence[Connection] = (), external_inputs: Sequence[Port] = ()
) -> RobotWiring:
    """The wiring with further connections to other components, and with further ``external_inputs``.

    Their values follow those of :func:`winch_input_ports`. A winch's input that is connected is no longer external.
    """
    connected_inputs = {wire.target for wire in wires}
    all_external_inputs = {
        index: port
        for index, port in zip(wiring.external_indices, wiring.external_inputs, strict=True)
        if port not in connected_inputs
    }
    all_external_inputs |= dict(enumerate(external_inputs, start=len(winch_input_ports(cable_count))))
    all_connections = (*wiring.connections, *wires)
    return replace(
        wiring,
        connections=all_connections,
        external_inputs=tuple(all_external_inputs.values()),
        external_indices=tuple(all_external_inputs),
    )


def _complete_targets(wires: Sequence[Connection], missing_ports: Collection[Port]) -> list[Connection]:
    """Connections into components that get all of theirs: midpoint inputs are connected completely or not at all."""
    incomplete = {
        wire.target.component for wire in wires if wire.source in missing_ports or wire.target in missing_ports
    }
    return [wire for wire in wires if wire.target.component not in incomplete]


def _available_ports(ports: Iterable[Port], missing_ports: Collection[Port]) -> dict[int, Port]:
    return {index: port for index, port in enumerate(ports) if port not in missing_ports}


def _antiderivative_port(derivative: Port) -> Port:
    """The output whose time derivative another port is."""
    name, dot, axis = derivative.variable.partition(".")
    stem, underscore, number = (name, "", "") if name in DERIVATIVES else name.rpartition("_")
    return Port(derivative.component, f"{DERIVATIVES[stem]}{underscore}{number}{dot}{axis}")


def cable_name(index: int) -> str:
    """The component that holds cable ``index``, counted from 1."""
    return f"cable_{index}"


def winch_name(index: int) -> str:
    """The component that holds the winch of cable ``index``, counted from 1."""
    return f"winch_{index}"


def robot_connections(cable_count: int, winches: Collection[int] = (), is_rigid: bool = False) -> list[Connection]:
    """Platform motion to every cable, every cable's force to the platform, each with its rates; winches to cables."""
    wires: list[Connection] = []
    for index in range(1, cable_count + 1):
        wires += _cable_connections(index, "", is_rigid)
        if index in winches:
            names = ("winch_speed", "winch_acceleration")
            wires += [_wire(winch_name(index), name, cable_name(index), name) for name in names]
    return wires


def midpoint_connections(cable_count: int, is_rigid: bool = False) -> list[Connection]:
    """Motion and forces at the midpoint of the step, which raise its order from four to six.

    Only for a master that sets ``middle_time``; others omit these.
    """
    return [wire for index in range(1, cable_count + 1) for wire in _cable_connections(index, "middle_", is_rigid)]


def _cable_connections(index: int, prefix: str, is_rigid: bool) -> list[Connection]:
    """Motion of the point that a cable holds, to it, and its force from it, with their rates."""
    cable, suffix = cable_name(index), attachment_suffix(index, is_rigid)
    motion, forces = ("position", "velocity", "acceleration"), ("force", "force_rate")
    return [
        *(
            _wire(PLATFORM, f"{prefix}{n}{suffix}.{axis}", cable, f"{prefix}{n}.{axis}")
            for axis in AXES
            for n in motion
        ),
        *(
            _wire(cable, f"{prefix}{n}.{axis}", PLATFORM, f"{prefix}{n}_{index}.{axis}")
            for axis in AXES
            for n in forces
        ),
    ]


def attachment_suffix(index: int, is_rigid: bool) -> str:
    """What ends the names of the platform's outputs for cable ``index``: a point mass has one point for all."""
    return f"_{index}" if is_rigid else ""


def _wire(source: str, output: str, target: str, variable: str) -> Connection:
    return Connection(Port(source, output), Port(target, variable))


def winch_input_ports(cable_count: int, winches: Collection[int] = ()) -> list[Port]:
    """The external inputs: for each cable the speed command of its winch and its rate, or rope speed and its rate."""
    return [
        Port(winch_name(index), variable) if index in winches else Port(cable_name(index), direct)
        for index in range(1, cable_count + 1)
        for variable, direct in (("speed_command", "winch_speed"), ("speed_command_rate", "winch_acceleration"))
    ]


def recorded_ports(
    cable_count: int, winches: Collection[int] = (), measured: bool = False, is_rigid: bool = False
) -> list[Port]:
    """The recorded outputs: motion of the platform, then of all cables one quantity after the other, then winches."""
    position = "measured_position" if measured else "position"
    platform = [Port(PLATFORM, f"{name}.{axis}") for name in (position, "velocity") for axis in AXES]
    if is_rigid:
        platform += [Port(PLATFORM, f"orientation.{part}") for part in ORIENTATION_AXES]
        platform += [Port(PLATFORM, f"angular_velocity.{axis}") for axis in AXES]
    cables = [Port(cable_name(index), name) for name in CABLE_QUANTITIES for index in range(1, cable_count + 1)]
    return [*platform, *cables, *(Port(winch_name(index), "winch_speed") for index in winches)]


def measured_output_indices(cable_count: int, is_rigid: bool = False) -> list[int]:
    """Indices of what a controller measures among :func:`recorded_ports`: position, orientation and tensions."""
    first_cable = len(POINT_COLUMNS) + (len(TURNING_COLUMNS) if is_rigid else 0)
    orientation = range(len(POINT_COLUMNS), len(POINT_COLUMNS) + len(ORIENTATION_AXES)) if is_rigid else ()
    return [*range(len(AXES)), *orientation, *range(first_cable, first_cable + cable_count)]


def result_columns(
    cable_count: int, winches: Collection[int] = (), missing_ports: Collection[Port] = (), is_rigid: bool = False
) -> list[Column]:
    """The columns of a result file: the time, then :func:`recorded_ports` without the missing ones."""
    platform = [Column(*item) for item in (POINT_COLUMNS | (TURNING_COLUMNS if is_rigid else {})).items()]
    cables = [Column(f"{name}_{i}", unit) for name, unit in CABLE_QUANTITIES.items() for i in range(1, cable_count + 1)]
    columns = [*platform, *cables, *(Column(f"winch_speed_{index}", "m/s") for index in winches)]
    ports = recorded_ports(cable_count, winches, is_rigid=is_rigid)
    return [Column("time", "s"), *(c for c, port in zip(columns, ports, strict=True) if port not in missing_ports)]


def robot_power_bonds(cable_count: int, is_rigid: bool = False) -> list[PowerBond]:
    """The power that each cable and the platform exchange, axis by axis."""
    return [
        PowerBond(
            effort=_wire(cable_name(index), f"force.{axis}", PLATFORM, f"force_{index}.{axis}"),
            flow=_wire(
                PLATFORM,
                f"velocity{attachment_suffix(index, is_rigid)}.{axis}",
                cable_name(index),
                f"velocity.{axis}",
            ),
        )
        for index in range(1, cable_count + 1)
        for axis in AXES
    ]


def event_indicator_ports(cable_count: int, winches: Collection[int] = ()) -> list[Port]:
    """Event indicators: outputs that cross zero when a cable goes slack or tight, or a limit of a winch acts."""
    margins = ("command_margin", "acceleration_margin", "speed_margin")
    return [
        *(Port(cable_name(index), "pull") for index in range(1, cable_count + 1)),
        *(Port(winch_name(index), margin) for index in winches for margin in margins),
    ]
