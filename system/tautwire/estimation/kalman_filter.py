"""Extended Kalman filter: outputs and time update of a robot's model as CasADi functions, with their derivatives.

:mod:`tautwire.estimation.covariance_recursion` runs them over a recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import casadi
import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from ..robot.symbolic_model import SymbolicModel, constants_as_parameters
from .disturbance import Disturbance, disturbance_state_count
from .integration_steps import Substeps
from .measurement_model import measurement_model


@dataclass(frozen=True)
class Noise:
    """Noise levels as standard deviations: position (m), tension (N), winch speed (m/s), and start position (m).

    Of a start that is not known at rest: its velocity (m/s), how far it is from equilibrium (m), and tensions that hold
    nothing (N). ``own`` are those of single outputs (3 + n) where they differ from the others of their kind. With a
    ``disturbance``, which has a white noise of its own, those of outputs are not used by the filter.
    """

    position: float
    tension: float
    winch_speed: float
    start_position: float
    start_velocity: float = 0.0
    start_stretch: float = 0.0
    self_stress: float = 0.0
    own: tuple[float, ...] = ()
    disturbance: Disturbance | None = None

    def of_outputs(self, cable_count: int) -> tuple[float, ...]:
        """Of x, y, z and each tension."""
        return self.own or (*[self.position] * 3, *[self.tension] * cable_count)

    def white_variances(self, cable_count: int) -> NDArray[np.float64]:
        """Variances (3 + n,) of the white noise of x, y, z and each tension."""
        if self.disturbance:
            return self.disturbance.white_variances(cable_count)
        return np.square(self.of_outputs(cable_count))


def output_function(model: SymbolicModel, cable_count: int, noise: Noise, has_sensitivities: bool = True) -> Function:
    """Outputs of a predicted state, of disturbance states behind the model's too, with their derivatives.

    Arguments: state, parameters, shift, speed, next speed, time step. Results: x, y, z and the tensions as shown
    ``shift`` (s) later (m,), and their derivatives by the state (m, n) and by the parameters (m, p). Without
    sensitivities p is 0, whatever parameters the model has.
    """
    disturbance = _DisturbanceSymbols(cable_count if noise.disturbance else None)
    state, shift = SX.sym("state", model.states.numel() + disturbance.count), SX.sym("shift", 3 + cable_count)
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    instant = [casadi.vertcat(speed, SX(3, 1)), model.parameters, later, step, shift]
    outputs = measurement_model(model, cable_count).call([state[: model.states.numel()], *instant])
    expected, by_state, by_parameters = disturbance.added_to(outputs, state)
    count = model.parameters.numel() if has_sensitivities else 0
    arguments = [state, model.parameters, shift, speed, later, step]
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
    disturbance is that of :meth:`Disturbance.filter_arguments`, and empty where the noise has none.

    Results: the next state (n,); the derivatives of those d states that do not only decay, by the first c states (d, c)
    and by the parameters (d, p); the factors by which states decay, and the variances that are added to them (n,). The
    model's last ``constant_count`` states are constant.
    """
    disturbance = _DisturbanceSymbols(cable_count if noise.disturbance else None)
    model_size = model.states.numel()
    state = SX.sym("state", model_size + disturbance.count)
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    drift, acceleration_noise_density = SX.sym("drift"), SX.sym("acceleration_noise_density")
    interval = _Interval(speed, later, step, substeps)
    moved, transition, direct_sensitivity = disturbance.time_update(model, constant_count, state, interval)
    process_noise = SX(state.numel(), 1)
    process_noise[3:6] = acceleration_noise_density**2 * step
    process_noise[6 : 6 + cable_count] = noise.winch_speed**2 * drift
    process_noise[model_size:] = disturbance.process_noise(step)
    moving = model_size - constant_count
    count = model.parameters.numel() if has_sensitivities else 0
    arguments = [state, model.parameters, speed, later, step, drift, acceleration_noise_density, disturbance.arguments]
    results = [
        moved,
        transition[:moving, : model_size + (3 if disturbance.count else 0)],
        direct_sensitivity[:moving, :count],
        casadi.vertcat(SX.ones(model_size), disturbance.decay(step)),
        process_noise,
    ]
    return Function("time_update", arguments, results)


class _DisturbanceSymbols:
    """The disturbance states behind those of a model, and their numbers as symbols; none without a disturbance."""

    def __init__(self, cable_count: int | None) -> None:
        self.count = 0 if cable_count is None else disturbance_state_count(cable_count)
        self.decay_rates, self._variances = SX.sym("decay_rate", self.count), SX.sym("variance", self.count)
        self.arguments = casadi.vertcat(self.decay_rates, self._variances)

    def added_to(self, outputs: Sequence[SX], state: SX) -> Sequence[SX]:
        """The outputs with their errors, and the derivatives of these by the states."""
        if not self.count:
            return outputs
        expected, by_state, by_parameters = outputs
        count = expected.numel()
        by_errors = casadi.horzcat(SX(count, 3), SX.eye(count))
        return expected + state[state.numel() - count :], casadi.horzcat(by_state, by_errors), by_parameters

    def decay(self, step: SX) -> SX:
        """Factors by which the disturbance states decay in a step."""
        return casadi.exp(-self.decay_rates * step)

    def process_noise(self, step: SX) -> SX:
        """Variances that a step adds to the disturbance states."""
        return self._variances * (1.0 - casadi.exp(-2.0 * self.decay_rates * step))

    def time_update(
        self, model: SymbolicModel, constant_count: int, state: SX, interval: _Interval
    ) -> tuple[SX, SX, SX]:
        """As :func:`_time_update` of the model, with the force that its mean over the step leaves on the platform."""
        if not self.count:
            return _time_update(model, constant_count, state, interval)
        size, parameters = model.states.numel(), model.parameters.numel()
        force, decay = SX.sym("force", 3), self.decay(interval.step)
        mean_decay = casadi.exp(-0.5 * self.decay_rates[:3] * interval.step)
        next_state, transition, sensitivities = casadi.substitute(
            list(_time_update(_with_force(model, force), constant_count, state[:size], interval)),
            [force],
            [mean_decay * state[size : size + 3]],
        )
        by_force = casadi.mtimes(sensitivities[:, parameters:], casadi.diag(mean_decay))
        errors = self.count - 3
        return (
            casadi.vertcat(next_state, decay * state[size:]),
            casadi.vertcat(
                casadi.horzcat(transition, by_force, SX(size, errors)),
                casadi.horzcat(SX(self.count, size), casadi.diag(decay)),
            ),
            casadi.vertcat(sensitivities[:, :parameters], SX(self.count, parameters)),
        )


def _with_force(model: SymbolicModel, force: SX) -> SymbolicModel:
    """The model with a constant force on the platform as three more parameters."""
    external_force = model.inputs[model.inputs.numel() - 3 :]
    (rates,) = casadi.substitute([model.rates], [external_force], [external_force + force])
    return replace(model, rates=rates, parameters=casadi.vertcat(model.parameters, force))


def filter_jacobians(
    model: SymbolicModel, cable_count: int, noise: Noise, substeps: Substeps, constant_count: int = 0
) -> Function:
    """Jacobians of a filter step by the updated state.

    Arguments: state after the measurement update, parameters, speed, next speed, time step, disturbance, as for
    :func:`time_update_function`. Results: derivatives of the state at the next sample (n, n), and of the model's states
    in it by those half a step before it, from the cubic through both ends.
    """
    disturbance = _DisturbanceSymbols(cable_count if noise.disturbance else None)
    model_size = model.states.numel()
    updated = SX.sym("after", model_size + disturbance.count)
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    interval = _Interval(speed, later, step, substeps)
    _, transition, _ = disturbance.time_update(model, constant_count, updated, interval)
    rate_jacobian = Function(
        "bending", [model.states, model.inputs, model.parameters], [casadi.jacobian(model.rates, model.states)]
    )
    jacobian_at_update = rate_jacobian(updated[:model_size], casadi.vertcat(speed, SX(3, 1)), model.parameters)
    identity, of_model = SX.eye(model_size), transition[:model_size, :model_size]
    half_transition = 0.5 * (of_model + identity) + step / 8.0 * casadi.mtimes(identity - of_model, jacobian_at_update)
    arguments = [updated, model.parameters, speed, later, step, disturbance.arguments]
    return Function("filter_slopes", arguments, [casadi.densify(f) for f in (transition, half_transition)])


def simulation_function(model: SymbolicModel, cable_count: int, substeps: Substeps) -> Function:
    """Step of a simulation without noise: the state moves as in :func:`time_update_function`.

    Arguments: state, parameters, speed, next speed, time step. Results: state at the next sample (n,), and x, y, z and
    the tensions of this one without delay (m,).
    """
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    trajectory = _trajectory(model, model.parameters, model.states, _Interval(speed, later, step, substeps))
    no_force = SX.zeros(model.inputs.numel() - cable_count)
    (outputs,) = casadi.substitute([model.outputs], [model.inputs], [casadi.vertcat(speed, no_force)])
    shown = casadi.vertcat(outputs[:3], outputs[6 : 6 + cable_count])
    return Function("simulation", [model.states, model.parameters, speed, later, step], [trajectory[-1], shown])


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
        inputs = casadi.vertcat(0.5 * (begin + end), SX(3, 1))
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
    no_force = SX(3, 1)
    at_begin, at_end = casadi.vertcat(begin, no_force), casadi.vertcat(end, no_force)
    middle = 0.5 * (at_begin + at_end)
    k1 = rates(model.states, at_begin, model.parameters)
    k2 = rates(model.states + 0.5 * step * k1, middle, model.parameters)
    k3 = rates(model.states + 0.5 * step * k2, middle, model.parameters)
    k4 = rates(model.states + step * k3, at_end, model.parameters)
    next_state = model.states + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return Function("runge_kutta_step", [model.states, model.parameters, begin, end, step], [next_state])
