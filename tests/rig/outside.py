"""What resists the platform around it, and sensors that lag, scale or have a wrong zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tests.rig.effect import Effect, Moment
from tests.rig.robot import Vector


@dataclass(kw_only=True)
class Drag(Effect):
    """Air drag F = -rho/2 (C A) |v - w| (v - w), N, at the centre of mass; the start is in equilibrium with a wind.

    `drag_area` C A in m^2, `density` rho in kg/m^3, `wind` w in m/s; `exponent` p other than 2: |v - w|^(p - 1), v in
    m/s.
    """

    drag_area: float
    density: float = 1.225
    wind: Sequence[float] = (0.0, 0.0, 0.0)
    exponent: float = 2.0

    def load(self, moment: Moment) -> None:
        """Brake the platform."""
        velocity = moment.velocity + np.cross(moment.turning, moment.centre) if self.rig.turning else moment.velocity
        relative = velocity - np.asarray(self.wind, float)
        speed = np.sqrt(relative @ relative) ** (self.exponent - 1.0)
        moment.push(-0.5 * self.density * self.drag_area * speed * relative, moment.centre)


@dataclass(kw_only=True)
class RotationalDrag(Effect):
    """A moment against the turning of the platform: M = -d w; d `damping` in N m s.

    With another exponent p than 1: |w/r|^(p - 1) times that, r `reference` in rad/s.
    """

    of_bodies: ClassVar[bool] = True

    damping: float
    exponent: float = 1.0
    reference: float = 0.1

    def load(self, moment: Moment) -> None:
        """Brake the turning."""
        speed = np.linalg.norm(moment.turning) / self.reference
        resistance = self.damping * speed ** (self.exponent - 1.0) if self.exponent != 1.0 else self.damping
        moment.torque = moment.torque - resistance * moment.turning


@dataclass(kw_only=True)
class SensorDelay(Effect):
    """Outputs that come `seconds` late; `outputs` is "tension", "position" or "all".

    With form "lag" load cells follow as dy/dt = (T - y)/seconds instead, or in ``order`` such stages, alike, that take
    as long together.
    """

    seconds: float
    outputs: str = "tension"
    form: str = "delay"
    order: int = 1

    def size(self) -> int:
        """What each stage of each lagging load cell shows."""
        return self.order * self.rig.robot.count if self.form == "lag" else 0

    def begin(self) -> Vector:
        """The start tensions."""
        return np.tile(self.rig.start_tension, self.order) if self.form == "lag" else np.zeros(0)

    def transmit(self, moment: Moment) -> None:
        """Show what lags."""
        if self.form == "lag":
            shown = moment.state[self.part].reshape(self.order, -1)
            before = np.vstack([moment.cell, shown[:-1]])
            moment.rates[self.part] = ((before - shown) * self.order / self.seconds).ravel()
            moment.cell = np.where(self.on, shown[-1], moment.cell)

    def delay(self) -> dict[str, Vector]:
        """Lag of each output, s."""
        lags: dict[str, Vector] = {}
        if self.form == "lag":
            return lags
        if self.outputs in ("tension", "all"):
            lags["tension"] = self.seconds * self.mask
        if self.outputs in ("position", "all"):
            lags["position"] = np.full(3, self.seconds)
        return lags


@dataclass(kw_only=True)
class SensorGain(Effect):
    """Outputs multiplied by `gain`; `outputs` is "tension" (of the named cables) or "position".

    A load cell may bend: T (gain + `bend` (T/T0 - 1)), T0 the start tension.
    """

    gain: float
    outputs: str = "tension"
    bend: float = 0.0

    def sense(self, tension: Vector, position: Vector) -> tuple[Vector, Vector]:
        """Scale them."""
        if self.outputs == "tension":
            gain = self.gain + self.bend * (tension / self.rig.start_tension - 1.0)
            return tension * np.where(self.on, gain, 1.0), position
        return tension, position * self.gain


@dataclass(kw_only=True)
class SensorOffset(Effect):
    """Sensors that show a value where there is none: load cells of the named cables `force` (N), the tracker `place`.

    `place` is what it shows of the origin (x, y, z), m.
    """

    force: float = 0.0
    place: Sequence[float] = (0.0, 0.0, 0.0)

    def sense(self, tension: Vector, position: Vector) -> tuple[Vector, Vector]:
        """Shift them."""
        return tension + np.outer(np.ones(len(tension)), self.force * self.mask), position + np.asarray(self.place)
