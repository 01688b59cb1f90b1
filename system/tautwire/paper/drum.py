"""Both tension laws against a rope on a drum: material is conserved, and what is wound stays as tight as it was.

A rope between exit point and platform holds the material ``L`` (its length under the start tension ``T0``) and is ``l``
long, so its strain is ``e = l / L - 1`` and ``T = T0 + E S e``. While the drum winds at the speed V, rope of the span's
strain comes onto it, and friction holds it there:

    reeling in    dL/dt = -V / (1 + e)            the strain e of the span now
    paying out    dL/dt = -V / (1 + e_w(s))       the strain e_w with which the place s on the drum was wound

Rope that lay on the drum at the start was wound at T0: ``e_w = 0``. The logarithmic law takes the span's strain both
ways, the linear one none both ways: each is right in one direction, the linear one only for rope wound at T0.

The platform moves slowly: at each moment it is where the tensions carry its weight and the path's inertia. Nothing of
the FMUs' laws is used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..robots.robot import Robot
from ..statics.equilibrium import static_tensions
from ..trajectory import Trajectory, ideal_winch_speeds
from .records import travelled

Array = NDArray[np.float64]
Law = Callable[[float, float], float]

NEWTON, SETTLED, PASSES = 12, 1e-12, 2


@dataclass
class Drum:
    """The rope on one drum: material (m) over wound length (m) since the start, one point for each sample wound."""

    wound: list[float] = field(default_factory=lambda: [0.0])
    material: list[float] = field(default_factory=lambda: [0.0])

    def after(self, wound: float, strain: float) -> float:
        """The material on the drum with ``wound`` on it, where rope that comes onto it now has this strain."""
        if wound >= self.wound[-1]:
            return self.material[-1] + (wound - self.wound[-1]) / (1.0 + strain)
        if wound <= self.wound[0]:
            return self.material[0] + wound - self.wound[0]
        return float(np.interp(wound, self.wound, self.material))

    def wind(self, wound: float, strain: float) -> None:
        """Reel in or pay out until ``wound`` is on the drum."""
        material = self.after(wound, strain)
        while self.wound and self.wound[-1] >= wound:
            self.wound.pop()
            self.material.pop()
        self.wound.append(wound)
        self.material.append(material)


@dataclass(frozen=True)
class Followed:
    """A slow motion: ``position`` (N, 3) in m, ``tension`` (N, n) in N, ``elongation`` (N, n), the paper's r, in m."""

    time: Array
    position: Array
    tension: Array
    elongation: Array


def follow(robot: Robot, path: Trajectory, time: Array, law: str) -> Followed:
    """Reel inelastic cables along a path, and see where ropes of a law lead: exact, logarithmic or linear.

    ``time`` (N,) in s from the start of the path.
    """
    anchors, rest = np.array(robot.anchors), static_tensions(robot)
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    reeled = travelled(time, ideal_winch_speeds(robot, path, time))
    load = robot.platform.mass * (path.acceleration(time) + np.array([0.0, 0.0, robot.gravity]))
    position = np.array(robot.platform.start)
    start = np.linalg.norm(anchors - position, axis=1)
    reels = [REELS[law](length) for length in start.tolist()]
    places, tensions = np.empty((len(time), 3)), np.empty((len(time), len(anchors)))
    strain = np.zeros(len(anchors))
    for row in range(len(time)):
        before = strain
        for _ in range(PASSES):
            held = np.array([r.held(s, e) for r, s, e in zip(reels, reeled[row], 0.5 * (before + strain), strict=True)])
            position = _at_rest(anchors, held, rest, stiffness, load[row], position, reels[0].strain)
            strain = reels[0].strain(np.linalg.norm(anchors - position, axis=1), held)
        for reel, wound, mean in zip(reels, reeled[row], 0.5 * (before + strain), strict=True):
            reel.wind(float(wound), float(mean))
        places[row], tensions[row] = position, rest + stiffness * strain
    lengths = np.linalg.norm(anchors - places[:, None], axis=2)
    return Followed(time, places, tensions, lengths - (start - reeled))


class ExactReel:
    """A drum as described above."""

    def __init__(self, length: float) -> None:
        self._length, self._drum = length, Drum()

    @staticmethod
    def strain(length: Array, held: Array) -> Array:
        """``l / L - 1``."""
        return length / held - 1.0

    def held(self, wound: float, strain: float) -> float:
        """The material in the span, in m."""
        return self._length - self._drum.after(wound, strain)

    def wind(self, wound: float, strain: float) -> None:
        """Reel in or pay out."""
        self._drum.wind(wound, strain)


class LogarithmicReel:
    """``dL/dt = -V L / l`` both ways, ``e = ln(l / L)``."""

    def __init__(self, length: float) -> None:
        self._held, self._wound = length, 0.0

    @staticmethod
    def strain(length: Array, held: Array) -> Array:
        """``ln(l / L)``."""
        return np.asarray(np.log(length / held))

    def held(self, wound: float, strain: float) -> float:
        """The unstrained length in the span, in m."""
        return float(self._held - (wound - self._wound) * np.exp(-strain))

    def wind(self, wound: float, strain: float) -> None:
        """Reel in or pay out."""
        self._held, self._wound = self.held(wound, strain), wound


class LinearReel:
    """``dL/dt = -V`` both ways, ``e = (l - L) / l``."""

    def __init__(self, length: float) -> None:
        self._length = length

    @staticmethod
    def strain(length: Array, held: Array) -> Array:
        """``(l - L) / l``."""
        return (length - held) / length

    def held(self, wound: float, strain: float) -> float:
        """The unstrained length in the span, in m."""
        return self._length - wound

    def wind(self, wound: float, strain: float) -> None:
        """Nothing to remember."""


REELS: Mapping[str, Callable[[float], ExactReel | LogarithmicReel | LinearReel]] = {
    "exact": ExactReel,
    "logarithmic": LogarithmicReel,
    "linear": LinearReel,
}


def _at_rest(
    anchors: Array,
    held: Array,
    rest: Array,
    stiffness: Array,
    load: Array,
    guess: Array,
    strain: Callable[[Array, Array], Array],
) -> Array:
    """Where ropes of given material carry a load (N), by Newton's method; (3,) in m."""
    position = guess
    for _ in range(NEWTON):
        spans = anchors - position
        lengths = np.linalg.norm(spans, axis=1)
        unit = spans / lengths[:, None]
        tension = rest + stiffness * strain(lengths, held)
        along = np.einsum("ia,ib->iab", unit, unit)
        gradient = np.einsum("i,iab->ab", stiffness / lengths, along)
        gradient += np.einsum("i,iab->ab", tension / lengths, np.eye(3) - along)
        change = np.linalg.solve(gradient, tension @ unit - load)
        position = position + change
        if np.max(np.abs(change)) < SETTLED * np.max(lengths):
            break
    return position
