"""How a robot's components are wired: which output drives which input, what drives them all, what a run shows."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from ..master import Bond, Connection, Port
from .result_file import Column

AXES = ("x", "y", "z")
PLATFORM = "platform"
SHOWN_OF_CABLE = {"tension": "N", "length": "m", "elongation": "m", "strain": "1"}
# By our names; what an FMU does not show of these the master works out from the past of the others.
RATES = {"acceleration": "velocity", "force_rate": "force", "winch_acceleration": "winch_speed"}


@dataclass(frozen=True)
class RobotWiring:
    """The wiring of a robot whose FMUs may lack some ports.

    ``rates`` are pairs whose target takes the rate of change of the source, in place of a connection. ``drives`` are
    driven by those entries of :func:`winch_ports` at ``driven``; ``shown`` are the entries of :func:`shown_ports` at
    ``recorded``, and ``unrecorded`` the columns of the others.
    """

    connections: tuple[Connection, ...]
    rates: tuple[Connection, ...]
    drives: tuple[Port, ...]
    driven: tuple[int, ...]
    bonds: tuple[Bond, ...]
    kinks: tuple[Port, ...]
    shown: tuple[Port, ...]
    recorded: tuple[int, ...]
    unrecorded: tuple[str, ...]


def wiring_of(
    cable_count: int, winches: Collection[int] = (), lacking: Collection[Port] = (), measured: bool = False
) -> RobotWiring:
    """Wire a robot; ``winches`` are the cables that have one, ``lacking`` the ports that are not there.

    ``measured`` tells that the platform shows its position as its sensor does.
    """
    wires = connections(cable_count, winches)
    kept = [wire for wire in wires if wire.source not in lacking and wire.target not in lacking]
    unshown = [wire for wire in wires if wire.source in lacking and wire.target not in lacking]
    kept += _whole(middle_connections(cable_count), lacking)
    driven = _present(winch_ports(cable_count, winches), lacking)
    shown = _present(shown_ports(cable_count, winches, measured), lacking)
    columns = result_columns(cable_count, winches)[1:]
    return RobotWiring(
        connections=tuple(kept),
        rates=tuple(Connection(_value_of(wire.source), wire.target) for wire in unshown),
        drives=tuple(driven.values()),
        driven=tuple(driven),
        bonds=tuple(bonds(cable_count)),
        kinks=tuple(_present(kinks(cable_count, winches), lacking).values()),
        shown=tuple(shown.values()),
        recorded=tuple(shown),
        unrecorded=tuple(c.name for place, c in enumerate(columns) if place not in shown),
    )


def wired_beside(
    wiring: RobotWiring, cable_count: int, wires: Sequence[Connection] = (), also: Sequence[Port] = ()
) -> RobotWiring:
    """The wiring with connections from and to other components, and with inputs ``also`` driven.

    What drives them follows :func:`winch_ports`. A winch's input that is connected is not driven.
    """
    taken = {wire.target for wire in wires}
    kept = {place: port for place, port in zip(wiring.driven, wiring.drives, strict=True) if port not in taken}
    kept |= dict(enumerate(also, start=len(winch_ports(cable_count))))
    connections = (*wiring.connections, *wires)
    return replace(wiring, connections=connections, drives=tuple(kept.values()), driven=tuple(kept))


def _whole(wires: Sequence[Connection], lacking: Collection[Port]) -> list[Connection]:
    """Those into components that get all of theirs; a component takes the middle of a step as a whole or not at all."""
    partly = {wire.target.component for wire in wires if wire.source in lacking or wire.target in lacking}
    return [wire for wire in wires if wire.target.component not in partly]


def _present(ports: Iterable[Port], lacking: Collection[Port]) -> dict[int, Port]:
    return {place: port for place, port in enumerate(ports) if port not in lacking}


def _value_of(rate: Port) -> Port:
    """The output of which another would show the rate."""
    name, dot, axis = rate.variable.partition(".")
    return Port(rate.component, f"{RATES[name]}{dot}{axis}")


def cable_name(index: int) -> str:
    """The component that holds cable ``index``, counted from 1."""
    return f"cable_{index}"


def winch_name(index: int) -> str:
    """The component that holds the winch of cable ``index``, counted from 1."""
    return f"winch_{index}"


def connections(cable_count: int, winches: Collection[int] = ()) -> list[Connection]:
    """Platform motion to every cable, every cable's force to the platform, each with its rates; winches to cables."""
    shared = [f"{name}.{axis}" for axis in AXES for name in ("position", "velocity", "acceleration")]
    own = [(name, axis) for axis in AXES for name in ("force", "force_rate")]
    wires: list[Connection] = []
    for index in range(1, cable_count + 1):
        cable = cable_name(index)
        wires += [_wire(PLATFORM, name, cable, name) for name in shared]
        wires += [_wire(cable, f"{name}.{axis}", PLATFORM, f"{name}_{index}.{axis}") for name, axis in own]
        if index in winches:
            wires += [_wire(winch_name(index), name, cable, name) for name in ("winch_speed", "winch_acceleration")]
    return wires


def middle_connections(cable_count: int) -> list[Connection]:
    """Motion and forces in the middle of the step, which raise its order from four to six.

    Only for a master that sets ``middle_time``; others leave these away.
    """
    shared = [f"middle_{name}.{axis}" for axis in AXES for name in ("position", "velocity", "acceleration")]
    own = [(f"middle_{name}", axis) for axis in AXES for name in ("force", "force_rate")]
    wires: list[Connection] = []
    for index in range(1, cable_count + 1):
        cable = cable_name(index)
        wires += [_wire(PLATFORM, name, cable, name) for name in shared]
        wires += [_wire(cable, f"{name}.{axis}", PLATFORM, f"{name}_{index}.{axis}") for name, axis in own]
    return wires


def _wire(source: str, output: str, target: str, variable: str) -> Connection:
    return Connection(Port(source, output), Port(target, variable))


def winch_ports(cable_count: int, winches: Collection[int] = ()) -> list[Port]:
    """The driven inputs: for each cable the speed asked of its winch and its rate, or rope speed and rate."""
    return [
        Port(winch_name(index), variable) if index in winches else Port(cable_name(index), direct)
        for index in range(1, cable_count + 1)
        for variable, direct in (("speed_command", "winch_speed"), ("speed_command_rate", "winch_acceleration"))
    ]


def shown_ports(cable_count: int, winches: Collection[int] = (), measured: bool = False) -> list[Port]:
    """What a run records: motion of the platform, then of all cables one quantity after the other, then winches."""
    position = "measured_position" if measured else "position"
    platform = [Port(PLATFORM, f"{name}.{axis}") for name in (position, "velocity") for axis in AXES]
    cables = [Port(cable_name(index), name) for name in SHOWN_OF_CABLE for index in range(1, cable_count + 1)]
    return [*platform, *cables, *(Port(winch_name(index), "winch_speed") for index in winches)]


def result_columns(cable_count: int, winches: Collection[int] = (), lacking: Collection[Port] = ()) -> list[Column]:
    """The columns of a result file: the time, then :func:`shown_ports` without those that are lacking."""
    platform = [Column(axis, "m") for axis in AXES] + [Column(f"v{axis}", "m/s") for axis in AXES]
    cables = [Column(f"{name}_{i}", unit) for name, unit in SHOWN_OF_CABLE.items() for i in range(1, cable_count + 1)]
    columns = [*platform, *cables, *(Column(f"winch_speed_{index}", "m/s") for index in winches)]
    ports = shown_ports(cable_count, winches)
    return [Column("time", "s"), *(c for c, port in zip(columns, ports, strict=True) if port not in lacking)]


def bonds(cable_count: int) -> list[Bond]:
    """The power that each cable and the platform exchange, axis by axis."""
    return [
        Bond(
            effort=_wire(cable_name(index), f"force.{axis}", PLATFORM, f"force_{index}.{axis}"),
            flow=_wire(PLATFORM, f"velocity.{axis}", cable_name(index), f"velocity.{axis}"),
        )
        for index in range(1, cable_count + 1)
        for axis in AXES
    ]


def kinks(cable_count: int, winches: Collection[int] = ()) -> list[Port]:
    """Outputs at whose sign changes others have a kink: a cable goes slack or tight, a limit of a winch acts."""
    margins = ("command_margin", "acceleration_margin", "speed_margin")
    return [
        *(Port(cable_name(index), "pull") for index in range(1, cable_count + 1)),
        *(Port(winch_name(index), margin) for index in winches for margin in margins),
    ]
