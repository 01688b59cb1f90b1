"""In which order the components take their turns in a pass, and what that makes of their outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .component import Component
from .seat import Places
from .wiring import Connection, Port, direct_inputs


def gauss_seidel_order(
    components: Mapping[str, Component], connections: Sequence[Connection], shown: Sequence[Port]
) -> list[str]:
    """Components that show some output without waiting for an input go first, unless fewer outputs are then guessed.

    One after the other goes last where that leaves fewer outputs that are used before they are found.
    """
    fed = {(c.target.component, c.target.variable) for c in connections}

    def waits(name: str) -> bool:
        direct = direct_inputs(components[name])
        own = [port.variable for port in shown if port.component == name]
        return all(any((name, known) in fed for known in direct[variable]) for variable in own)

    order = sorted(components, key=waits)
    for name in tuple(order):
        other = [*(kept for kept in order if kept != name), name]
        if len(fed_back(other, connections, shown)) < len(fed_back(order, connections, shown)):
            order = other
    return order


def fed_back(order: Sequence[str], connections: Sequence[Connection], shown: Sequence[Port]) -> Places:
    """Places of the outputs that a pass in this order uses before it has found them."""
    turn = {name: number for number, name in enumerate(order)}
    back = {c.source for c in connections if turn[c.source.component] >= turn[c.target.component]}
    return np.array([place for place, port in enumerate(shown) if port in back], dtype=np.intp)


def downstream(
    components: Mapping[str, Component], groups: Sequence[Sequence[Connection]], drives: Sequence[Port]
) -> list[list[Connection]]:
    """The connections whose values change at once when a driven input changes, group by group."""
    direct = {name: direct_inputs(component) for name, component in components.items()}
    touched = set(drives)
    found = []
    for group in groups:
        moved = [
            c
            for c in group
            if any(Port(c.source.component, n) in touched for n in direct[c.source.component][c.source.variable])
        ]
        touched |= {c.target for c in moved}
        if moved:
            found.append(moved)
    return found
