"""From a robot to what the laws take: constants and active effects of each component."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tautwire_fmu.laws.cable import LAWS, CableConstants
from tautwire_fmu.laws.effects import ActiveEffect
from tautwire_fmu.laws.point_mass import PointMassConstants

from .robot import Robot
from .statics import active, platform_effects, static_tensions


@dataclass(frozen=True)
class CableComponent:
    """One cable: what is declared of it, and the effects that act in it."""

    constants: CableConstants
    effects: tuple[ActiveEffect, ...]


@dataclass(frozen=True)
class Assembly:
    """A robot as the laws see it; positions in m."""

    cables: tuple[CableComponent, ...]
    platform: PointMassConstants
    platform_effects: tuple[ActiveEffect, ...]
    start: tuple[float, float, float]


def assemble(robot: Robot, start_tensions: Sequence[Any] | None = None) -> Assembly:
    """Gather constants and effects; the static start gives the tensions where none are handed in.

    Raises UnreachableError where the cables cannot hold the platform at its start.
    """
    tensions = static_tensions(robot) if start_tensions is None else start_tensions
    start = np.array(robot.platform.start)
    cables = tuple(
        CableComponent(
            constants=CableConstants(
                law=LAWS[cable.law],
                anchor=cable.anchor,
                modulus=cable.modulus,
                area=cable.area,
                damping=cable.damping,
                start_length=float(np.linalg.norm(np.array(cable.anchor) - start)),
                start_tension=tension,
            ),
            effects=tuple(active(s) for s in robot.effects_on_cable(index)),
        )
        for index, (cable, tension) in enumerate(zip(robot.cables, tensions, strict=True), start=1)
    )
    return Assembly(
        cables=cables,
        platform=PointMassConstants(robot.platform.mass, robot.gravity),
        platform_effects=platform_effects(robot),
        start=robot.platform.start,
    )
