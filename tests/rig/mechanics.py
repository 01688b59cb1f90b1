"""Equations of motion of a point mass or a rigid body on cables, with any set of effects switched on.

State: displacement of the platform from its start, its velocity, the rope wound in by each winch, and how it turns.
With l_u = l_0 at the start and dl_u/dt = -V l_u/l, ln l_u = ln l_0 - w where dw/dt = V/l, so

    logarithmic law   T = E S (ln(l/l_0) + w)   + c S (dl/dt + V)/l + T0,  dw/dt = V/l
    linear law        T = E S (l - l_0 + w)/l   + c S (dl/dt + V)/l + T0,  dw/dt = V

A cable that would push carries nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tests.rig.effect import STAGES, Effect, Moment, torque_of
from tests.rig.hanging import hanging
from tests.rig.program import Program
from tests.rig.registry import EFFECTS
from tests.rig.robot import Robot, Vector
from tests.rig.statics import holds, start_tensions
from tests.rig.turning import STATES, Turning, cayley

# Parameters of an effect; a sequence where it acts more than once, as on different cables.
Settings = Mapping[str, Mapping[str, Any] | Sequence[Mapping[str, Any]]]


def make_effects(settings: Settings) -> list[Effect]:
    """The effects that are switched on, in the order of the registry."""
    made = []
    for name in sorted(settings, key=list(EFFECTS).index):
        values = settings[name]
        made += [EFFECTS[name](**one) for one in ([values] if isinstance(values, Mapping) else values)]
    return made


class Rig:
    """A robot with effects, driven by a winch program."""

    def __init__(
        self, robot: Robot, effects: Settings | None, program: Program, surroundings: Sequence[Effect] = ()
    ) -> None:
        self.program = program
        self.declared = robot
        self.robot = robot
        self.floor = np.zeros(robot.count)
        self.effects = [*make_effects(effects or {}), *surroundings]
        for effect in self.effects:
            effect.attach(self)
            self.robot = effect.declare(self.robot)
        self.turning = Turning(self.robot, self.robot.body) if self.robot.body else None
        self._lay_out_state()
        self.hooks = {
            stage: [
                getattr(effect, stage)
                for effect in self.effects
                if getattr(type(effect), stage) is not getattr(Effect, stage)
            ]
            for stage in STAGES
        }
        self.axial = self.robot.modulus * self.robot.area
        self.viscous = self.robot.damping * self.robot.area
        self.weight = np.array([0.0, 0.0, -self.robot.mass * self.robot.gravity])
        self.any_linear = bool(self.robot.linear.any())
        self._settle()

    def _lay_out_state(self) -> None:
        size = 6 + self.robot.count
        if self.turning:
            self.turning.part = slice(size, size + STATES)
            size += STATES
        for effect in self.effects:
            effect.part = slice(size, size + effect.size())
            size = effect.part.stop
        self.size = size

    def _settle(self) -> None:
        """Find start lengths and start tensions: static equilibrium at the start, effects included."""
        if self.turning and self.robot.count < 6 and not holds(*self._balance(np.zeros(3))):
            self.turning.start = self.turning.start @ cayley(hanging(self._balance, self.robot.count))
        moment = self._resting(np.zeros(3))
        self.start_length = moment.length
        self.start_direction = moment.direction
        if self.turning:
            matrix, load = self._balance(np.zeros(3))
            self.start_tension = start_tensions(matrix.T, load, self.robot.tension)
        else:
            self.start_tension = start_tensions(moment.direction, moment.force, self.robot.tension)
        for effect in self.effects:
            effect.settle()

    def _resting(self, gibbs: Vector) -> Moment:
        """All forces but the ropes' on a platform at rest at its start, turned by a Gibbs vector."""
        state = np.zeros(self.size)
        if self.turning:
            state[self.turning.part][:3] = gibbs
        moment = self._place(0.0, state)
        moment.pull = np.zeros(self.robot.count)
        moment.force, moment.torque = np.zeros(3), np.zeros(3)
        moment.push(self.weight, moment.centre)
        self._apply("load", moment)
        moment.force = moment.force + sum((effect.resting() for effect in self.effects), np.zeros(3))
        return moment

    def _balance(self, gibbs: Vector) -> tuple[Vector, Vector]:
        """What unit tensions and all else do to a resting platform: forces, and moments by its size; (6, n) and (6)."""
        assert self.turning is not None
        moment, size = self._resting(gibbs), self.turning.size
        torques = np.cross(moment.arms, moment.direction) / size
        return np.vstack([moment.direction.T, torques.T]), np.concatenate([moment.force, moment.torque / size])

    def begin(self, velocity: Vector | None = None, turning: Vector | None = None) -> Vector:
        """The state at the start; at rest unless a velocity is given, m/s, or an angular one in the world's axes."""
        state = np.zeros(self.size)
        if velocity is not None:
            state[3:6] = velocity
        if turning is not None and self.turning is not None:
            state[self.turning.part][3:] = turning @ self.turning.start
        for effect in self.effects:
            state[effect.part] = effect.begin()
        return state

    def rates(self, time: float, state: Vector) -> Vector:
        """Time derivative of the state."""
        return self.evaluate(time, state).rates

    def evaluate(self, time: float, state: Vector) -> Moment:
        """All quantities at one instant."""
        moment = self._place(time, state)
        self._strain(moment)
        self._pull(moment)
        moment.force = moment.pull @ moment.direction + self.weight
        if self.turning:
            moment.torque = torque_of(moment.arms, moment.pull[:, None] * moment.direction)
            moment.torque = moment.torque + torque_of(moment.centre[None], self.weight[None])
        self._apply("load", moment)
        if self.turning:
            self.turning.accelerate(moment)
        else:
            moment.acceleration = moment.force / self.robot.mass
        self._apply("couple", moment)
        moment.rates[0:3] = moment.velocity
        moment.rates[3:6] = moment.acceleration
        wound = moment.rates[6 : 6 + self.robot.count]
        wound[:] = moment.speed / moment.length
        if self.any_linear:
            wound[self.robot.linear] = moment.speed[self.robot.linear]
        return moment

    def _apply(self, stage: str, moment: Moment) -> None:
        for hook in self.hooks[stage]:
            hook(moment)

    def _place(self, time: float, state: Vector) -> Moment:
        """Where everything is: exit points, rope lengths and directions."""
        moment = Moment()
        moment.time = time
        moment.state = state
        moment.rates = np.zeros(self.size)
        moment.displacement = state[0:3]
        moment.position = self.robot.start + state[0:3]
        moment.velocity = state[3:6]
        moment.wound = state[6 : 6 + self.robot.count]
        if self.turning:
            self.turning.place(moment)
        else:
            moment.arms = moment.centre = np.zeros(3)
            moment.ends, moment.end_velocity = moment.position, moment.velocity
        moment.exits = self.robot.anchors
        moment.exit_velocity = np.zeros(3)
        self._apply("exits", moment)
        span = moment.exits - moment.ends
        moment.chord = np.sqrt(np.einsum("ij,ij->i", span, span))
        moment.length = moment.chord
        moment.direction = span / moment.chord[:, None]
        self._apply("geometry", moment)
        return moment

    def _strain(self, moment: Moment) -> None:
        """Strain since the start from length and wound rope."""
        moment.strain = np.log(moment.length / self.start_length) + moment.wound
        if self.any_linear:
            linear = (moment.length - self.start_length + moment.wound) / moment.length
            moment.strain = np.where(self.robot.linear, linear, moment.strain)
        moment.free_rate = np.zeros(self.robot.count)
        self._apply("strains", moment)

    def _pull(self, moment: Moment) -> None:
        """Tension of the span, pull on the platform and what the load cell feels."""
        moment.tension = self.axial * moment.strain + self.start_tension
        self._apply("stiffness", moment)
        moment.speed = self.program.speed(moment.time)
        moment.travel = self.program.travel(moment.time)
        self._apply("winding", moment)
        moment.rate = ((moment.exit_velocity - moment.end_velocity) * moment.direction).sum(axis=1)
        moment.strain_rate = (moment.rate + moment.speed) / moment.length - moment.free_rate
        moment.tension = moment.tension + self.viscous * moment.strain_rate
        self._apply("viscous", moment)
        moment.tension = np.maximum(moment.tension, self.floor)
        moment.pull = moment.tension
        moment.cell = moment.tension
        self._apply("transmit", moment)
