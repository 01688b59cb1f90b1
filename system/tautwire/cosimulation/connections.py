"""Connections between FMU variables, checked and sorted topologically by direct feedthrough."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from fmpy.model_description import ScalarVariable

from ..errors import TautwireError
from ..fmus.component import Component
from ..fmus.fmi_binding import is_real_scalar, type_name
from ..fmus.variable_units import UnitDefinition, same_unit, unit_definition, unit_of


class WiringError(TautwireError):
    """A connection is invalid; the message says which and why."""


@dataclass(frozen=True, order=True)
class Port:
    """A variable of a component, both by name."""

    component: str
    variable: str

    def __str__(self) -> str:
        return f"{self.component}.{self.variable}"


@dataclass(frozen=True)
class Connection:
    """An output that drives an input."""

    source: Port
    target: Port

    def __str__(self) -> str:
        return f"{self.source} -> {self.target}"


def check_connections(components: Mapping[str, Component], connections: Sequence[Connection]) -> None:
    """Refuse unknown names, wrong causality, different types or units, and inputs connected twice."""
    connections_by_target: dict[Port, Connection] = {}
    for connection in connections:
        source = _variable(components, connection, connection.source, "output")
        target = _variable(components, connection, connection.target, "input")
        _require_real_scalars(connection, source, target)
        source_unit, target_unit = (_unit(components, end) for end in (connection.source, connection.target))
        if not same_unit(source_unit, target_unit):
            raise WiringError(f"{connection}: units differ, {source_unit[0]!r} and {target_unit[0]!r}")
        if connection.target in connections_by_target:
            raise WiringError(
                f"{connection}: {connection.target} is driven by {connections_by_target[connection.target].source} too"
            )
        connections_by_target[connection.target] = connection


def _unit(components: Mapping[str, Component], port: Port) -> tuple[str | None, UnitDefinition | None]:
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


def direct_feedthrough(component: Component, assume_feedthrough: bool = True) -> dict[str, frozenset[str]]:
    """Direct feedthrough: for each output, the inputs that act on it without delay.

    Where the FMU does not declare it, all inputs, or none where ``assume_feedthrough`` is False.
    """
    inputs = [v for v in component.variables.values() if v.causality == "input"]
    all_inputs = {_variable_key(v) for v in inputs}
    declared = {
        _variable_key(unknown.variable): {_variable_key(known) for known in unknown.dependencies}
        for unknown in component.description.outputs
        if unknown.dependencies is not None
    }
    undeclared = all_inputs if assume_feedthrough else set()
    outputs = [v for v in component.variables.values() if v.causality == "output"]
    return {
        v.name: frozenset(
            known.name for known in inputs if _variable_key(known) in declared.get(_variable_key(v), undeclared)
        )
        for v in outputs
    }


def _variable_key(variable: ScalarVariable) -> tuple[str, int]:
    """A key shared by all aliases of a variable, of which FMI 3.0 lists dependencies under one only."""
    return variable.type, variable.valueReference


def dependency_groups(components: Mapping[str, Component], connections: Sequence[Connection]) -> list[list[Connection]]:
    """Connections grouped topologically: outputs of a group depend on groups before it only.

    An FMU that does not declare its dependencies is taken to have no direct feedthrough where there were an algebraic
    loop otherwise.

    Raises WiringError where declared dependencies make an algebraic loop.
    """
    try:
        return _topological_groups(components, connections, assume_feedthrough=True)
    except CycleError:
        pass
    try:
        return _topological_groups(components, connections, assume_feedthrough=False)
    except CycleError as error:
        loop = " -> ".join(str(port) for port in error.args[1])
        raise WiringError(f"outputs depend on each other without delay: {loop}") from error


def _topological_groups(
    components: Mapping[str, Component], connections: Sequence[Connection], assume_feedthrough: bool
) -> list[list[Connection]]:
    source_of_target = {connection.target: connection.source for connection in connections}
    sources = {connection.source for connection in connections}
    feedthrough = {name: direct_feedthrough(component, assume_feedthrough) for name, component in components.items()}
    dependencies: dict[Port, set[Port]] = {
        source: {
            source_of_target[target]
            for target in (Port(source.component, known) for known in feedthrough[source.component][source.variable])
            if target in source_of_target
        }
        for source in sources
    }
    sorter = TopologicalSorter(dependencies)
    sorter.prepare()
    groups = []
    while sorter.is_active():
        ready = set(sorter.get_ready())
        groups.append([connection for connection in connections if connection.source in ready])
        sorter.done(*ready)
    return groups
