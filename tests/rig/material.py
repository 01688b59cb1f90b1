"""What a rope's material does beside E S eps + c S deps/dt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tests.rig.effect import Effect, Moment
from tests.rig.robot import Vector

if TYPE_CHECKING:
    from tests.rig.mechanics import Rig


# Exponent of 1 + t/tau by which creep slows down.
SLOWING = {"logarithmic": 1.0, "power": 0.5, "viscous": 0.0}


@dataclass(kw_only=True)
class Relaxation(Effect):
    """Standard linear solid: Maxwell branches beside the declared spring, which stays as the long-term one.

    T += S sum_k E_k (eps - e_k), de_k/dt = (eps - e_k)/tau_k; E_k `modulus` in Pa, tau_k `time` in s.
    All branches are at rest at the start. Ferry, Viscoelastic Properties of Polymers (1980).
    """

    modulus: float | Sequence[float]
    time: float | Sequence[float]

    def size(self) -> int:
        """One viscous strain per branch and cable."""
        return np.size(self.modulus) * self.rig.robot.count

    def stiffness(self, moment: Moment) -> None:
        """Add what the branches carry."""
        lag = moment.strain - moment.state[self.part].reshape(-1, self.rig.robot.count)
        stress = np.reshape(self.modulus, (-1, 1)) * lag
        moment.tension = moment.tension + self.mask * self.rig.robot.area * stress.sum(axis=0)
        moment.rates[self.part] = (lag / np.reshape(self.time, (-1, 1))).ravel()


@dataclass(kw_only=True)
class Hysteresis(Effect):
    """Rate-independent friction between the strands, after Bouc and Wen with gamma = 1 - beta.

    T += F h, dh/dt = (deps/dt / eps_y) (1 - |h|^n (beta sign(h deps/dt) + gamma)); F `force` in N, eps_y
    `yield_strain`, n `exponent`; h = 0 at the start. Wen, J. Eng. Mech. 102 (1976).
    """

    kinked: ClassVar[bool] = True

    force: float
    yield_strain: float
    exponent: float = 1.0
    beta: float = 0.5

    def size(self) -> int:
        """One memory per cable."""
        return self.rig.robot.count

    def viscous(self, moment: Moment) -> None:
        """Add the strands' friction."""
        memory = moment.state[self.part]
        closing = 1.0 - self.beta + self.beta * np.sign(memory * moment.strain_rate)
        slope = 1.0 - np.abs(memory) ** self.exponent * closing
        moment.rates[self.part] = moment.strain_rate / self.yield_strain * slope
        moment.tension = moment.tension + self.mask * self.force * memory


@dataclass(kw_only=True)
class Creep(Effect):
    """Strain that grows under load and carries none of it.

    logarithmic: de/dt = C sigma/(tau + t), so e = C sigma ln(1 + t/tau) under constant stress;
    viscous: de/dt = C sigma/tau; power: de/dt = C sigma/tau (1 + t/tau)^(-1/2); sigma = T/S. `compliance` C in
    1/Pa, `time` tau in s, t since the start.
    Findley, Lai and Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials (1976).
    """

    compliance: float
    time: float
    form: str = "logarithmic"

    def size(self) -> int:
        """One creep strain per cable."""
        return self.rig.robot.count

    def strains(self, moment: Moment) -> None:
        """Take the creep strain off the one that carries load."""
        moment.strain = moment.strain - moment.state[self.part]
        robot, rig = self.rig.robot, self.rig
        stress = np.maximum(rig.axial * moment.strain + rig.start_tension, 0.0) / robot.area
        age = self.time * (1.0 + moment.time / self.time) ** SLOWING[self.form]
        rate = self.mask * self.compliance * stress / age
        moment.rates[self.part] = rate
        moment.free_rate = moment.free_rate + rate


@dataclass(kw_only=True)
class Thermal(Effect):
    """Rope that grows with heat: e = alpha dT, dT = rise (1 - exp(-t/tau)) + rate t; hyperbolic: rise t/(t + tau).

    `expansion` alpha in 1/K, `rise` in K, `time` tau in s, `rate` in K/s, t since the start.
    """

    expansion: float
    rise: float = 0.0
    time: float = 1.0
    rate: float = 0.0
    form: str = "exponential"

    def strains(self, moment: Moment) -> None:
        """Take the heat's strain off the one that carries load."""
        hyperbolic = self.form == "hyperbolic"
        left = self.time / (moment.time + self.time) if hyperbolic else np.exp(-moment.time / self.time)
        warmth = self.rise * (1.0 - left) + self.rate * moment.time
        warming = self.rise * left ** (2 if hyperbolic else 1) / self.time + self.rate
        moment.strain = moment.strain - self.mask * self.expansion * warmth
        moment.free_rate = moment.free_rate + self.mask * self.expansion * warming


@dataclass(kw_only=True)
class Slack(Effect):
    """A soft passage into slackness: T = s ln(1 + exp(x/s)) in place of max(T, 0); s `softness` in N.

    x is the law's tension, shifted so that T is still T0 at the start. Root: T = (x + sqrt(x^2 + 4 s^2))/2.
    """

    softness: float
    form: str = "logarithm"

    def viscous(self, moment: Moment) -> None:
        """Round the corner at zero tension."""
        if self.form == "root":
            x = moment.tension - self.softness**2 / self.rig.start_tension
            soft = 0.5 * (x + np.sqrt(x**2 + 4.0 * self.softness**2))
            moment.tension = np.where(self.on, soft, moment.tension)
            return
        shift = self.softness * np.log1p(-np.exp(-self.rig.start_tension / self.softness))
        soft = self.softness * np.logaddexp(0.0, (moment.tension + shift) / self.softness)
        moment.tension = np.where(self.on, soft, moment.tension)


@dataclass(kw_only=True)
class Pushing(Effect):
    """Struts in the place of ropes: a cable may push, as the bare law of T = E S eps + T0 would have it."""

    def attach(self, rig: Rig) -> None:
        """Take the floor away."""
        super().attach(rig)
        rig.floor = np.where(self.on, -np.inf, rig.floor)


@dataclass(kw_only=True)
class Stiffening(Effect):
    """A rope that stiffens: T += E S q ((eps + e_0)^2 - e_0^2), e_0 = T0/(E S), q `quadratic`."""

    quadratic: float

    def stiffness(self, moment: Moment) -> None:
        """Add the quadratic part."""
        initial: Vector = self.rig.start_tension / self.rig.axial
        extra = (moment.strain + initial) ** 2 - initial**2
        moment.tension = moment.tension + self.mask * self.rig.axial * self.quadratic * extra
