"""A controller at work in our master."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import sampled_control as law

from ..robots.robot import Robot
from ..trajectory import Trajectory
from .aim import measurement_noise
from .design import Design
from .feedforward import elastic_reference
from .path import Reference
from .plan import limits_of, plan_data

Array = NDArray[np.float64]


class PathController:
    """A controller at work on one path: a source of winch speeds for the master, at the controller's samples.

    ``robot`` is what the controller believes; ``times`` (N,) in s are its samples. It follows ``reference``, by
    default that of the elastic model. ``seed`` switches measurement noise on. ``speeds`` (N, n) are the winch speeds
    at the samples so far.

    Raises UnreachableError where the path asks a cable to push.
    """

    def __init__(
        self,
        robot: Robot,
        controller: Design,
        trajectory: Trajectory,
        times: Array,
        seed: int | None = None,
        reference: Reference | None = None,
    ) -> None:
        self.controller = controller
        reference = reference or elastic_reference(robot, trajectory, times)
        self.plan = law.plan_of(plan_data(robot, controller, reference))
        self.limits = limits_of(robot, controller)
        self.noise = np.zeros_like(reference.expected)
        if seed is not None:
            drawn = np.random.default_rng(seed).standard_normal(self.noise.shape)
            self.noise = drawn * measurement_noise(robot)
        self.times = times
        self._memory = law.first_sample(self.plan, self.limits)
        self._seen: list[float] | None = None
        self._speeds = [self._memory.begin, self._memory.end]

    @property
    def speeds(self) -> Array:
        """Winch speeds at the samples passed and at the end of the present one, in m/s."""
        return np.array(self._speeds)

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.master.Source`; samples are the times that the controller was given."""
        if step > 0.0:
            self._look(index, shown)
        begin, rate = np.array(self._memory.begin), np.array(law.acceleration(self.plan, self._memory))
        start = begin + (time - self.times[index]) * rate
        return np.column_stack([start, rate]).ravel(), np.column_stack([start + step * rate, rate]).ravel()

    def _look(self, index: int, shown: Array) -> None:
        """Take a sample, once: what the one before has shown is then computed and acts."""
        if self._seen is not None and index == self._memory.sample:
            return
        if self._seen is not None:
            self._memory = law.next_sample(self.plan, self.limits, self._memory, self._seen)
            self._speeds.append(self._memory.end)
        count = self.controller.cable_count
        measured = np.concatenate([shown[:3], shown[6 : 6 + count]])
        self._seen = (measured + self.noise[index]).tolist()
