"""Which output drives which input, checked, and in which order outputs become known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from fmpy.model_description import ScalarVariable

from ..errors import TautwireError
from .component import Component
from .standard import is_real, kind_of
from .units import Measure, measure, same_unit, unit_of


class WiringError(TautwireError):
    """A connection does not fit; tells which and why."""


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


def check(components: Mapping[str, Component], connections: Sequence[Connection]) -> None:
    """Refuse unknown names, wrong causality, unlike types or units, and inputs driven twice."""
    driven: dict[Port, Connection] = {}
    for connection in connections:
        source = _variable(components, connection, connection.source, "output")
        target = _variable(components, connection, connection.target, "input")
        _require_reals(connection, source, target)
        given, taken = (_unit(components, end) for end in (connection.source, connection.target))
        if not same_unit(given, taken):
            raise WiringError(f"{connection}: units differ, {given[0]!r} and {taken[0]!r}")
        if connection.target in driven:
            raise WiringError(f"{connection}: {connection.target} is driven by {driven[connection.target].source} too")
        driven[connection.target] = connection


def _unit(components: Mapping[str, Component], port: Port) -> tuple[str | None, Measure | None]:
    component = components[port.component]
    unit = unit_of(component.variables[port.variable])
    return unit, None if unit is None else measure(component.description, unit)


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


def check_rates(components: Mapping[str, Component], rates: Sequence[Connection]) -> None:
    """Refuse unknown names, wrong causality and types in pairs whose target takes the rate of the source."""
    for pair in rates:
        source = _variable(components, pair, pair.source, "output")
        _require_reals(pair, source, _variable(components, pair, pair.target, "input"))


def _require_reals(connection: Connection, source: ScalarVariable, target: ScalarVariable) -> None:
    if not (is_real(source) and is_real(target)):
        kinds = f"{kind_of(source)} and {kind_of(target)}"
        raise WiringError(f"{connection}: both must be Real or Float64, they are {kinds}")


def direct_inputs(component: Component, unsaid: bool = True) -> dict[str, frozenset[str]]:
    """For each output, the inputs that act on it without delay.

    Where the FMU does not say, all of them, or none where ``unsaid`` is False.
    """
    inputs = [v for v in component.variables.values() if v.causality == "input"]
    everything = {_identity(v) for v in inputs}
    said = {
        _identity(unknown.variable): {_identity(known) for known in unknown.dependencies}
        for unknown in component.description.outputs
        if unknown.dependencies is not None
    }
    undeclared = everything if unsaid else set()
    outputs = [v for v in component.variables.values() if v.causality == "output"]
    return {
        v.name: frozenset(known.name for known in inputs if _identity(known) in said.get(_identity(v), undeclared))
        for v in outputs
    }


def _identity(variable: ScalarVariable) -> tuple[str, int]:
    """The same for all names of a variable, of which FMI 3.0 lists dependencies under one only."""
    return variable.type, variable.valueReference


def levels(components: Mapping[str, Component], connections: Sequence[Connection]) -> list[list[Connection]]:
    """Connections in groups: those of a group carry outputs that only depend on groups before it.

    An FMU that does not say what its outputs depend on is taken to delay all of its inputs, if else there was a loop.

    Raises WiringError where outputs depend on each other in a loop without delay.
    """
    try:
        return _grouped(components, connections, unsaid=True)
    except CycleError:
        pass
    try:
        return _grouped(components, connections, unsaid=False)
    except CycleError as error:
        loop = " -> ".join(str(port) for port in error.args[1])
        raise WiringError(f"outputs depend on each other without delay: {loop}") from error


def _grouped(
    components: Mapping[str, Component], connections: Sequence[Connection], unsaid: bool
) -> list[list[Connection]]:
    feeding = {connection.target: connection.source for connection in connections}
    sources = {connection.source for connection in connections}
    direct = {name: direct_inputs(component, unsaid) for name, component in components.items()}
    depends: dict[Port, set[Port]] = {
        source: {
            feeding[target]
            for target in (Port(source.component, known) for known in direct[source.component][source.variable])
            if target in feeding
        }
        for source in sources
    }
    sorter = TopologicalSorter(depends)
    sorter.prepare()
    groups = []
    while sorter.is_active():
        ready = set(sorter.get_ready())
        groups.append([connection for connection in connections if connection.source in ready])
        sorter.done(*ready)
    return groups
