"""Between winch and free span: the drum and the pulley's friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.rig.effect import Effect, Moment


@dataclass(kw_only=True)
class Drum(Effect):
    """A drum that is not what the encoder takes it for.

    V = V_e ratio (1 + b s) (1 + e cos(s/R + phase) + e_2 cos(2 s/R)) - k T |V_e|: V_e by the encoder, s its
    integral, ratio `radius_ratio` (true over declared radius), b `build_up` in 1/m, e `eccentricity` and e_2
    `second_harmonic` (relative), `phase` in rad, R `radius` in m, k `slip` in 1/N: while the drum turns, rope creeps
    toward the platform in proportion to the elastic tension T.
    """

    radius_ratio: float = 1.0
    eccentricity: float = 0.0
    phase: float = 0.0
    radius: float = 0.1
    slip: float = 0.0
    build_up: float = 0.0
    second_harmonic: float = 0.0

    def winding(self, moment: Moment) -> None:
        """Turn what the encoder says into rope speed."""
        angle = moment.travel / self.radius
        wave = 1.0 + self.eccentricity * np.cos(angle + self.phase) + self.second_harmonic * np.cos(2.0 * angle)
        tension = np.maximum(moment.tension, 0.0)
        ratio = self.radius_ratio * (1.0 + self.build_up * moment.travel)
        true = moment.speed * ratio * wave - self.slip * tension * np.abs(moment.speed)
        moment.speed = np.where(self.on, true, moment.speed)


@dataclass(kw_only=True)
class Friction(Effect):
    """Friction of the exit pulley, between platform and load cell, by the capstan equation.

    T_cell = T_platform exp(mu wrap tanh(V/v_s)): reeling in, the cell feels more. mu `coefficient`, `wrap` in
    rad, v_s `smoothing` in m/s. The law gives the tension of the free span, which pulls the platform;
    with law_at = "cell" it gives the tension at the load cell, and the platform feels the friction.
    Linear: 1 + x in place of exp(x); Stribeck: x grows by 60 % toward rest, exp(-(V/5 v_s)^2).
    """

    coefficient: float
    wrap: float = np.pi / 2
    smoothing: float = 0.005
    law_at: str = "span"
    form: str = "exponential"

    def transmit(self, moment: Moment) -> None:
        """Let one end differ from the other."""
        grip = self.mask * self.coefficient * self.wrap * np.tanh(moment.speed / self.smoothing)
        if self.form == "stribeck":
            grip = grip * (1.0 + 0.6 * np.exp(-((moment.speed / (5.0 * self.smoothing)) ** 2)))
        gain = 1.0 + grip if self.form == "linear" else np.exp(grip)
        if self.law_at == "span":
            moment.cell = moment.cell * gain
        else:
            moment.pull = moment.pull / gain
