"""Ropes that do not run straight from the declared exit point to the platform."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tests.rig.effect import Effect, Moment
from tests.rig.robot import Vector


@dataclass(kw_only=True)
class Anchor(Effect):
    """An exit point that is elsewhere than declared, by x, y, z in m."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    def exits(self, moment: Moment) -> None:
        """Move it."""
        moment.exits = moment.exits + np.outer(self.mask, [self.x, self.y, self.z])


@dataclass(kw_only=True)
class Pulley(Effect):
    """A pulley of `radius` r (m) that swivels about the vertical through the exit point.

    In the vertical plane through exit point and platform, with the origin at the exit point, the centre is
    at (r, 0) and the platform at (d, -h). The rope comes up at the origin, wraps over the top by pi - theta
    and leaves on a tangent: theta = atan2(-h, d - r) + arccos(r/q), q^2 = (d - r)^2 + h^2,
    l = sqrt(q^2 - r^2) + r (pi - theta). Pott, Cable-Driven Parallel Robots (2018).
    `tilt` (rad) leans the swivel axis from the vertical toward -y.
    """

    radius: float
    tilt: float = 0.0

    def geometry(self, moment: Moment) -> None:
        """Rope length with its wrapped part; directions along the tangents."""
        upright = Rotation.from_rotvec([-self.tilt, 0.0, 0.0]).as_matrix()
        away = (moment.ends - moment.exits) @ upright.T
        flat = np.hypot(away[:, 0], away[:, 1])
        outward = away[:, :2] / flat[:, None]
        across = flat - self.radius
        square = across**2 + away[:, 2] ** 2
        tangent = np.sqrt(square - self.radius**2)
        leaving = np.arctan2(away[:, 2], across) + np.arccos(self.radius / np.sqrt(square))
        length = tangent + self.radius * (np.pi - leaving)
        # Toward the pulley: minus the way a rope running clockwise leaves it.
        back = np.column_stack([-np.sin(leaving)[:, None] * outward, np.cos(leaving)])
        moment.length = np.where(self.on, length, moment.length)
        moment.direction = np.where(self.on[:, None], back @ upright, moment.direction)


@dataclass(kw_only=True)
class TransverseDamping(Effect):
    """A rope's end that resists motion across the rope: F = -d (1 - u u') v; d `damping` in N s/m.

    With another exponent p than 1: |(1 - u u') v/r|^(p - 1) times that, r `reference` in m/s.
    """

    damping: float
    exponent: float = 1.0
    reference: float = 0.1

    def load(self, moment: Moment) -> None:
        """Resist what of the velocity is perpendicular to each rope."""
        ends = np.broadcast_to(moment.end_velocity, moment.direction.shape)
        across = ends - np.sum(ends * moment.direction, axis=1, keepdims=True) * moment.direction
        size = np.linalg.norm(across, axis=1, keepdims=True) / self.reference
        resistance = self.damping * size ** (self.exponent - 1.0) if self.exponent != 1.0 else self.damping
        moment.push(-self.mask[:, None] * resistance * across, moment.arms)


@dataclass(kw_only=True)
class Sag(Effect):
    """A rope with weight w = `linear_density` g (N/m of chord) hangs as a parabola.

    Chord l, horizontal span d, chord tension T: arc = l (1 + (w d)^2/(24 T^2)), and the elastic law acts on
    the arc, so T follows from T = E S (ln(arc/arc_0) + w_in) + T0. Half the weight, w l/2, hangs on the
    platform, half on the exit: the cell feels |T u + (w l/2) z|. Viscosity stays with the chord.
    Irvine, Cable Structures (1981). Steep: arc = l (1 + (w l)^2/(24 T^2)), as if every rope were level.
    """

    linear_density: float  # kg/m
    form: str = "inclined"

    def settle(self) -> None:
        """Note how far the start arc is longer than its chord."""
        bow = self._bow(self.rig.start_length, self.rig.start_direction)
        self.start_part = np.log1p(bow / self.rig.start_tension**2)

    def strains(self, moment: Moment) -> None:
        """Find the strain of the arc."""
        rig = self.rig
        bow = self._bow(moment.length, moment.direction)
        base = rig.axial * (moment.strain - self.start_part) + rig.start_tension
        part = np.log1p(bow / self._tension(base, bow) ** 2)
        moment.strain = moment.strain + part - self.start_part
        moment.length = moment.length * np.exp(part)

    def _bow(self, length: Vector, direction: Vector) -> Vector:
        """(w d)^2/24, N^2."""
        level = 1.0 if self.form == "steep" else np.hypot(direction[:, 0], direction[:, 1])
        span = length * level
        return self.mask * (self.linear_density * self.rig.robot.gravity * span) ** 2 / 24.0

    def _tension(self, base: Vector, bow: Vector) -> Vector:
        """Solve T = base + E S ln(1 + bow/T^2) by Newton steps in ln T; there is one root."""
        axial = self.rig.axial
        logarithm = np.log(np.maximum(base, 1e-3 * self.rig.start_tension))
        sagging = bow > 0
        for _ in range(60):
            tension = np.exp(logarithm)
            missing = base + axial * np.log1p(bow / tension**2) - tension
            slope = tension + 2.0 * axial * bow / (tension**2 + bow)
            step = np.where(sagging, np.clip(missing / slope, -1.0, 1.0), 0.0)
            logarithm = logarithm + step
            if np.abs(step).max() < 1e-14:
                break
        return np.exp(logarithm)

    def _half_weight(self, moment: Moment) -> Vector:
        return self.mask * self.linear_density * self.rig.robot.gravity * moment.chord / 2.0

    def transmit(self, moment: Moment) -> None:
        """The exit holds half of the rope."""
        top = moment.direction * moment.cell[:, None]
        top[:, 2] += self._half_weight(moment)
        moment.cell = np.where(self.on, np.linalg.norm(top, axis=1), moment.cell)

    def load(self, moment: Moment) -> None:
        """The platform holds the other half."""
        down = np.array([0.0, 0.0, -1.0])
        moment.push(self._half_weight(moment)[:, None] * down, moment.arms)


@dataclass(kw_only=True)
class Frame(Effect):
    """A frame that gives way: each exit point is a mass on a spring and a damper, in all directions.

    m d'' = -k d - c d' - (pull u - pull_0 u_0); k `stiffness_constant` in N/m, c `viscosity` in N s/m,
    m `mass` in kg; d = 0 at the start.
    """

    stiffness_constant: float
    viscosity: float
    mass: float = 50.0

    def size(self) -> int:
        """Displacement and velocity of every exit point."""
        return 6 * self.rig.robot.count

    def exits(self, moment: Moment) -> None:
        """Move the exit points."""
        displacement, velocity = moment.state[self.part].reshape(2, -1, 3)
        moment.exits = moment.exits + displacement
        moment.exit_velocity = moment.exit_velocity + velocity

    def couple(self, moment: Moment) -> None:
        """Let the ropes pull at the exit points."""
        displacement, velocity = moment.state[self.part].reshape(2, -1, 3)
        pull = moment.pull[:, None] * moment.direction
        pull_before = self.rig.start_tension[:, None] * self.rig.start_direction
        force = -self.stiffness_constant * displacement - self.viscosity * velocity - (pull - pull_before)
        rate = self.mask[:, None] * force / self.mass
        moment.rates[self.part] = np.concatenate([velocity.ravel(), rate.ravel()])
