"""The graph of a coupled system: which outputs drive which inputs, in which order, and where their values lie."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component
from ..fmus.fmu_variables import INPUT_TIME, MIDDLE_TIME, Port
from ..fmus.variable_units import nominal_of
from .connected_instance import InstanceLayout, LevelLayout
from .connections import Connection, Wiring, check_connections, check_derivative_connections
from .direct_feedthrough import affected_connections, dependency_groups
from .execution_order import convergence_order_of, gauss_seidel_order, takes_middle_inputs, tear_variables
from .hermite_interpolation import DerivativeChain, derivative_chains
from .run_statistics import Fallbacks, find_fallbacks
from .zero_order_hold import inputs_from_discrete_outputs

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class PortIndices:
    """Indices of ports that the solver reads or sets, among all outputs or among all inputs.

    ``effort_outputs``, ``flow_outputs``, ``effort_inputs`` and ``flow_inputs`` are those of the power bonds. The
    outputs at ``derivatives`` are estimated as derivatives of those at ``differentiated_outputs``.
    """

    external_inputs: Indices
    event_indicators: Indices
    effort_outputs: Indices
    flow_outputs: Indices
    effort_inputs: Indices
    flow_inputs: Indices
    differentiated_outputs: Indices
    derivatives: Indices


@dataclass(frozen=True)
class Tearing:
    """Tear variables: their output indices, the instances that take them, and the derivative chains they are in."""

    indices: Indices
    readers: tuple[str, ...]
    chains: tuple[DerivativeChain, ...]


@dataclass(frozen=True)
class DiscontinuousPart:
    """The instances that take external inputs or discrete outputs, which may jump, and the levels where outputs do."""

    instances: tuple[str, ...]
    levels: tuple[LevelLayout, ...]


@dataclass(frozen=True)
class CouplingGraph:
    """The graph of a coupled system of FMU instances; created by :func:`build_coupling_graph`.

    Arrays of all outputs have a value for each of ``output_ports``, then one for each estimated derivative; arrays of
    all inputs have one for each of ``input_ports``. ``nominals`` are the nominal values of ``output_ports``.
    ``instances`` are in execution order, see :func:`gauss_seidel_order`. ``supports_rollback`` is False where some FMU
    cannot save its state, ``supports_variable_step`` also where some FMU takes no variable step: then no step is
    iterated, or split at events. ``convergence_order`` is that of the error in the step size.
    """

    components: Mapping[str, Component]
    external_inputs: tuple[Port, ...]
    output_ports: tuple[Port, ...]
    input_ports: tuple[Port, ...]
    nominals: Array
    instances: tuple[InstanceLayout, ...]
    dependency_levels: tuple[LevelLayout, ...]
    discontinuous_part: DiscontinuousPart
    tearing: Tearing
    port_indices: PortIndices
    fallbacks: Fallbacks
    supports_rollback: bool
    supports_variable_step: bool
    convergence_order: int


def build_coupling_graph(components: Mapping[str, Component], wiring: Wiring) -> CouplingGraph:
    """Build the graph of these components, by name, with this wiring.

    Raises WiringError where a connection is invalid, or outputs form an algebraic loop.
    """
    check_connections(components, wiring.connections)
    check_derivative_connections(components, wiring.derivative_connections)
    output_ports = _output_ports(components, wiring)
    # Estimated derivatives follow all outputs, as outputs of a component without a name.
    derivative_ports = [*map(_derivative_port, _differentiated_ports(wiring))]
    all_connections = [
        *wiring.connections,
        *(Connection(_derivative_port(pair.source), pair.target) for pair in wiring.derivative_connections),
    ]
    input_ports = [port for c in components.values() for port in _input_ports(c, wiring, all_connections)]
    instances = [
        _instance_layout(components[name], all_connections, [*output_ports, *derivative_ports], input_ports)
        for name in gauss_seidel_order(components, wiring.connections, output_ports)
    ]
    groups = dependency_groups(components, wiring.connections)
    supports_rollback = all(c.supports_rollback for c in components.values())
    return CouplingGraph(
        components=dict(components),
        external_inputs=wiring.external_inputs,
        output_ports=tuple(output_ports),
        input_ports=tuple(input_ports),
        nominals=np.array([nominal_of(components[p.component].variables[p.variable]) for p in output_ports]),
        instances=tuple(instances),
        dependency_levels=tuple(_level_layout(group, output_ports) for group in groups),
        discontinuous_part=_discontinuous_part(components, wiring, groups, output_ports),
        tearing=_tearing(components, wiring, instances, output_ports),
        port_indices=_port_indices(wiring, output_ports, input_ports),
        fallbacks=find_fallbacks(components, wiring),
        supports_rollback=supports_rollback,
        supports_variable_step=supports_rollback and all(c.supports_variable_step for c in components.values()),
        convergence_order=convergence_order_of(instances, all_connections),
    )


def _output_ports(components: Mapping[str, Component], wiring: Wiring) -> list[Port]:
    names = list(components)
    connected_outputs = {wire.source for wire in (*wiring.connections, *wiring.derivative_connections)}
    return sorted(connected_outputs | set(wiring.event_indicators), key=lambda p: (names.index(p.component), p))


def _differentiated_ports(wiring: Wiring) -> list[Port]:
    return list(dict.fromkeys(pair.source for pair in wiring.derivative_connections))


def _derivative_port(port: Port) -> Port:
    return Port("", f"rate of {port}")


def _input_ports(component: Component, wiring: Wiring, connections: Sequence[Connection]) -> list[Port]:
    name = component.name
    time_inputs = [Port(name, INPUT_TIME)] * (INPUT_TIME in component.variables)
    time_inputs += [Port(name, MIDDLE_TIME)] * takes_middle_inputs(component, connections)
    external_inputs = [port for port in wiring.external_inputs if port.component == name]
    return [*time_inputs, *external_inputs, *(c.target for c in connections if c.target.component == name)]


def _instance_layout(
    component: Component,
    connections: Sequence[Connection],
    output_ports: Sequence[Port],
    input_ports: Sequence[Port],
) -> InstanceLayout:
    output_slice, input_slice = _slice_of(component.name, output_ports), _slice_of(component.name, input_ports)
    return InstanceLayout(
        component=component,
        output_names=tuple(port.variable for port in output_ports[output_slice]),
        output_slice=output_slice,
        input_names=tuple(port.variable for port in input_ports[input_slice]),
        input_slice=input_slice,
        source_indices=_indices_of(
            output_ports, [c.source for c in connections if c.target.component == component.name]
        ),
        has_input_time=INPUT_TIME in component.variables,
        has_middle_time=takes_middle_inputs(component, connections),
    )


def _slice_of(name: str, ports: Sequence[Port]) -> slice:
    """The slice of a component's ports, which are consecutive."""
    indices = [index for index, port in enumerate(ports) if port.component == name]
    return slice(indices[0], indices[-1] + 1) if indices else slice(0, 0)


def _level_layout(group: Sequence[Connection], output_ports: Sequence[Port]) -> LevelLayout:
    sources = []
    for name in dict.fromkeys(c.source.component for c in group):
        ports = list(dict.fromkeys(c.source for c in group if c.source.component == name))
        sources.append((name, tuple(port.variable for port in ports), _indices_of(output_ports, ports)))
    return LevelLayout(tuple(sources), tuple(dict.fromkeys(c.target.component for c in group)))


def _discontinuous_part(
    components: Mapping[str, Component],
    wiring: Wiring,
    groups: Sequence[Sequence[Connection]],
    output_ports: Sequence[Port],
) -> DiscontinuousPart:
    inputs = [*wiring.external_inputs, *inputs_from_discrete_outputs(components, wiring.connections)]
    affected_groups = affected_connections(components, groups, inputs)
    return DiscontinuousPart(
        tuple(dict.fromkeys(port.component for port in inputs)),
        tuple(_level_layout(group, output_ports) for group in affected_groups),
    )


def _tearing(
    components: Mapping[str, Component],
    wiring: Wiring,
    instances: Sequence[InstanceLayout],
    output_ports: Sequence[Port],
) -> Tearing:
    order = [layout.component.name for layout in instances]
    indices = tear_variables(order, (*wiring.connections, *wiring.derivative_connections), output_ports)
    return Tearing(
        indices,
        tuple(layout.component.name for layout in instances if np.isin(layout.source_indices, indices).any()),
        tuple(derivative_chains(components, output_ports, set(indices.tolist()))),
    )


def _port_indices(wiring: Wiring, output_ports: Sequence[Port], input_ports: Sequence[Port]) -> PortIndices:
    efforts, flows = [bond.effort for bond in wiring.power_bonds], [bond.flow for bond in wiring.power_bonds]
    differentiated_ports = _differentiated_ports(wiring)
    return PortIndices(
        external_inputs=_indices_of(input_ports, wiring.external_inputs),
        event_indicators=_indices_of(output_ports, wiring.event_indicators),
        effort_outputs=_indices_of(output_ports, [c.source for c in efforts]),
        flow_outputs=_indices_of(output_ports, [c.source for c in flows]),
        effort_inputs=_indices_of(input_ports, [c.target for c in efforts]),
        flow_inputs=_indices_of(input_ports, [c.target for c in flows]),
        differentiated_outputs=_indices_of(output_ports, differentiated_ports),
        derivatives=np.arange(len(output_ports), len(output_ports) + len(differentiated_ports)),
    )


def _indices_of(among: Sequence[Port], ports: Sequence[Port]) -> Indices:
    return np.array([among.index(port) for port in ports], dtype=np.intp)
