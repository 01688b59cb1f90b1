"""Polynomials through the values of outputs and of their rates at some times."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .component import Component
from .seat import MIDDLE
from .wiring import Port

Array = NDArray[np.float64]
Places = NDArray[np.intp]


@dataclass(frozen=True)
class Chain:
    """An output, its rate, the rate of that and so on: their places among the outputs shown.

    ``ends`` are those at a communication point, ``middles`` those in the middle of the last step, None where it is
    not shown.
    """

    ends: tuple[int, ...]
    middles: tuple[int, ...] | None


def chains_of(components: Mapping[str, Component], shown: Sequence[Port], wanted: Collection[int]) -> list[Chain]:
    """The chains of all outputs at the ``wanted`` places; FMUs declare which output is the rate of which."""
    places = {port: place for place, port in enumerate(shown)}
    rates = {}
    for port in shown:
        variable = components[port.component].variables[port.variable] if port.component else None
        if variable is not None and variable.derivative is not None:
            value = Port(port.component, variable.derivative.name)
            if value in places:
                rates[value] = port
    behind = {*rates.values(), *(_middle_of(port) for port in shown if _middle_of(port) in places)}
    found = []
    for port in (port for port in shown if port not in behind):
        ports = [port]
        while ports[-1] in rates:
            ports.append(rates[ports[-1]])
        ends = tuple(places[port] for port in ports)
        middles = tuple(places.get(_middle_of(port), -1) for port in ports)
        if not {*ends, *middles}.isdisjoint(wanted):
            found.append(Chain(ends, None if -1 in middles else middles))
    return found


def _middle_of(port: Port) -> Port:
    return Port(port.component, f"{MIDDLE}{port.variable}")


@lru_cache(maxsize=256)
def shares(times: tuple[float, ...], count: int, at: tuple[float, ...]) -> Array:
    """Of values and rates at ``times`` in those of the polynomial through them at the times ``at``.

    ``count`` are the value and the rates that are known at each time, and asked for; rates are by the unit of the
    times. Shape (number of ``at``, count, number of ``times``, count), not to be written to.
    """
    powers = _powers(np.array([*times, *at]), count, count * len(times))
    known, asked = powers[: count * len(times)], powers[count * len(times) :]
    found: Array = np.linalg.solve(known.T, asked.T).T.reshape(len(at), count, len(times), count)
    found.flags.writeable = False
    return found


def scaled(found: Array, unit: float) -> Array:
    """What :func:`shares` has found in a ``unit`` of time (s), for rates by the second."""
    scales = unit ** np.arange(found.shape[-1])
    weights: Array = found * scales / scales[:, None, None]
    return weights


def _powers(times: Array, count: int, terms: int) -> Array:
    """The powers of each time and their rates, shape (number of times x count, terms)."""
    factors = np.ones((count, terms))
    for k in range(1, count):
        factors[k] = factors[k - 1] * np.maximum(np.arange(terms) - k + 1, 0)
    exponents = np.maximum(np.arange(terms) - np.arange(count)[:, None], 0)
    powers: Array = (factors * times[:, None, None] ** exponents).reshape(-1, terms)
    return powers
