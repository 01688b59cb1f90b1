"""Winch programs that lead and turn a platform, and rich ones of them that keep every rope tight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.rig.modes import frequencies_of
from tests.rig.program import smooth_rise
from tests.rig.robot import Body, Robot, Vector
from tests.rig.statics import start_tensions
from tests.rig.turning import Turning, cayley

RATIOS = np.array([0.3, 0.5, 0.75, 1.35, 1.9])


@dataclass(frozen=True)
class PoseProgram:
    """Winches that would lead stiff ropes along a pose: start + s(t) (shift + sum_k a_k sin(w_k t + f_k)).

    The six coordinates are those of the origin of the platform's frame (m) and of the Gibbs vector from its start
    orientation; s as in :class:`tests.rig.program.PathProgram`.
    """

    anchors: Vector
    body: Body
    start: Vector
    shift: Vector  # (6)
    amplitudes: Vector  # (tones, 6)
    angular: Vector  # (tones), rad/s
    phases: Vector  # (tones, 6), rad
    rise: float

    @property
    def kinks(self) -> Sequence[float]:
        """The end of the rise."""
        return (self.rise,)

    def pose(self, time: float) -> tuple[Vector, Vector]:
        """Planned coordinates, displacements and Gibbs vector, and their rates; (6) and (6)."""
        share, share_rate = smooth_rise(time, self.rise)
        angles = self.angular[:, None] * time + self.phases
        offset = self.shift + (self.amplitudes * np.sin(angles)).sum(axis=0)
        offset_rate = (self.amplitudes * self.angular[:, None] * np.cos(angles)).sum(axis=0)
        return share * offset, share_rate * offset + share * offset_rate

    def spans(self, time: float) -> Vector:
        """From each attachment to its exit point (n, 3), m."""
        place, _ = self.pose(time)
        arms = self.body.attachments @ (self.body.orientation @ cayley(place[3:])).T
        return np.asarray(self.anchors - self.start - place[:3] - arms, float)

    def speed(self, time: float) -> Vector:
        """Minus the rate of the planned rope lengths."""
        place, rate = self.pose(time)
        rotation, spans = self.body.orientation @ cayley(place[3:]), self.spans(time)
        gibbs, gibbs_rate = place[3:], rate[3:]
        turning = 2.0 * (gibbs_rate - np.cross(gibbs, gibbs_rate)) / (1.0 + gibbs @ gibbs)
        velocities = rate[:3] + np.cross(turning, self.body.attachments) @ rotation.T
        return np.asarray(np.sum(spans * velocities, axis=1) / np.linalg.norm(spans, axis=1), float)

    def travel(self, time: float) -> Vector:
        """Start length minus the planned length."""
        start, planned = (np.linalg.norm(self.spans(instant), axis=1) for instant in (0.0, time))
        return np.asarray(start - planned, float)


def pose_wander(
    robot: Robot,
    seed: int,
    reach: float,
    tilt: float,
    slow: tuple[float, float] = (8.0, 25.0),
    shake: float = 0.2,
) -> PoseProgram:
    """A rich program: slow tones within `reach` (m) and `tilt` (rad), and fast ones that shake the ropes.

    `slow` bounds the slow periods, s; each fast tone has an acceleration near `shake`, m/s^2, also of the attachments
    as the platform turns. Both shrink until stiff ropes would stay tight along the whole way. Fewer than six cables do
    not turn a platform at will: `tilt` has to be zero.
    """
    body = robot.body
    assert body is not None
    random = np.random.default_rng(seed)
    size = Turning(robot, body).size
    scale = np.array([1.0] * 3 + ([0.5 / size] * 3 if tilt else [0.0] * 3))
    slow_angular = 2 * np.pi / random.uniform(*slow, size=4)
    slow_amplitudes = np.hstack([0.5 * reach * _spread(random, 4), 0.25 * tilt * _spread(random, 4)])
    modes = frequencies_of(robot)[-3:]
    fast_angular = 2 * np.pi * RATIOS * random.uniform(0.95, 1.05, 5) * np.exp(np.log(modes).mean())
    fast_amplitudes = np.hstack([_spread(random, 5), _spread(random, 5)]) * scale * (shake / fast_angular**2)[:, None]
    phases = random.uniform(0, 2 * np.pi, (9, 6))
    for _ in range(30):
        program = PoseProgram(
            anchors=robot.anchors,
            body=body,
            start=robot.start,
            shift=np.zeros(6),
            amplitudes=np.vstack([slow_amplitudes, fast_amplitudes]),
            angular=np.concatenate([slow_angular, fast_angular]),
            phases=phases,
            rise=0.75 * slow[0],
        )
        if _stays_tight(robot, program):
            return program
        slow_amplitudes = slow_amplitudes * 0.85
    raise ValueError("no reach keeps every rope tight here")


def _spread(random: np.random.Generator, count: int) -> Vector:
    """Random directions with lengths between 0.6 and 1."""
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.asarray(directions * random.uniform(0.6, 1.0, (count, 1)), float)


def _stays_tight(robot: Robot, program: PoseProgram, share: float = 0.4) -> bool:
    """Whether static tensions stay above a share of the smallest start tension over a minute."""
    floor: float | None = None
    for time in np.arange(0.0, 60.0, 0.5):
        try:
            lowest = float(_static_tensions(robot, program, float(time)).min())
        except ValueError:
            return False
        floor = share * lowest if floor is None else floor
        if lowest < floor:
            return False
    return True


def _static_tensions(robot: Robot, program: PoseProgram, time: float) -> Vector:
    """Tensions at the planned pose; of fewer than six cables those that leave the least."""
    assert robot.body is not None
    spans, turning = program.spans(time), Turning(robot, robot.body)
    directions = spans / np.linalg.norm(spans, axis=1, keepdims=True)
    rotation = robot.body.orientation @ cayley(program.pose(time)[0][3:])
    moments = np.cross(robot.body.attachments @ rotation.T, directions) / turning.size
    weight = np.array([0.0, 0.0, -robot.mass * robot.gravity])
    load = np.concatenate([weight, np.cross(rotation @ turning.centre, weight) / turning.size])
    rows = np.hstack([directions, moments])
    if robot.count < 6:
        return np.asarray(np.linalg.lstsq(rows.T, -load, rcond=None)[0], float)
    return start_tensions(rows, load, robot.tension)
