"""Hermite interpolation of outputs from their values and derivatives at communication points."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..fmus.component import Component
from ..fmus.fmu_variables import MIDDLE_PREFIX, Port

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class DerivativeChain:
    """An output and its successive time derivatives, as indices into the outputs.

    ``ends`` are those at a communication point, ``midpoints`` those at the midpoint of the last step, None where the
    FMU has no such outputs.
    """

    ends: tuple[int, ...]
    midpoints: tuple[int, ...] | None


def derivative_chains(
    components: Mapping[str, Component], output_ports: Sequence[Port], selected: Collection[int]
) -> list[DerivativeChain]:
    """The derivative chains of the ``selected`` outputs; FMUs declare which output is the derivative of which."""
    indices = {port: index for index, port in enumerate(output_ports)}
    derivative_ports = {}
    for port in output_ports:
        variable = components[port.component].variables[port.variable] if port.component else None
        if variable is not None and variable.derivative is not None:
            value = Port(port.component, variable.derivative.name)
            if value in indices:
                derivative_ports[value] = port
    derived_ports = {
        *derivative_ports.values(),
        *(_midpoint_port(port) for port in output_ports if _midpoint_port(port) in indices),
    }
    chains = []
    for port in (port for port in output_ports if port not in derived_ports):
        ports = [port]
        while ports[-1] in derivative_ports:
            ports.append(derivative_ports[ports[-1]])
        ends = tuple(indices[port] for port in ports)
        midpoints = tuple(indices.get(_midpoint_port(port), -1) for port in ports)
        if not {*ends, *midpoints}.isdisjoint(selected):
            chains.append(DerivativeChain(ends, None if -1 in midpoints else midpoints))
    return chains


def _midpoint_port(port: Port) -> Port:
    return Port(port.component, f"{MIDDLE_PREFIX}{port.variable}")


@lru_cache(maxsize=256)
def hermite_weights(times: tuple[float, ...], derivative_count: int, at: tuple[float, ...]) -> Array:
    """Weights that evaluate the Hermite interpolant at ``at`` from values and derivatives at ``times``.

    ``derivative_count`` counts the value and its derivatives, known at each of ``times`` and evaluated at each of
    ``at``; derivatives are with respect to the unit of the times. Shape (number of ``at``, derivative_count, number of
    ``times``, derivative_count), not to be written to.
    """
    powers = _power_rows(np.array([*times, *at]), derivative_count, derivative_count * len(times))
    at_nodes, at_targets = powers[: derivative_count * len(times)], powers[derivative_count * len(times) :]
    weights: Array = np.linalg.solve(at_nodes.T, at_targets.T).T.reshape(
        len(at), derivative_count, len(times), derivative_count
    )
    weights.flags.writeable = False
    return weights


def scale_weights(weights: Array, time_unit: float) -> Array:
    """Weights of :func:`hermite_weights` with times in a ``time_unit`` (s), scaled for derivatives by the second."""
    scales = time_unit ** np.arange(weights.shape[-1])
    scaled_weights: Array = weights * scales / scales[:, None, None]
    return scaled_weights


def _power_rows(times: Array, count: int, terms: int) -> Array:
    """The powers of each time and their derivatives, shape (number of times x count, terms)."""
    factors = np.ones((count, terms))
    for k in range(1, count):
        factors[k] = factors[k - 1] * np.maximum(np.arange(terms) - k + 1, 0)
    exponents = np.maximum(np.arange(terms) - np.arange(count)[:, None], 0)
    powers: Array = (factors * times[:, None, None] ** exponents).reshape(-1, terms)
    return powers
