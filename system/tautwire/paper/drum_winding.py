"""Quasi-static model of a rope wound on a drum, against which both tension laws are compared.

A rope between exit point and platform holds the material ``L`` (its length under the start tension ``T0``) and is ``l``
long, so its strain is ``e = l / L - 1`` and ``T = T0 + E S e``. While the drum winds at the speed V, rope of the span's
strain comes onto it, and friction keeps that strain:

    reeling in    dL/dt = -V / (1 + e)            the strain e of the span now
    paying out    dL/dt = -V / (1 + e_w(s))       the strain e_w with which the position s on the drum was wound

Rope that lay on the drum at the start was wound at T0: ``e_w = 0``. The logarithmic law takes the span's strain both
ways, the linear one none both ways: each is right in one direction, the linear one only for rope wound at T0.

The platform moves quasi-statically: at each time the tensions balance its weight and the path's inertia. Nothing of the
FMUs' laws is used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from ..robot.static_equilibrium import static_tensions
from ..robot.trajectory import Trajectory
from ..robot.winch_speeds import ideal_winch_speeds
from .simulation_records import reeled_length

Array = NDArray[np.float64]

MAX_NEWTON_ITERATIONS, NEWTON_TOLERANCE, STRAIN_ITERATIONS = 12, 1e-12, 2


@dataclass
class DrumWinding:
    """The rope on one drum: material (m) over wound length (m) since the start, one point for each sample wound."""

    wound: list[float] = field(default_factory=lambda: [0.0])
    material: list[float] = field(default_factory=lambda: [0.0])

    def material_after(self, wound: float, strain: float) -> float:
        """Material on the drum with ``wound`` on it, if rope that comes onto it now has this strain."""
        if wound >= self.wound[-1]:
            return self.material[-1] + (wound - self.wound[-1]) / (1.0 + strain)
        if wound <= self.wound[0]:
            return self.material[0] + wound - self.wound[0]
        return float(np.interp(wound, self.wound, self.material))

    def wind(self, wound: float, strain: float) -> None:
        """Reel in or pay out until ``wound`` is on the drum."""
        material = self.material_after(wound, strain)
        while self.wound and self.wound[-1] >= wound:
            self.wound.pop()
            self.material.pop()
        self.wound.append(wound)
        self.material.append(material)


@dataclass(frozen=True)
class QuasiStaticMotion:
    """Slow motion: ``position`` (N, 3) and ``elongation`` (N, n), the paper's r, in m; ``tension`` (N, n) in N."""

    time: Array
    position: Array
    tension: Array
    elongation: Array


def follow_path(robot: Robot, path: Trajectory, time: Array, law: str) -> QuasiStaticMotion:
    """Quasi-static motion under the winch speeds of inelastic cables along a path.

    ``law`` of the ropes is exact, logarithmic or linear; ``time`` (N,) in s from the start of the path.
    """
    anchors, start_tension = np.array(robot.anchors), static_tensions(robot)
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    reeled = reeled_length(time, ideal_winch_speeds(robot, path, time))
    load = robot.platform.mass * (path.acceleration(time) + np.array([0.0, 0.0, robot.gravity]))
    position = np.array(robot.platform.start)
    start = np.linalg.norm(anchors - position, axis=1)
    reels = [REEL_MODELS[law](length) for length in start.tolist()]
    positions, tensions = np.empty((len(time), 3)), np.empty((len(time), len(anchors)))
    strain = np.zeros(len(anchors))
    for row in range(len(time)):
        previous_strain = strain
        for _ in range(STRAIN_ITERATIONS):
            winding = zip(reels, reeled[row], 0.5 * (previous_strain + strain), strict=True)
            unstrained = np.array([reel.unstrained_length(wound, mean) for reel, wound, mean in winding])
            strain_at = partial(reels[0].strain, unstrained=unstrained)
            position = _equilibrium_position(anchors, start_tension, stiffness, strain_at, load[row], position)
            strain = strain_at(np.linalg.norm(anchors - position, axis=1))
        for reel, wound, mean in zip(reels, reeled[row], 0.5 * (previous_strain + strain), strict=True):
            reel.wind(float(wound), float(mean))
        positions[row], tensions[row] = position, start_tension + stiffness * strain
    lengths = np.linalg.norm(anchors - positions[:, None], axis=2)
    return QuasiStaticMotion(time, positions, tensions, lengths - (start - reeled))


class ExactReel:
    """Exact reel: a drum as described above."""

    def __init__(self, length: float) -> None:
        self._length, self._drum = length, DrumWinding()

    @staticmethod
    def strain(length: Array, unstrained: Array) -> Array:
        """Strain ``l / L - 1``."""
        return length / unstrained - 1.0

    def unstrained_length(self, wound: float, strain: float) -> float:
        """Unstrained length of the rope in the span, its material, in m."""
        return self._length - self._drum.material_after(wound, strain)

    def wind(self, wound: float, strain: float) -> None:
        """Reel in or pay out."""
        self._drum.wind(wound, strain)


class LogarithmicReel:
    """Reel of the logarithmic law: ``dL/dt = -V L / l`` both ways, ``e = ln(l / L)``."""

    def __init__(self, length: float) -> None:
        self._unstrained_length, self._wound = length, 0.0

    @staticmethod
    def strain(length: Array, unstrained: Array) -> Array:
        """Strain ``ln(l / L)``."""
        return np.asarray(np.log(length / unstrained))

    def unstrained_length(self, wound: float, strain: float) -> float:
        """Unstrained length of the rope in the span, in m."""
        return float(self._unstrained_length - (wound - self._wound) * np.exp(-strain))

    def wind(self, wound: float, strain: float) -> None:
        """Reel in or pay out."""
        self._unstrained_length, self._wound = self.unstrained_length(wound, strain), wound


class LinearReel:
    """Reel of the linear law: ``dL/dt = -V`` both ways, ``e = (l - L) / l``."""

    def __init__(self, length: float) -> None:
        self._length = length

    @staticmethod
    def strain(length: Array, unstrained: Array) -> Array:
        """Strain ``(l - L) / l``."""
        return (length - unstrained) / length

    def unstrained_length(self, wound: float, strain: float) -> float:
        """Unstrained length of the rope in the span, in m."""
        return self._length - wound

    def wind(self, wound: float, strain: float) -> None:
        """Reel in or pay out; this law has no state."""


REEL_MODELS: Mapping[str, Callable[[float], ExactReel | LogarithmicReel | LinearReel]] = {
    "exact": ExactReel,
    "logarithmic": LogarithmicReel,
    "linear": LinearReel,
}


def _equilibrium_position(
    anchors: Array,
    start_tension: Array,
    stiffness: Array,
    strain_at: Callable[[Array], Array],
    load: Array,
    guess: Array,
) -> Array:
    """Equilibrium position of ropes under a load (N), by Newton's method, (3,) in m; strains by the ropes' lengths."""
    position = guess
    for _ in range(MAX_NEWTON_ITERATIONS):
        spans = anchors - position
        lengths = np.linalg.norm(spans, axis=1)
        unit = spans / lengths[:, None]
        tension = start_tension + stiffness * strain_at(lengths)
        along = np.einsum("ia,ib->iab", unit, unit)
        gradient = np.einsum("i,iab->ab", stiffness / lengths, along)
        gradient += np.einsum("i,iab->ab", tension / lengths, np.eye(3) - along)
        position_change = np.linalg.solve(gradient, tension @ unit - load)
        position = position + position_change
        if np.max(np.abs(position_change)) < NEWTON_TOLERANCE * np.max(lengths):
            break
    return position
