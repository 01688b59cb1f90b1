"""Connections between FMU variables, and the checks that they are valid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fmpy.model_description import ScalarVariable

from ..errors import TautwireError
from ..fmus.component import Component
from ..fmus.fmi_binding import is_real_scalar, type_name
from ..fmus.fmu_variables import Port
from ..fmus.variable_units import UnitDefinition, same_unit, unit_definition, unit_of


class WiringError(TautwireError):
    """A connection is invalid; the message says which and why."""


@dataclass(frozen=True)
class Connection:
    """An output that drives an input."""

    source: Port
    target: Port

    def __str__(self) -> str:
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True)
class PowerBond:
    """Power bond: two connections whose product is a power, an effort one way (N) and a flow the other way (m/s)."""

    effort: Connection
    flow: Connection


@dataclass(frozen=True, kw_only=True)
class Wiring:
    """The wiring of a coupled system, by the names of components and their variables.

    ``external_inputs`` are the input ports that the master itself sets; ``power_bonds`` are audited for energy;
    ``event_indicators`` are outputs whose zero crossings are state events, see :func:`step_with_events`.
    ``derivative_connections`` are pairs whose target takes the time derivative of the source, estimated from past
    communication points, see :class:`DerivativeEstimator`.
    """

    connections: tuple[Connection, ...]
    external_inputs: tuple[Port, ...] = ()
    power_bonds: tuple[PowerBond, ...] = ()
    event_indicators: tuple[Port, ...] = ()
    derivative_connections: tuple[Connection, ...] = ()


def check_connections(components: Mapping[str, Component], connections: Sequence[Connection]) -> None:
    """Refuse unknown names, wrong causality, different types or units, and inputs connected twice."""
    connections_by_target: dict[Port, Connection] = {}
    for connection in connections:
        source = _variable(components, connection, connection.source, "output")
        target = _variable(components, connection, connection.target, "input")
        _require_real_scalars(connection, source, target)
        source_unit, target_unit = (unit_at(components, end) for end in (connection.source, connection.target))
        if not same_unit(source_unit, target_unit):
            raise WiringError(f"{connection}: units differ, {source_unit[0]!r} and {target_unit[0]!r}")
        if connection.target in connections_by_target:
            raise WiringError(
                f"{connection}: {connection.target} is also connected to "
                f"{connections_by_target[connection.target].source}"
            )
        connections_by_target[connection.target] = connection


def unit_at(components: Mapping[str, Component], port: Port) -> tuple[str | None, UnitDefinition | None]:
    """Unit of a port, with its definition, as the variable or its type states it; None where neither does."""
    component = components[port.component]
    unit = unit_of(component.variables[port.variable])
    return unit, None if unit is None else unit_definition(component.description, unit)


def _variable(
    components: Mapping[str, Component], connection: Connection, port: Port, causality: str
) -> ScalarVariable:
    if port.component not in components:
        raise WiringError(f"{connection}: no component {port.component!r}; there are {', '.join(components)}")
    variable = components[port.component].variables.get(port.variable)
    if variable is None:
        raise WiringError(f"{connection}: {port.component} has no variable {port.variable!r}")
    if variable.causality != causality:
        raise WiringError(f"{connection}: {port} is {variable.causality}, it must be {causality}")
    return variable


def check_derivative_connections(
    components: Mapping[str, Component], derivative_connections: Sequence[Connection]
) -> None:
    """Refuse unknown names, wrong causality and types in pairs whose target takes the derivative of the source."""
    for pair in derivative_connections:
        source = _variable(components, pair, pair.source, "output")
        _require_real_scalars(pair, source, _variable(components, pair, pair.target, "input"))


def _require_real_scalars(connection: Connection, source: ScalarVariable, target: ScalarVariable) -> None:
    if not (is_real_scalar(source) and is_real_scalar(target)):
        type_names = f"{type_name(source)} and {type_name(target)}"
        raise WiringError(f"{connection}: both must be Real or Float64, they are {type_names}")
