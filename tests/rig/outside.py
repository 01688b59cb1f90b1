"""Air around the platform, and sensors that lag or scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.rig.effect import Effect, Moment
from tests.rig.robot import Vector


@dataclass(kw_only=True)
class Drag(Effect):
    """Air drag F = -rho/2 (C A) |v - w| (v - w), N; the start is in equilibrium with a steady wind.

    `drag_area` C A in m^2, `density` rho in kg/m^3, `wind` w in m/s.
    """

    drag_area: float
    density: float = 1.225
    wind: Sequence[float] = (0.0, 0.0, 0.0)

    def load(self, moment: Moment) -> None:
        """Brake the platform."""
        relative = moment.velocity - np.asarray(self.wind, float)
        speed = np.sqrt(relative @ relative)
        moment.force = moment.force - 0.5 * self.density * self.drag_area * speed * relative


@dataclass(kw_only=True)
class SensorDelay(Effect):
    """Outputs that come `seconds` late; `outputs` is "tension", "position" or "all"."""

    seconds: float
    outputs: str = "tension"

    def delay(self) -> dict[str, Vector]:
        """Lag of each output, s."""
        lags: dict[str, Vector] = {}
        if self.outputs in ("tension", "all"):
            lags["tension"] = self.seconds * self.mask
        if self.outputs in ("position", "all"):
            lags["position"] = np.full(3, self.seconds)
        return lags


@dataclass(kw_only=True)
class SensorGain(Effect):
    """Outputs multiplied by `gain`; `outputs` is "tension" (of the named cables) or "position"."""

    gain: float
    outputs: str = "tension"

    def sense(self, tension: Vector, position: Vector) -> tuple[Vector, Vector]:
        """Scale them."""
        if self.outputs == "tension":
            return tension * np.where(self.on, self.gain, 1.0), position
        return tension, position * self.gain
