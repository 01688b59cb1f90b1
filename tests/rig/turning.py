"""The turning of a platform that is a rigid body, by Gibbs vectors and the mass matrix about the origin of its frame.

In the platform's axes, with masses m_k at p_k from the origin, f the force, t the moment about the origin, a the
acceleration of the origin, w the angular velocity and g the Gibbs vector (axis times tangent of half the angle from
the start, where R = R_0 C(g)):

    [ M      -S(h) ] [  a  ]   [ f - w x (w x h) ]        M = sum m_k,  h = sum m_k p_k,
    [ S(h)     J   ] [dw/dt] = [ t - w x (J w)   ]        J about the origin,  S(h) v = h x v

    dg/dt = (w + g x w + (g.w) g)/2,   C(g) = ((1 - g.g) 1 + 2 g g' + 2 S(g))/(1 + g.g)

Shuster, A survey of attitude representations (1993); Featherstone, Rigid body dynamics algorithms (2008).
"""

from __future__ import annotations

import numpy as np

from tests.rig.effect import Moment
from tests.rig.robot import Body, Robot, Vector

STATES = 6


def skew(vector: Vector) -> Vector:
    """The matrix S(v) of v x."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cayley(gibbs: Vector) -> Vector:
    """Rotation matrix of a Gibbs vector."""
    square = float(gibbs @ gibbs)
    matrix = (1.0 - square) * np.eye(3) + 2.0 * np.outer(gibbs, gibbs) + 2.0 * skew(gibbs)
    return np.asarray(matrix / (1.0 + square), float)


def inertia_at(mass: float, place: Vector) -> Vector:
    """Inertia of a point about the origin."""
    return np.asarray(-mass * skew(place) @ skew(place), float)


class Turning:
    """How the body of a robot turns: its part of the state are Gibbs vector and angular velocity."""

    def __init__(self, robot: Robot, body: Body) -> None:
        self.body = body
        self.start = body.orientation
        self.part = slice(0, 0)
        own = robot.mass - sum(mass for mass, _ in body.points)
        places = [(own, body.centre), *((mass, body.centre + aside) for mass, aside in body.points)]
        self.first = np.sum([mass * place for mass, place in places], axis=0)
        self.inertia = body.inertia + np.sum([inertia_at(mass, place) for mass, place in places], axis=0)
        self.centre = self.first / robot.mass
        matrix = np.block([[robot.mass * np.eye(3), -skew(self.first)], [skew(self.first), self.inertia]])
        self.inverse = np.linalg.inv(matrix)

    def place(self, moment: Moment) -> None:
        """Where the platform's points are, and how fast."""
        gibbs, turning = moment.state[self.part].reshape(2, 3)
        moment.rotation = self.start @ cayley(gibbs)
        moment.turning = moment.rotation @ turning
        moment.arms = self.body.attachments @ moment.rotation.T
        moment.centre = moment.rotation @ self.centre
        moment.ends = moment.position + moment.arms
        moment.end_velocity = moment.velocity + self.body.attachments @ skew(turning).T @ moment.rotation.T

    def accelerate(self, moment: Moment) -> None:
        """Accelerations by force and moment about the origin."""
        gibbs, turning = moment.state[self.part].reshape(2, 3)
        force, torque, spin = moment.force @ moment.rotation, moment.torque @ moment.rotation, skew(turning)
        right = np.concatenate([force - spin @ (spin @ self.first), torque - spin @ (self.inertia @ turning)])
        accelerations = self.inverse @ right
        moment.acceleration = moment.rotation @ accelerations[:3]
        rate = 0.5 * (turning - spin @ gibbs + (gibbs @ turning) * gibbs)
        moment.rates[self.part] = np.concatenate([rate, accelerations[3:]])

    @property
    def size(self) -> float:
        """Distance of the farthest attachment from the origin, m; 1 where all cables hold the origin."""
        return float(np.linalg.norm(self.body.attachments, axis=1).max()) or 1.0
