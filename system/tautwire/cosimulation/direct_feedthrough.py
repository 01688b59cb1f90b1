"""Direct feedthrough of FMUs, and the order in which outputs can be read that depend on each other by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from fmpy.model_description import ScalarVariable

from ..fmus.component import Component
from ..fmus.fmu_variables import Port
from .connections import Connection, WiringError


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
        raise WiringError(f"outputs form an algebraic loop: {loop}") from error


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


def affected_connections(
    components: Mapping[str, Component], groups: Sequence[Sequence[Connection]], changed_inputs: Sequence[Port]
) -> list[list[Connection]]:
    """The connections whose values jump, by direct feedthrough, when the changed inputs do, group by group."""
    feedthrough = {name: direct_feedthrough(component) for name, component in components.items()}
    affected_ports = set(changed_inputs)
    affected_groups = []
    for group in groups:
        affected = [
            c
            for c in group
            if any(
                Port(c.source.component, n) in affected_ports
                for n in feedthrough[c.source.component][c.source.variable]
            )
        ]
        affected_ports |= {c.target for c in affected}
        if affected:
            affected_groups.append(affected)
    return affected_groups
