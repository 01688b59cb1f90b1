"""Extended Kalman filter: outputs and time update of a robot's model as CasADi functions, with their derivatives.

:mod:`tautwire.estimation.covariance_recursion` runs them over a recording.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import casadi
import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from ..robot.symbolic_model import SymbolicModel, constants_as_parameters
from .disturbance import Disturbance, OrnsteinUhlenbeck
from .disturbance_symbols import DisturbanceSymbols
from .integration_steps import Substeps
from .measurement_model import SensorInstant, measurement_model, output_count


@dataclass(frozen=True)
class Noise:
    """Noise levels as standard deviations: position (m), tension (N), winch speed (m/s), and start position (m).

    Of a platform that turns, ``rotation`` (rad) about each axis, ``start_rotation`` (rad), ``start_angular_velocity``
    (rad/s); ``moment_arm`` (m) turns random accelerations and forces into those about an axis. Without that, None.
    ``rope_lengths`` (n) are errors with a memory (m) of cables whose rope length was recorded in place of a speed. Of a
    start that is not known at rest: its velocity (m/s), how far it is from equilibrium (m), and tensions that hold
    nothing (N). ``own`` are those of single outputs (m) where they differ from the others of their kind. With a
    ``disturbance``, which has a white noise of its own, those of outputs are not used by the filter.
    """

    position: float
    tension: float
    winch_speed: float
    start_position: float
    start_velocity: float = 0.0
    start_stretch: float = 0.0
    self_stress: float = 0.0
    rotation: float | None = None
    start_rotation: float = 0.0
    start_angular_velocity: float = 0.0
    moment_arm: float = 1.0
    rope_lengths: tuple[OrnsteinUhlenbeck, ...] = ()
    own: tuple[float, ...] = ()
    disturbance: Disturbance | None = None

    def of_outputs(self, cable_count: int) -> tuple[float, ...]:
        """Of x, y, z, each tension, and where the platform turns its rotation about each axis (m)."""
        rotations = () if self.rotation is None else (self.rotation,) * 3
        return self.own or (*[self.position] * 3, *[self.tension] * cable_count, *rotations)

    def processes(self, cable_count: int) -> tuple[OrnsteinUhlenbeck, ...]:
        """One for each state behind the model's: errors of recorded rope lengths, and those of the disturbance."""
        return (*self.rope_lengths, *(self.disturbance.processes(cable_count) if self.disturbance else ()))

    def white_variances(self, cable_count: int) -> NDArray[np.float64]:
        """Variances (m,) of the white noise of x, y, z, each tension, and each rotation."""
        if self.disturbance:
            return self.disturbance.white_variances(cable_count)
        return np.square(self.of_outputs(cable_count))


def output_function(model: SymbolicModel, cable_count: int, noise: Noise, has_sensitivities: bool = True) -> Function:
    """Outputs of a predicted state, of disturbance states behind the model's too, with their derivatives.

    Arguments: state, parameters, shift, speed, next speed, time step, measured rotation. Results: x, y, z, tensions and
    rotation from the measured one as shown ``shift`` (s) later (m,), and their derivatives by the state (m, n) and by
    the parameters (m, p). Without sensitivities p is 0, whatever parameters the model has.
    """
    disturbance = disturbance_symbols(model, noise)
    state, instant_symbols = SX.sym("state", model.states.numel() + disturbance.count), SensorInstant.of(model)
    speed = SX.sym("speed", cable_count)
    instant = [with_no_wrench(model, speed), model.parameters, *instant_symbols.symbols]
    model_state = disturbance.with_true_lengths(state, model.states.numel())
    outputs = measurement_model(model, cable_count).call([model_state, *instant])
    expected, by_state, by_parameters = disturbance.added_to(outputs, state)
    count = model.parameters.numel() if has_sensitivities else 0
    later, step, shift, measured_rotation = instant_symbols.symbols
    arguments = [state, model.parameters, shift, speed, later, step, measured_rotation]
    return Function("outputs", arguments, [expected, by_state, by_parameters[:, :count]])


def time_update_function(
    model: SymbolicModel,
    cable_count: int,
    noise: Noise,
    substeps: Substeps,
    constant_count: int = 0,
    has_sensitivities: bool = True,
) -> Function:
    """Time update of a filter: the state at the next sample, its derivatives, and process noise.

    Arguments: state, parameters, speed, next speed, time step, drift, acceleration noise density, disturbance. Drift
    (s^2) times the variance of a winch speed is what its noise adds to the variance of each unstrained length; the
    disturbance has decay rates (1/s) and variances of the states behind the model's, and is empty where there are none.

    Results: the next state (n,); the derivatives of those d states that do not only decay, by the first c states (d, c)
    and by the parameters (d, p); the factors by which states decay, and the variances that are added to them (n,). The
    model's last ``constant_count`` states are constant.
    """
    disturbance = disturbance_symbols(model, noise)
    model_size = model.states.numel()
    state = SX.sym("state", model_size + disturbance.count)
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    drift, acceleration_noise_density = SX.sym("drift"), SX.sym("acceleration_noise_density")
    interval = _Interval(speed, later, step, substeps)
    moved, transition, direct_sensitivity = _time_update_beside(disturbance, model, constant_count, state, interval)
    process_noise = SX(state.numel(), 1)
    first_velocity = model.indices.twist.start
    process_noise[first_velocity : first_velocity + 3] = acceleration_noise_density**2 * step
    process_noise[first_velocity + 3 : model.indices.twist.stop] = (
        acceleration_noise_density**2 * step / noise.moment_arm**2
    )
    for cable in range(cable_count):
        is_length = bool(noise.rope_lengths) and noise.rope_lengths[cable].rms > 0.0
        process_noise[model.indices.lengths.start + cable] = 0.0 if is_length else noise.winch_speed**2 * drift
    process_noise[model_size:] = disturbance.process_noise(step)
    moving = model_size - constant_count
    count = model.parameters.numel() if has_sensitivities else 0
    arguments = [state, model.parameters, speed, later, step, drift, acceleration_noise_density, disturbance.arguments]
    results = [
        moved,
        transition[:moving, : model_size + disturbance.driving_count],
        direct_sensitivity[:moving, :count],
        casadi.vertcat(SX.ones(model_size), disturbance.decay(step)),
        process_noise,
    ]
    return Function("time_update", arguments, results)


def _time_update_beside(
    disturbance: DisturbanceSymbols, model: SymbolicModel, constant_count: int, state: SX, interval: _Interval
) -> tuple[SX, SX, SX]:
    """As :func:`_time_update`, of the states behind the model's too."""
    if not disturbance.count:
        return _time_update(model, constant_count, state, interval)
    results = _time_update(disturbance.driven(model), constant_count, state[: model.states.numel()], interval)
    return disturbance.appended_to(results, state, interval.step)


def rate_jacobian_function(model: SymbolicModel, cable_count: int) -> Function:
    """Jacobian of the rates of a model's states by these (n, n).

    Arguments: state, parameters, speed.
    """
    speed = SX.sym("speed", cable_count)
    by_state = casadi.jacobian(model.rates, model.states)
    (by_state,) = casadi.substitute([by_state], [model.inputs], [casadi.densify(with_no_wrench(model, speed))])
    return Function("rate_jacobian", [model.states, model.parameters, speed], [by_state])


def simulation_function(model: SymbolicModel, cable_count: int, substeps: Substeps) -> Function:
    """Step of a simulation without noise: the state moves as in :func:`time_update_function`.

    Arguments: state, parameters, speed, next speed, time step. Results: state at the next sample (n,), and x, y, z,
    the tensions and the rotation vector of this one without delay (m,).
    """
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    trajectory = _trajectory(model, model.parameters, model.states, _Interval(speed, later, step, substeps))
    (outputs,) = casadi.substitute([model.outputs], [model.inputs], [casadi.densify(with_no_wrench(model, speed))])
    indices = model.indices
    shown = casadi.vertcat(outputs[:3], outputs[indices.tensions], outputs[indices.pose][3:])
    return Function("simulation", [model.states, model.parameters, speed, later, step], [trajectory[-1], shown])


def disturbance_symbols(model: SymbolicModel, noise: Noise) -> DisturbanceSymbols:
    """Symbols of the states behind those of a model."""
    return DisturbanceSymbols(model.indices, len(noise.rope_lengths), output_count(model) if noise.disturbance else 0)


def with_no_wrench(model: SymbolicModel, speed: SX) -> SX:
    """The inputs of a model at some winch speeds, without an external wrench."""
    return casadi.vertcat(speed, SX(model.inputs.numel() - speed.numel(), 1))


@dataclass(frozen=True)
class _Interval:
    """Interval between two samples: winch speeds at both ends, its length, and how it is divided."""

    speed: SX
    next_speed: SX
    step: SX
    substeps: Substeps

    def parts(self, count: int) -> list[tuple[SX, SX]]:
        """Winch speeds at both ends of each of some equal parts."""
        points = [self.speed + (k / count) * (self.next_speed - self.speed) for k in range(count + 1)]
        return list(pairwise(points))


def _time_update(model: SymbolicModel, constant_count: int, state: SX, interval: _Interval) -> tuple[SX, SX, SX]:
    """State after one sample, and its derivatives by the state before and by the parameters.

    The derivatives weigh errors and may be coarser than the state, whose own error would pose as an effect: with the
    Jacobians ``F`` and ``f_p`` of the rates in the middle of a part of the step, to the fourth order or a higher one

        Gamma = h (I + h F / 2 (I + h F / 3 (I + h F / 4)))        A = I + F Gamma        B = Gamma f_p

    Over twice the time that is ``Gamma + A Gamma``: decays which are far quicker than the step then die, where the
    series would blow up. The last ``constant_count`` states are parameters to that: series of the others take half the
    operations.
    """
    moving, parameter_count = model.states.numel() - constant_count, model.parameters.numel()
    reduced = constants_as_parameters(model, constant_count)
    theta = casadi.vertcat(model.parameters, state[moving:])
    trajectory = _trajectory(reduced, theta, state[:moving], interval)
    transition, sensitivities = _sensitivities(reduced, theta, trajectory, interval)
    return (
        casadi.vertcat(trajectory[-1], state[moving:]),
        casadi.vertcat(
            casadi.horzcat(transition, sensitivities[:, parameter_count:]),
            casadi.horzcat(SX(constant_count, moving), SX.eye(constant_count)),
        ),
        casadi.vertcat(sensitivities[:, :parameter_count], SX(constant_count, parameter_count)),
    )


def _trajectory(model: SymbolicModel, theta: SX, state: SX, interval: _Interval) -> list[SX]:
    """States at the ends of the parts of a step, from its begin on."""
    runge_kutta_step = _runge_kutta_step(model, interval.speed.numel())
    trajectory, steps = [state], interval.substeps.state
    for begin, end in interval.parts(steps):
        trajectory.append(runge_kutta_step(trajectory[-1], theta, begin, end, interval.step / steps))
    return trajectory


def _sensitivities(model: SymbolicModel, theta: SX, trajectory: list[SX], interval: _Interval) -> tuple[SX, SX]:
    """Derivatives of the end of a trajectory by its begin and by the parameters, whose values are ``theta``."""
    rate_jacobians = Function(
        "slope",
        [model.states, model.inputs, model.parameters],
        [casadi.jacobian(model.rates, symbol) for symbol in (model.states, model.parameters)],
    )
    count, substeps = trajectory[0].numel(), interval.substeps
    transition, sensitivities = SX.eye(count), SX(count, theta.numel())
    substep = interval.step / substeps.slope
    for index, (begin, end) in enumerate(interval.parts(substeps.slope)):
        middle = _interpolated(trajectory, (index + 0.5) / substeps.slope)
        inputs = with_no_wrench(model, 0.5 * (begin + end))
        by_state, by_parameters = rate_jacobians(middle, inputs, theta)
        gamma = _integrated_exponential(by_state, substep / 2**substeps.doublings, substeps.order)
        for _ in range(substeps.doublings):
            gamma = 2.0 * gamma + casadi.mtimes(casadi.mtimes(by_state, gamma), gamma)
        substep_transition = SX.eye(count) + casadi.mtimes(by_state, gamma)
        transition = casadi.mtimes(substep_transition, transition)
        sensitivities = casadi.mtimes(substep_transition, sensitivities) + casadi.mtimes(gamma, by_parameters)
    return transition, sensitivities


def _interpolated(trajectory: list[SX], fraction: float) -> SX:
    """Linear interpolation in a trajectory of equal steps."""
    steps = len(trajectory) - 1
    interval = min(int(fraction * steps), steps - 1)
    return trajectory[interval] + (fraction * steps - interval) * (trajectory[interval + 1] - trajectory[interval])


def _integrated_exponential(rate_jacobian: SX, step: SX, order: int) -> SX:
    """Integral of the matrix exponential over a step, as a series: what a constant rate adds to the state."""
    identity = SX.eye(rate_jacobian.shape[0])
    series = identity
    for term in range(order, 1, -1):
        series = identity + (step / term) * casadi.mtimes(rate_jacobian, series)
    return step * series


def _runge_kutta_step(model: SymbolicModel, cable_count: int) -> Function:
    rates = Function("rates", [model.states, model.inputs, model.parameters], [model.rates])
    begin, end, step = SX.sym("begin", cable_count), SX.sym("end", cable_count), SX.sym("step")
    at_begin, at_end = with_no_wrench(model, begin), with_no_wrench(model, end)
    middle = 0.5 * (at_begin + at_end)
    k1 = rates(model.states, at_begin, model.parameters)
    k2 = rates(model.states + 0.5 * step * k1, middle, model.parameters)
    k3 = rates(model.states + 0.5 * step * k2, middle, model.parameters)
    k4 = rates(model.states + step * k3, at_end, model.parameters)
    next_state = model.states + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return Function("runge_kutta_step", [model.states, model.parameters, begin, end, step], [next_state])
