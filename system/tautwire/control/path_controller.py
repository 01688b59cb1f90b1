"""A controller put on a path: its data as plain numbers, and its run as an input source of the master."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import sampled_control as law
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.rotation import multiply, quaternion_of
from tautwire_fmu.laws.sampled_control import ControllerState, Limits
from tautwire_fmu.laws.winch_drive import NO_LIMIT

from ..cosimulation.robot_wiring import measured_output_indices
from ..errors import InputError
from ..robot.active_effects import cable_moduli
from ..robot.schema import Robot
from ..robot.static_equilibrium import start_attachments
from ..robot.trajectory import Trajectory
from .design import Design, Knot, measurement_noise
from .feedforward import Reference, elastic_reference

Array = NDArray[np.float64]


def controller_data(robot: Robot, design: Design, reference: Reference) -> dict[str, Any]:
    """The content of a controller's resource: lists and numbers, as the law of the FMU takes them.

    Raises InputError where a regulator acts on pose or tension without a sample of delay, or measures another pose.
    """
    period, knots = design.aim.period, design.knots()
    measured_count = len(measurement_noise(robot))
    for regulator in (knot.regulator for knot in knots if knot.regulator.nstates):
        if regulator.ninputs - regulator.noutputs != measured_count:
            pose = "positions and rotations" if robot.platform.is_rigid_body else "positions"
            problem = f"measures {regulator.ninputs - regulator.noutputs} signals, {robot.name} shows {measured_count}"
            raise InputError(regulator.name, problem, f"design it for {pose} and {robot.cable_count} tensions")
    return {
        "description": f"controller of {robot.name}",
        "period": period,
        "speeds": reference.rigid.tolist(),
        "stretches": (reference.speeds - reference.rigid).tolist(),
        "expected": reference.expected.tolist(),
        "at_rest": reference.at_rest.tolist(),
        "knots": [_knot_data(knot, period) for knot in knots],
        "compliances": cable_compliances(robot).tolist(),
        "yield_time": design.aim.yield_time,
        "tares": design.uses_feedback and design.aim.tare,
        "limits": control_limits(robot, design)._asdict(),
    }


def control_limits(robot: Robot, design: Design) -> Limits:
    """The tighter limits of aim and robot file; no tension limits without feedback."""
    aim, winch, bounds = design.aim, robot.winch, robot.tension
    speed = [aim.speed_limit, winch.speed_limit if winch else None]
    acceleration = [aim.acceleration_limit, winch.acceleration_limit if winch else None]
    lowest = next(x for x in (aim.lowest_tension, bounds.minimum if bounds else None, 0.0) if x is not None)
    highest = next(x for x in (aim.highest_tension, bounds.maximum if bounds else None, NO_LIMIT) if x is not None)
    return Limits(
        speed=min(NO_LIMIT, *(value for value in speed if value is not None)),
        acceleration=min(NO_LIMIT, *(value for value in acceleration if value is not None)),
        lowest_tension=lowest if design.uses_feedback else -NO_LIMIT,
        highest_tension=min(highest, NO_LIMIT) if design.uses_feedback else NO_LIMIT,
    )


def cable_compliances(robot: Robot) -> Array:
    """Compliance of each cable at the start, ``l / (E S)``, shape (n,), in m/N."""
    lengths = np.linalg.norm(np.array(robot.anchors) - np.array(start_attachments(robot)), axis=1)
    stiffness = np.array(cable_moduli(robot)) * [cable.area for cable in robot.cables]
    result: Array = lengths / stiffness
    return result


def _knot_data(knot: Knot, period: float) -> dict[str, Any]:
    regulator = knot.regulator
    sensors = regulator.ninputs - regulator.noutputs
    if np.any(regulator.D[:, :sensors]):
        hint = "delay it by one sample: no direct gain from position or tension"
        raise InputError(regulator.name, "acts on the sample just measured", hint)
    return {
        "sample": knot.time / period,
        "A": regulator.A.tolist(),
        "B": regulator.B.tolist(),
        "C": regulator.C.tolist(),
        "D": regulator.D[:, sensors:].tolist(),
        "M": knot.tracking.tolist(),
    }


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
        self.reference = reference
        self.plan = law.plan_from_resource(controller_data(robot, controller, reference))
        self.limits = control_limits(robot, controller)
        noise = measurement_noise(robot)
        self.noise = np.zeros((len(reference.expected), len(noise)))
        if seed is not None:
            self.noise = np.random.default_rng(seed).standard_normal(self.noise.shape) * noise
        self._sensors = measured_output_indices(robot.cable_count, robot.platform.is_rigid_body)
        self.times = times
        self._controller_state = law.initial_controller_state(self.plan, self.limits)
        self._measurement: list[float] | None = None
        self._speeds = [self._controller_state.begin, self._controller_state.end]

    @property
    def speeds(self) -> Array:
        """Winch speeds at the past samples and at the end of the present one, in m/s."""
        return np.array(self._speeds)

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`; ``index`` counts the controller's samples."""
        if step > 0.0:
            self._take_sample(index, outputs)
        begin, rate = (
            np.array(self._controller_state.begin),
            np.array(law.acceleration(self.plan, self._controller_state)),
        )
        start = begin + (time - self.times[index]) * rate
        return np.column_stack([start, rate]).ravel(), np.column_stack([start + step * rate, rate]).ravel()

    def _next_state(self, controller_state: ControllerState, measurement: list[float]) -> ControllerState:
        """The state of the next sample, from the measurement at the beginning of this one."""
        return law.next_controller_state(self.plan, self.limits, controller_state, measurement)

    def _take_sample(self, index: int, outputs: Array) -> None:
        """Takes a sample once; the measurement of the previous sample is then processed and acts."""
        if self._measurement is not None and index == self._controller_state.sample:
            return
        if self._measurement is not None:
            self._controller_state = self._next_state(self._controller_state, self._measurement)
            self._speeds.append(self._controller_state.end)
        self._measurement = _with_noise(outputs[self._sensors].tolist(), self.noise[index].tolist())


def _with_noise(measured: list[float], noise: list[float]) -> list[float]:
    """Measurements with noise, of an orientation by a rotation vector in the axes of the world."""
    if len(measured) == len(noise):
        return [value + error for value, error in zip(measured, noise, strict=True)]
    position, orientation, tensions = measured[:3], measured[3:7], measured[7:]
    turned = multiply(quaternion_of(REAL, noise[3:6]), orientation)
    rest = zip([*position, *tensions], [*noise[:3], *noise[6:]], strict=True)
    x, y, z, *noisy_tensions = (value + error for value, error in rest)
    return [x, y, z, *turned, *noisy_tensions]
