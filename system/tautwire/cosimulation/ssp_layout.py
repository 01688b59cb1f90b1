"""Layout of a robot's block diagram: winches on the left, then one cable below the other, the platform on the right."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from .robot_wiring import PLATFORM

# Units of the diagram, which SSP leaves open.
BLOCK_HEIGHT, GAP = 30.0, 10.0
WINCH_COLUMN, CABLE_COLUMN, PLATFORM_COLUMN = (20.0, 60.0), (90.0, 130.0), (170.0, 210.0)
WIDTH = 230.0


class Rectangle(NamedTuple):
    """Lower left and upper right corner of a block; y points up."""

    x1: float
    y1: float
    x2: float
    y2: float


def system_rectangle(cable_count: int) -> Rectangle:
    """Rectangle that holds all blocks."""
    return Rectangle(0.0, 0.0, WIDTH, GAP + cable_count * (BLOCK_HEIGHT + GAP))


def component_rectangle(name: str, cable_count: int) -> Rectangle:
    """Rectangle of a component: ``platform``, ``cable_i`` or ``winch_i``, the first ones at the top."""
    top = system_rectangle(cable_count).y2 - GAP
    if name == PLATFORM:
        return Rectangle(PLATFORM_COLUMN[0], GAP, PLATFORM_COLUMN[1], top)
    kind, _, number = name.rpartition("_")
    left, right = WINCH_COLUMN if kind == "winch" else CABLE_COLUMN
    upper_edge = top - (int(number) - 1) * (BLOCK_HEIGHT + GAP)
    return Rectangle(left, upper_edge - BLOCK_HEIGHT, right, upper_edge)


def connector_positions(kinds: Sequence[str]) -> list[tuple[float, float]]:
    """Positions of the connectors of a block, in its width and height: inputs on the left, all others on the right.

    ``kinds`` are their causalities; those of a side come from the top, at equal distances.
    """
    sides = [float(kind != "input") for kind in kinds]
    return [(side, 1.0 - (sides[:index].count(side) + 0.5) / sides.count(side)) for index, side in enumerate(sides)]
