"""Which output drives which input, checked, and in which order outputs become known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from fmpy.model_description import ScalarVariable

from ..errors import TautwireError
from .component import Component


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
        if source.type != "Real" or target.type != "Real":
            raise WiringError(f"{connection}: both must be Real, they are {source.type} and {target.type}")
        if source.unit and target.unit and source.unit != target.unit:
            raise WiringError(f"{connection}: units differ, {source.unit!r} and {target.unit!r}")
        if connection.target in driven:
            raise WiringError(f"{connection}: {connection.target} is driven by {driven[connection.target].source} too")
        driven[connection.target] = connection


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


def direct_inputs(component: Component) -> dict[str, frozenset[str]]:
    """For each output, the inputs that act on it without delay; all of them where the FMU does not say."""
    inputs = frozenset(v.name for v in component.variables.values() if v.causality == "input")
    found = {v.name: inputs for v in component.variables.values() if v.causality == "output"}
    for unknown in component.description.outputs:
        if unknown.dependencies is not None:
            found[unknown.variable.name] = inputs & {known.name for known in unknown.dependencies}
    return found


def levels(components: Mapping[str, Component], connections: Sequence[Connection]) -> list[list[Connection]]:
    """Connections in groups: those of a group carry outputs that only depend on groups before it.

    Raises WiringError where outputs depend on each other in a loop without delay.
    """
    feeding = {connection.target: connection.source for connection in connections}
    sources = {connection.source for connection in connections}
    direct = {name: direct_inputs(component) for name, component in components.items()}
    depends: dict[Port, set[Port]] = {
        source: {
            feeding[target]
            for target in (Port(source.component, known) for known in direct[source.component][source.variable])
            if target in feeding
        }
        for source in sources
    }
    sorter = TopologicalSorter(depends)
    try:
        sorter.prepare()
    except CycleError as error:
        loop = " -> ".join(str(port) for port in error.args[1])
        raise WiringError(f"outputs depend on each other without delay: {loop}") from error
    groups = []
    while sorter.is_active():
        ready = set(sorter.get_ready())
        groups.append([connection for connection in connections if connection.source in ready])
        sorter.done(*ready)
    return groups
