"""Effects that no list of the project names: a tracer has to discover them or say that it cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tests.rig.effect import Effect, Moment
from tests.rig.robot import Vector


@dataclass(kw_only=True)
class Wave(Effect):
    """A force that waves over the room: F = a sin(2 pi p.k/lambda + phase), N.

    a `amplitude` (vector, N), k `along` (unit vector), lambda `wavelength` in m.
    """

    amplitude: Sequence[float]
    wavelength: float
    along: Sequence[float] = (1.0, 0.0, 0.0)
    phase: float = 0.0

    def load(self, moment: Moment) -> None:
        """Push the platform."""
        angle = 2 * np.pi * (moment.position @ np.asarray(self.along, float)) / self.wavelength + self.phase
        moment.force = moment.force + np.asarray(self.amplitude, float) * np.sin(angle)


@dataclass(kw_only=True)
class Magnet(Effect):
    """Attraction to a point: F = s (c - p)/(|c - p|^2 + b^2)^(3/2); s `strength` in N m^2, b `core` in m."""

    strength: float
    centre: Sequence[float]
    core: float = 0.5

    def load(self, moment: Moment) -> None:
        """Pull the platform."""
        toward = np.asarray(self.centre, float) - moment.position
        moment.force = moment.force + self.strength * toward / (toward @ toward + self.core**2) ** 1.5


@dataclass(kw_only=True)
class Sideways(Effect):
    """A force across the motion, as of a spinning wheel on board: F = k axis x v; k `constant` in N s/m."""

    constant: float
    axis: Sequence[float] = (0.0, 0.0, 1.0)

    def load(self, moment: Moment) -> None:
        """Push the platform sideways; no work is done."""
        moment.force = moment.force + self.constant * np.cross(np.asarray(self.axis, float), moment.velocity)


@dataclass(kw_only=True)
class Bungee(Effect):
    """An elastic cord to a fixed point: F = k max(0, |c - p| - rest), k `stiffness_constant` in N/m."""

    stiffness_constant: float
    point: Sequence[float]
    rest: float = 0.0

    def load(self, moment: Moment) -> None:
        """Pull the platform."""
        toward = np.asarray(self.point, float) - moment.position
        length = float(np.sqrt(toward @ toward))
        pull = self.stiffness_constant * max(0.0, length - self.rest)
        moment.force = moment.force + pull * toward / length


@dataclass(kw_only=True)
class Shaker(Effect):
    """A machine on board that shakes: F = a sin(2 pi f t), a `amplitude` (vector, N), f `frequency` in Hz."""

    amplitude: Sequence[float]
    frequency: float

    def load(self, moment: Moment) -> None:
        """Shake the platform."""
        wave = np.sin(2 * np.pi * self.frequency * moment.time)
        moment.force = moment.force + np.asarray(self.amplitude, float) * wave


@dataclass(kw_only=True)
class Gusts(Effect):
    """Blows of wind: at each of `times` (s) a force `amplitude` (vectors, N) comes and goes as a raised cosine.

    F = a (1 - cos(2 pi (t - t_i)/d))/2 for t_i < t < t_i + d, d `duration` in s.
    """

    amplitude: Sequence[Sequence[float]]
    times: Sequence[float]
    duration: float = 2.0

    def load(self, moment: Moment) -> None:
        """Blow."""
        share = (moment.time - np.asarray(self.times, float)) / self.duration
        wave = np.where((share > 0.0) & (share < 1.0), 0.5 - 0.5 * np.cos(2.0 * np.pi * share), 0.0)
        moment.force = moment.force + wave @ np.asarray(self.amplitude, float)


@dataclass(kw_only=True)
class Slipping(Effect):
    """Rope that slips on its drum: at each of `times` (s) `slip` m run off within `duration` s, smoothly.

    V -= slip/d (1 - cos(2 pi (t - t_i)/d)) for t_i < t < t_i + d.
    """

    slip: float
    times: Sequence[float]
    duration: float = 0.3

    def winding(self, moment: Moment) -> None:
        """Lose rope."""
        share = (moment.time - np.asarray(self.times, float)) / self.duration
        wave = np.where((share > 0.0) & (share < 1.0), 1.0 - np.cos(2.0 * np.pi * share), 0.0)
        moment.speed = moment.speed - self.mask * self.slip / self.duration * wave.sum()


@dataclass(kw_only=True)
class Swing(Effect):
    """A load of `mass` m_s (kg) on a string of `length` b (m) under the platform, which swings freely.

    With n from platform to load and d the velocity difference, the string pulls
    S = (-g n_z - n.F/m + |d|^2/b)/(1/m_s + 1/m); `viscosity` (N s/m) resists d. It hangs still at the start.
    """

    of_points: ClassVar[bool] = True

    mass: float
    length: float
    viscosity: float = 0.0

    def size(self) -> int:
        """Position and velocity relative to the platform."""
        return 6

    def begin(self) -> Vector:
        """Straight down, at rest."""
        return np.array([0.0, 0.0, -self.length, 0.0, 0.0, 0.0])

    def resting(self) -> Vector:
        """Its weight."""
        return np.array([0.0, 0.0, -self.mass * self.rig.robot.gravity])

    def couple(self, moment: Moment) -> None:
        """String force on the platform, and the load's own motion."""
        carrier = self.rig.robot.mass
        string, swinging = moment.state[self.part].reshape(2, 3)
        down = string / np.sqrt(string @ string)
        resist = self.viscosity * swinging
        force = moment.acceleration * carrier + resist
        weight = np.array([0.0, 0.0, -self.rig.robot.gravity])
        relative = down @ (weight - resist / self.mass - force / carrier) + swinging @ swinging / self.length
        pull = relative / (1.0 / self.mass + 1.0 / carrier)
        moment.acceleration = (force + pull * down) / carrier
        own = weight - (resist + pull * down) / self.mass
        moment.rates[self.part] = np.concatenate([swinging, own - moment.acceleration])


@dataclass(kw_only=True)
class Filling(Effect):
    """A tank on board that fills: m(t) = `rate` t, in kg/s; what comes aboard has the platform's velocity.

    (M + m) a = F - m g z, with M the platform's mass.
    """

    of_points: ClassVar[bool] = True

    rate: float

    def load(self, moment: Moment) -> None:
        """Weigh down the platform."""
        moment.force = moment.force - np.array([0.0, 0.0, self.rate * moment.time * self.rig.robot.gravity])

    def couple(self, moment: Moment) -> None:
        """Be carried along."""
        carrier = self.rig.robot.mass
        moment.acceleration = moment.acceleration * carrier / (carrier + self.rate * moment.time)
