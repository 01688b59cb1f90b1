"""Extended Kalman filter: outputs and time update of a robot's model as CasADi functions, with their derivatives.

:mod:`tautwire.estimation.covariance_recursion` runs them over a recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi
import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from ..recordings.speed_interpolation import bent_by
from ..robot.symbolic_model import SymbolicModel, constants_as_parameters, with_statics_as_parameters
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

    @property
    def at_rest(self) -> Noise:
        """The same noise where recordings start at rest."""
        return replace(self, start_velocity=0.0, start_stretch=0.0, start_angular_velocity=0.0)

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

    Arguments: state, parameters, static start, shift, speed, next speed, time step, measured rotation. Results: x, y,
    z, tensions and rotation from the measured one as shown ``shift`` (s) later (m,), and their derivatives by the state
    (m, n) and by the parameters and the static start (m, p + s), each with the others held. Without sensitivities the
    last have no columns.
    """
    disturbance, reduced = disturbance_symbols(model, noise), with_statics_as_parameters(model)
    state, instant_symbols = SX.sym("state", model.states.numel() + disturbance.count), SensorInstant.of(model)
    speed = SX.sym("speed", cable_count)
    instant = [with_no_wrench(model, speed), reduced.parameters, *instant_symbols.symbols]
    model_state = disturbance.with_true_lengths(state, model.states.numel())
    outputs = measurement_model(reduced, cable_count).call([model_state, *instant])
    expected, by_state, by_parameters = disturbance.added_to(outputs, state)
    count = by_parameters.shape[1] if has_sensitivities else 0
    later, step, shift, measured_rotation = instant_symbols.symbols
    arguments = [state, model.parameters, model.static_start.symbols, shift, speed, later, step, measured_rotation]
    return Function("outputs", arguments, [expected, by_state, by_parameters[:, :count]])


def process_function(model: SymbolicModel, cable_count: int, noise: Noise) -> Function:
    """Decay and process noise of a filter's states over a step.

    Arguments: time step, drift, acceleration noise density, disturbance. Drift (s^2) times the variance of a winch
    speed is what its noise adds to the variance of each unstrained length; the disturbance has decay rates (1/s) and
    variances of the states behind the model's, and is empty where there are none. Results: the factors by which states
    decay, and the variances that are added to them (n,).
    """
    disturbance, indices = disturbance_symbols(model, noise), model.indices
    model_size = model.states.numel()
    step, drift, density = SX.sym("step"), SX.sym("drift"), SX.sym("acceleration_noise_density")
    process_noise = SX(model_size + disturbance.count, 1)
    first_velocity = indices.twist.start
    process_noise[first_velocity : first_velocity + 3] = density**2 * step
    process_noise[first_velocity + 3 : indices.twist.stop] = density**2 * step / noise.moment_arm**2
    for cable in range(cable_count):
        is_length = bool(noise.rope_lengths) and noise.rope_lengths[cable].rms > 0.0
        process_noise[indices.lengths.start + cable] = 0.0 if is_length else noise.winch_speed**2 * drift
    process_noise[model_size:] = disturbance.process_noise(step)
    decay = casadi.vertcat(SX.ones(model_size), disturbance.decay(step))
    return Function("process", [step, drift, density, disturbance.arguments], [decay, process_noise])


def static_start_function(model: SymbolicModel, constant_count: int = 0, has_sensitivities: bool = True) -> Function:
    """The static start, which stays the same while the uncertain constants do: from one update to the next.

    Arguments: parameters, uncertain constants (c,). Results: numbers of the static start (s,), and their derivatives by
    the parameters and the constants (s, p + c); without sensitivities by neither (s, 0).
    """
    constants = model.states[model.states.numel() - constant_count :]
    others = casadi.vertcat(model.parameters, constants) if has_sensitivities else SX(0, 1)
    results = [model.static_start.values, model.static_start.jacobian(others)]
    return Function("static_start", [model.parameters, constants], results)


def preparation_function(model: SymbolicModel, noise: Noise, constant_count: int = 0) -> Function:
    """What stays the same while a step is integrated: parameters, disturbance, constants, and the static start.

    Arguments: state, parameters, static start, time step, disturbance. Results: the constants of
    :func:`trajectory_function` (q,), and what the disturbances that drive the model are multiplied by, for their means
    over the step (d,).
    """
    disturbance, statics = disturbance_symbols(model, noise), model.static_start.symbols
    size = model.states.numel()
    state, step = SX.sym("state", size + disturbance.count), SX.sym("step")
    driving, constants = disturbance.mean_driving(state, step), state[size - constant_count : size]
    results = [casadi.vertcat(model.parameters, driving, constants, statics), disturbance.mean_decay(step)]
    return Function("preparation", [state, model.parameters, statics, step, disturbance.arguments], results)


def trajectory_function(
    model: SymbolicModel, cable_count: int, noise: Noise, substeps: Substeps, constant_count: int = 0
) -> Function:
    """One of the equal parts of a step: moves the moving states by the method of Runge and Kutta.

    Arguments: moving states, constants as :func:`preparation_function` gives them, speed, next speed, bends, time step,
    and the number of the part, from 0. Result: the moving states at its end.
    """
    driven = disturbance_symbols(model, noise).driven(model)
    reduced = with_statics_as_parameters(constants_as_parameters(driven, constant_count))
    interval, index = _Interval.of(cable_count), SX.sym("index")
    runge_kutta_step = _runge_kutta_step(reduced, cable_count)
    speeds = interval.speeds_in_part(index, substeps.state)
    moved = runge_kutta_step(reduced.states, reduced.parameters, *speeds, interval.step / substeps.state)
    arguments = [reduced.states, reduced.parameters, *interval.symbols, index]
    return Function("trajectory", arguments, [casadi.densify(moved)])


def slope_function(
    model: SymbolicModel,
    cable_count: int,
    noise: Noise,
    substeps: Substeps,
    constant_count: int = 0,
    has_sensitivities: bool = True,
) -> Function:
    """Jacobians of the rates of the moving states in the middle of one of the parts of a step.

    Arguments: moving states, constants as :func:`preparation_function` gives them, speed, next speed, and the number of
    the part, from 0. Results: Jacobians by the moving states (n, n), and by the constants (n, q); without sensitivities
    by the disturbances among them alone (n, d).
    """
    disturbance = disturbance_symbols(model, noise)
    driven = disturbance.driven(model)
    reduced = with_statics_as_parameters(constants_as_parameters(driven, constant_count))
    speed, later, index = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("index")
    middle = speed + (index + 0.5) / substeps.slope * (later - speed)
    own_count, varied = model.parameters.numel(), reduced.parameters
    if not has_sensitivities:
        varied = varied[own_count : own_count + disturbance.driving_count]
    jacobians = [casadi.jacobian(reduced.rates, symbol) for symbol in (reduced.states, varied)]
    slopes = Function("slope", [reduced.states, reduced.inputs, reduced.parameters], jacobians)
    results = slopes(reduced.states, with_no_wrench(reduced, middle), reduced.parameters)
    return Function("slopes", [reduced.states, reduced.parameters, speed, later, index], list(results))


def rate_jacobians_function(model: SymbolicModel, cable_count: int) -> Function:
    """Jacobians of the rates of a model's states by these (n, n) and by the static start (n, s).

    Arguments: state, parameters, static start, speed.
    """
    speed = SX.sym("speed", cable_count)
    statics = model.static_start.symbols
    jacobians = [casadi.jacobian(model.rates_by_statics, each) for each in (model.states, statics)]
    jacobians = casadi.substitute(jacobians, [model.inputs], [casadi.densify(with_no_wrench(model, speed))])
    return Function("rate_jacobians", [model.states, model.parameters, statics, speed], jacobians)


def simulation_function(model: SymbolicModel, cable_count: int, substeps: Substeps) -> Function:
    """Step of a simulation without noise: the state moves as in :func:`trajectory_function`.

    Arguments: state, parameters, static start, speed, next speed, bends, time step. Results: state at the next sample
    (n,), and x, y, z, the tensions and the rotation vector of this one without delay (m,).
    """
    interval, reduced, indices = _Interval.of(cable_count), with_statics_as_parameters(model), model.indices
    next_state = _moved(reduced, interval, substeps.state)
    at_sample = casadi.densify(with_no_wrench(model, interval.speed))
    (outputs,) = casadi.substitute([reduced.outputs], [model.inputs], [at_sample])
    shown = casadi.vertcat(outputs[:3], outputs[indices.tensions], outputs[indices.pose][3:])
    arguments = [model.states, model.parameters, model.static_start.symbols, *interval.symbols]
    return Function("simulation", arguments, [next_state, shown])


def disturbance_symbols(model: SymbolicModel, noise: Noise) -> DisturbanceSymbols:
    """Symbols of the states behind those of a model."""
    return DisturbanceSymbols(model.indices, len(noise.rope_lengths), output_count(model) if noise.disturbance else 0)


def with_no_wrench(model: SymbolicModel, speed: SX) -> SX:
    """The inputs of a model at some winch speeds, without an external wrench."""
    return casadi.vertcat(speed, SX(model.inputs.numel() - speed.numel(), 1))


@dataclass(frozen=True)
class _Interval:
    """Interval between two samples: winch speeds (n) at both ends, their ``bends`` (2n) between, and its length (s).

    For the bends see :mod:`tautwire.recordings.speed_interpolation`.
    """

    speed: SX
    next_speed: SX
    bends: SX
    step: SX

    @classmethod
    def of(cls, cable_count: int) -> _Interval:
        """New symbols for a number of cables."""
        return cls(
            SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("bends", 2 * cable_count), SX.sym("step")
        )

    @property
    def symbols(self) -> list[SX]:
        """All of them, in the order of their columns."""
        return [self.speed, self.next_speed, self.bends, self.step]

    def speeds_in_part(self, index: SX | int, count: int) -> list[SX]:
        """Winch speeds at the begin, in the middle, and at the end of one of some equal parts."""
        bends = casadi.vertsplit(self.bends, self.speed.numel())
        begin, end = (self.speed + (index + k) / count * (self.next_speed - self.speed) for k in (0, 1))
        lines = ((0.0, begin), (0.5, 0.5 * (begin + end)), (1.0, end))
        return [line + bent_by((index + share) / count, *bends) for share, line in lines]


def _moved(model: SymbolicModel, interval: _Interval, part_count: int) -> SX:
    """The states at the end of an interval that is integrated in equal parts."""
    runge_kutta_step, states = _runge_kutta_step(model, interval.speed.numel()), model.states
    for index in range(part_count):
        speeds = interval.speeds_in_part(index, part_count)
        states = runge_kutta_step(states, model.parameters, *speeds, interval.step / part_count)
    return states


def _runge_kutta_step(model: SymbolicModel, cable_count: int) -> Function:
    rates = Function("rates", [model.states, model.inputs, model.parameters], [model.rates])
    speeds, step = [SX.sym(name, cable_count) for name in ("begin", "middle", "end")], SX.sym("step")
    at_begin, in_middle, at_end = (with_no_wrench(model, each) for each in speeds)
    k1 = rates(model.states, at_begin, model.parameters)
    k2 = rates(model.states + 0.5 * step * k1, in_middle, model.parameters)
    k3 = rates(model.states + 0.5 * step * k2, in_middle, model.parameters)
    k4 = rates(model.states + step * k3, at_end, model.parameters)
    next_state = model.states + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return Function("runge_kutta_step", [model.states, model.parameters, *speeds, step], [next_state])
