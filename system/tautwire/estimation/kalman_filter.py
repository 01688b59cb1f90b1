"""Extended Kalman filter: one sample as a CasADi function, and the integration steps that it takes.

Scalar measurements are processed one by one (their noise is independent), which needs no matrix inverse and skips a
missing one. Sensitivities to the free parameters are propagated with the gain held fixed.

Source: Bierman (1977), Factorization Methods for Discrete Sequential Estimation, ch. 2; Ljung (1999), ch. 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, factorial

import casadi
import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from ..robot.schema import Robot
from ..robot.symbolic_model import SymbolicModel, symbolic_model
from .measurement_model import measurement_model


@dataclass(frozen=True)
class Noise:
    """Noise levels as standard deviations: position (m), tension (N), winch speed (m/s), and start position (m).

    Of a start that is not known at rest: its velocity (m/s), how far it is from equilibrium (m), and tensions that hold
    nothing (N). ``own`` are those of single outputs (3 + n) where they differ from the others of their kind.
    """

    position: float
    tension: float
    winch_speed: float
    start_position: float
    start_velocity: float = 0.0
    start_stretch: float = 0.0
    self_stress: float = 0.0
    own: tuple[float, ...] = ()

    def of_outputs(self, cable_count: int) -> tuple[float, ...]:
        """Of x, y, z and each tension."""
        return self.own or (*[self.position] * 3, *[self.tension] * cable_count)


@dataclass(frozen=True)
class Substeps:
    """Integration steps between two samples: of the state itself, and of its derivatives.

    The latter use a series of some order over a part so small that ``doublings`` make it a whole step.
    """

    state: int
    slope: int
    order: int = 4
    doublings: int = 0


@dataclass(frozen=True)
class _Filtered:
    state: SX
    covariance: SX
    sensitivities: SX
    innovations: SX
    log_variances: SX
    innovation_sensitivities: SX


def filter_step(model: SymbolicModel, cable_count: int, noise: Noise, substeps: Substeps) -> Function:
    """One step of the filter: measurement update, time update, and the sensitivities of both.

    Arguments: state, covariance, sensitivities, parameters, measured, observed, shift, speed, next speed, time step,
    drift, acceleration noise density. Results: the first three at the next sample, then whitened innovations (m,), log
    of their variances (m,), and the innovations' derivatives by the parameters (m, p), whitened. Measured is x, y, z
    and the tensions, each as shown ``shift`` (s) later; drift (s^2) times the variance of a winch speed is what its
    noise adds to the variance of each unstrained length.
    """
    size, count = model.states.numel(), model.parameters.numel()
    predicted = _Filtered(
        SX.sym("state", size),
        SX.sym("covariance", size, size),
        SX.sym("slopes", size, count),
        SX(),
        SX(),
        SX(),
    )
    measured, observed, shift = (SX.sym(name, 3 + cable_count) for name in ("measured", "seen", "shift"))
    speed, later = SX.sym("speed", cable_count), SX.sym("later", cable_count)
    step, drift, acceleration_noise_density = SX.sym("step"), SX.sym("drift"), SX.sym("acceleration_noise_density")
    instant = [casadi.vertcat(speed, SX(3, 1)), model.parameters, later, step, shift]
    outputs = measurement_model(model, cable_count).call([predicted.state, *instant])
    filtered = _measurement_update(outputs, noise, predicted, measured, observed)
    state, transition, direct_sensitivity = _time_update(model, substeps, filtered.state, speed, later, step)
    propagated_covariance = _symmetric(casadi.mtimes([transition, filtered.covariance, transition.T]))
    process_noise = SX(size, 1)
    process_noise[3:6] = acceleration_noise_density**2 * step
    process_noise[6 : 6 + cable_count] = noise.winch_speed**2 * drift
    return Function(
        "filter_sample",
        [
            predicted.state,
            predicted.covariance,
            predicted.sensitivities,
            model.parameters,
            measured,
            observed,
            shift,
            speed,
            later,
            step,
            drift,
            acceleration_noise_density,
        ],
        [
            state,
            propagated_covariance + casadi.diag(process_noise),
            casadi.mtimes(transition, filtered.sensitivities) + direct_sensitivity,
            filtered.innovations,
            filtered.log_variances,
            filtered.innovation_sensitivities,
        ],
    )


def filter_jacobians(model: SymbolicModel, cable_count: int, substeps: Substeps) -> Function:
    """Jacobians of a filter step: of the outputs by the predicted state, of the next state by the updated one.

    Arguments: state before and after the measurement update, parameters, shift, speed, next speed, time step.
    Results: derivatives of the outputs (m, n), of the state at the next sample (n, n), and of that state by the
    one half a step before it (n, n), from the cubic through both ends.
    """
    predicted, updated = SX.sym("before", model.states.numel()), SX.sym("after", model.states.numel())
    shift = SX.sym("shift", 3 + cable_count)
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    instant = [casadi.vertcat(speed, SX(3, 1)), model.parameters, later, step, shift]
    _, by_state, _ = measurement_model(model, cable_count).call([predicted, *instant])
    _, transition, _ = _time_update(model, substeps, updated, speed, later, step)
    rate_jacobian = Function(
        "bending", [model.states, model.inputs, model.parameters], [casadi.jacobian(model.rates, model.states)]
    )
    jacobian_at_update = rate_jacobian(updated, casadi.vertcat(speed, SX(3, 1)), model.parameters)
    identity = SX.eye(updated.numel())
    half_transition = 0.5 * (transition + identity) + step / 8.0 * casadi.mtimes(
        identity - transition, jacobian_at_update
    )
    arguments = [predicted, updated, model.parameters, shift, speed, later, step]
    return Function("filter_slopes", arguments, [casadi.densify(f) for f in (by_state, transition, half_transition)])


def _measurement_update(
    outputs: Sequence[SX], noise: Noise, predicted: _Filtered, measured: SX, observed: SX
) -> _Filtered:
    expected, by_state, by_parameters = outputs
    covariance = predicted.covariance
    correction = SX(predicted.state.numel(), 1)
    sensitivities = predicted.sensitivities
    rows: list[tuple[SX, SX, SX]] = []
    for index, sensor_deviation in enumerate(noise.of_outputs(expected.numel() - 3)):
        output_row = by_state[index, :]
        cross_covariance = casadi.mtimes(covariance, output_row.T)
        innovation_variance = casadi.mtimes(output_row, cross_covariance) + sensor_deviation**2
        innovation = measured[index] - expected[index] - casadi.mtimes(output_row, correction)
        innovation_sensitivity = -(casadi.mtimes(output_row, sensitivities) + by_parameters[index, :])
        gain = cross_covariance * (observed[index] / innovation_variance)
        correction = correction + gain * innovation
        sensitivities = sensitivities + casadi.mtimes(gain, innovation_sensitivity)
        covariance = _symmetric(covariance - casadi.mtimes(gain, cross_covariance.T))
        deviation = casadi.sqrt(innovation_variance)
        rows.append((innovation / deviation, casadi.log(innovation_variance), innovation_sensitivity / deviation))
    whitened_innovations, log_variances, whitened_sensitivities = (
        casadi.vertcat(*column) for column in zip(*rows, strict=True)
    )
    return _Filtered(
        predicted.state + correction,
        covariance,
        sensitivities,
        whitened_innovations,
        log_variances,
        whitened_sensitivities,
    )


def _time_update(
    model: SymbolicModel, substeps: Substeps, state: SX, speed: SX, next_speed: SX, step: SX
) -> tuple[SX, SX, SX]:
    """State after one sample, and its derivatives by the state before and by the parameters.

    The derivatives weigh errors and may be coarser than the state, whose own error would pose as an effect: with the
    Jacobians ``F`` and ``f_p`` of the rates in the middle of a part of the step, to the fourth order or a higher one

        Gamma = h (I + h F / 2 (I + h F / 3 (I + h F / 4)))        A = I + F Gamma        B = Gamma f_p

    Over twice the time that is ``Gamma + A Gamma``: decays which are far quicker than the step then die, where the
    series would blow up.
    """
    runge_kutta_step = _runge_kutta_step(model, speed.numel())
    trajectory = [state]
    for begin, end in _speed_intervals(speed, next_speed, substeps.state):
        trajectory.append(runge_kutta_step(trajectory[-1], model.parameters, begin, end, step / substeps.state))
    rate_jacobians = Function(
        "slope",
        [model.states, model.inputs, model.parameters],
        [casadi.jacobian(model.rates, symbol) for symbol in (model.states, model.parameters)],
    )
    transition = SX.eye(state.numel())
    direct_sensitivity = SX(state.numel(), model.parameters.numel())
    substep = step / substeps.slope
    for index, (begin, end) in enumerate(_speed_intervals(speed, next_speed, substeps.slope)):
        middle = _interpolated(trajectory, (index + 0.5) / substeps.slope)
        inputs = casadi.vertcat(0.5 * (begin + end), SX(3, 1))
        by_state, by_parameters = rate_jacobians(middle, inputs, model.parameters)
        gamma = _integrated_exponential(by_state, substep / 2**substeps.doublings, substeps.order)
        for _ in range(substeps.doublings):
            gamma = 2.0 * gamma + casadi.mtimes(casadi.mtimes(by_state, gamma), gamma)
        substep_transition = SX.eye(state.numel()) + casadi.mtimes(by_state, gamma)
        transition = casadi.mtimes(substep_transition, transition)
        direct_sensitivity = casadi.mtimes(substep_transition, direct_sensitivity) + casadi.mtimes(gamma, by_parameters)
    return trajectory[-1], transition, direct_sensitivity


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


def _symmetric(matrix: SX) -> SX:
    """The matrix made symmetric from its upper half alone: the lower one is not computed."""
    return casadi.triu2symm(casadi.triu(matrix))


def _speed_intervals(speed: SX, next_speed: SX, count: int) -> list[tuple[SX, SX]]:
    """Winch speeds at both ends of each equal part of a sample interval."""
    points = [speed + (k / count) * (next_speed - speed) for k in range(count + 1)]
    return list(pairwise(points))


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


Eigenvalues = NDArray[np.complex128]

# Radians of the fastest vibration in one step of the state, and of its derivatives.
MAX_STATE_ANGLE, MAX_SLOPE_ANGLE = 0.05, 0.7
# Time constants of the fastest decay likewise: what has died away causes no more error.
MAX_STATE_DECAY, MAX_SLOPE_DECAY = 0.5, 2.0
# Up to so many steps of the state, a decay is resolved as finely as a vibration.
MAX_FINE_STEPS = 40
# Truncation error allowed to the series of the derivatives, for a vibration and for a decay.
VIBRATION_TRUNCATION_ERROR, DECAY_TRUNCATION_ERROR, MIN_SERIES_ORDER = 2e-5, 1e-3, 2
# For effects with states, which may be quicker under way than at rest, and in a fit than at its start. With many
# states each doubling costs more than everything else.
DOUBLINGS, MANY_STATES_COUNT, DOUBLINGS_OF_MANY_STATES = 4, 24, 2


def substeps_of_robot(robot: Robot, sample_time: float, state_count: int, has_effect_states: bool) -> Substeps:
    """Integration steps for samples ``sample_time`` (s) apart; ``has_effect_states`` if effects add states."""
    doublings = DOUBLINGS_OF_MANY_STATES if state_count > MANY_STATES_COUNT else DOUBLINGS
    return substeps_of_eigenvalues(eigenvalues_at_start(robot) * sample_time, doublings if has_effect_states else 0)


def substeps_of_eigenvalues(exponents: Eigenvalues, doublings: int = 0) -> Substeps:
    """Integration steps between samples over which the modes change by ``exp(exponents)``."""
    vibration, decay = float(np.max(np.abs(exponents.imag))), float(np.max(np.abs(exponents)))
    fine_steps = min(ceil(decay / MAX_STATE_ANGLE), MAX_FINE_STEPS)
    state = max(1, ceil(vibration / MAX_STATE_ANGLE), ceil(decay / MAX_STATE_DECAY), fine_steps)
    slope = max(1, ceil(vibration / MAX_SLOPE_ANGLE), ceil(decay / MAX_SLOPE_DECAY))
    parts, order = slope * 2**doublings, MIN_SERIES_ORDER
    while any(
        2**doublings * (turn / parts) ** (order + 1) / factorial(order + 1) > left
        for turn, left in ((vibration, VIBRATION_TRUNCATION_ERROR), (decay, DECAY_TRUNCATION_ERROR))
    ):
        order += 1
    return Substeps(state, slope, order, doublings)


def eigenvalues_at_start(robot: Robot) -> Eigenvalues:
    """Eigenvalues of the model linearised at the start, in rad/s."""
    model = symbolic_model(robot)
    jacobian = casadi.Function("a", [model.states, model.inputs], [casadi.jacobian(model.rates, model.states)])
    start_state = casadi.Function("start", [], [model.start])
    matrix = np.array(jacobian(start_state()["o0"], 0.0))
    return np.linalg.eigvals(matrix).astype(complex)
