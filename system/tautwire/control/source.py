"""A controller as an input source of the co-simulation master."""

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
from .plan import control_limits, controller_data

Array = NDArray[np.float64]


class PathController:
    """A controller on one path as a source of winch speeds for the master, at the controller's samples.

    ``robot`` is the controller's model; ``times`` (N,) in s are its samples. It follows ``reference``, by
    default that of the elastic model. ``seed`` enables measurement noise. ``speeds`` (N, n) are the winch speeds
    at the samples so far.

    Raises UnreachableError where the path requires a cable to push.
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
        self.plan = law.plan_from_resource(controller_data(robot, controller, reference))
        self.limits = control_limits(robot, controller)
        self.noise = np.zeros_like(reference.expected)
        if seed is not None:
            standard_noise = np.random.default_rng(seed).standard_normal(self.noise.shape)
            self.noise = standard_noise * measurement_noise(robot)
        self.times = times
        self._controller_state = law.initial_controller_state(self.plan, self.limits)
        self._measurement: list[float] | None = None
        self._speeds = [self._controller_state.begin, self._controller_state.end]

    @property
    def speeds(self) -> Array:
        """Winch speeds at the past samples and at the end of the present one, in m/s."""
        return np.array(self._speeds)

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.Source`; ``index`` counts the controller's samples."""
        if step > 0.0:
            self._take_sample(index, outputs)
        begin, rate = (
            np.array(self._controller_state.begin),
            np.array(law.acceleration(self.plan, self._controller_state)),
        )
        start = begin + (time - self.times[index]) * rate
        return np.column_stack([start, rate]).ravel(), np.column_stack([start + step * rate, rate]).ravel()

    def _take_sample(self, index: int, outputs: Array) -> None:
        """Takes a sample once; the measurement of the previous sample is then processed and acts."""
        if self._measurement is not None and index == self._controller_state.sample:
            return
        if self._measurement is not None:
            self._controller_state = law.next_controller_state(
                self.plan, self.limits, self._controller_state, self._measurement
            )
            self._speeds.append(self._controller_state.end)
        count = self.controller.cable_count
        measured = np.concatenate([outputs[:3], outputs[6 : 6 + count]])
        self._measurement = (measured + self.noise[index]).tolist()
