"""One sample of the extended Kalman filter as a CasADi function: take the measurement in, go to the next sample.

Measurements are taken in one by one (their noise is independent), which needs no matrix inverse and lets a missing
one be passed over. Sensitivities by the free parameters are carried along with the gain held fixed.

Source: Bierman (1977), Factorization Methods for Discrete Sequential Estimation, ch. 2; Ljung (1999), ch. 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import casadi
from casadi import SX, Function

from ..model.symbolic import Model
from .sensing import sensing


@dataclass(frozen=True)
class Noise:
    """Standard deviations: position (m), tension (N), winch speed (m/s), and of the start's place (m).

    Of a start that is not known at rest: its velocity (m/s), how far it is from equilibrium (m), and tensions that hold
    nothing (N). ``own`` are those of single outputs (3 + n) where they differ from the others of their kind.
    """

    position: float
    tension: float
    winch_speed: float
    start: float
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

    The latter go by a series of some order, of a part so small that ``doublings`` make it a whole step.
    """

    state: int
    slope: int
    order: int = 4
    doublings: int = 0


@dataclass(frozen=True)
class _Filtered:
    state: SX
    covariance: SX
    slopes: SX
    innovations: SX
    log_variances: SX
    gradient: SX


def filter_sample(model: Model, cable_count: int, noise: Noise, substeps: Substeps) -> Function:
    """Arguments: state, covariance, slopes, parameters, measured, seen, shift, speed, next speed, time step, drift,
    roughness.

    Results: the first three at the next sample, then whitened innovations (m,), log of their variances (m,), and
    the innovations' derivatives by the parameters (m, p), whitened. Measured is x, y, z and the tensions, each as shown
    ``shift`` (s) later; drift (s^2) times the variance of a winch speed is what its noise adds to the variance of each
    unstrained length.
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
    measured, seen, shift = (SX.sym(name, 3 + cable_count) for name in ("measured", "seen", "shift"))
    speed, later = SX.sym("speed", cable_count), SX.sym("later", cable_count)
    step, drift, roughness = SX.sym("step"), SX.sym("drift"), SX.sym("roughness")
    moment = [casadi.vertcat(speed, SX(3, 1)), model.parameters, later, step, shift]
    shown = sensing(model, cable_count).call([predicted.state, *moment])
    filtered = _take_in(shown, noise, predicted, measured, seen)
    state, transition, direct = _advance(model, substeps, filtered.state, speed, later, step)
    spread = _symmetric(casadi.mtimes([transition, filtered.covariance, transition.T]))
    variance = SX(size, 1)
    variance[3:6] = roughness**2 * step
    variance[6 : 6 + cable_count] = noise.winch_speed**2 * drift
    return Function(
        "filter_sample",
        [
            predicted.state,
            predicted.covariance,
            predicted.slopes,
            model.parameters,
            measured,
            seen,
            shift,
            speed,
            later,
            step,
            drift,
            roughness,
        ],
        [
            state,
            spread + casadi.diag(variance),
            casadi.mtimes(transition, filtered.slopes) + direct,
            filtered.innovations,
            filtered.log_variances,
            filtered.gradient,
        ],
    )


def filter_slopes(model: Model, cable_count: int, substeps: Substeps) -> Function:
    """How a sample's filter moves with its state: by the state before, ``d shown``; by the state after, ``d next``.

    Arguments: state before and after measurements are taken in, parameters, shift, speed, next speed, time step.
    Results: derivatives of what sensors show (m, n), of the state at the next sample (n, n), and of that state by the
    one half a step before it (n, n), from the cubic through both ends.
    """
    before, after = SX.sym("before", model.states.numel()), SX.sym("after", model.states.numel())
    shift = SX.sym("shift", 3 + cable_count)
    speed, later, step = SX.sym("speed", cable_count), SX.sym("later", cable_count), SX.sym("step")
    moment = [casadi.vertcat(speed, SX(3, 1)), model.parameters, later, step, shift]
    _, by_state, _ = sensing(model, cable_count).call([before, *moment])
    _, transition, _ = _advance(model, substeps, after, speed, later, step)
    bending = Function(
        "bending", [model.states, model.inputs, model.parameters], [casadi.jacobian(model.rates, model.states)]
    )
    rates = bending(after, casadi.vertcat(speed, SX(3, 1)), model.parameters)
    still = SX.eye(after.numel())
    half = 0.5 * (transition + still) + step / 8.0 * casadi.mtimes(still - transition, rates)
    arguments = [before, after, model.parameters, shift, speed, later, step]
    return Function("filter_slopes", arguments, [casadi.densify(f) for f in (by_state, transition, half)])


def _take_in(shown: Sequence[SX], noise: Noise, predicted: _Filtered, measured: SX, seen: SX) -> _Filtered:
    expected, by_state, by_parameters = shown
    covariance = predicted.covariance
    correction = SX(predicted.state.numel(), 1)
    slopes = predicted.slopes
    rows: list[tuple[SX, SX, SX]] = []
    for index, own in enumerate(noise.of_outputs(expected.numel() - 3)):
        row = by_state[index, :]
        spread = casadi.mtimes(covariance, row.T)
        variance = casadi.mtimes(row, spread) + own**2
        error = measured[index] - expected[index] - casadi.mtimes(row, correction)
        slope = -(casadi.mtimes(row, slopes) + by_parameters[index, :])
        gain = spread * (seen[index] / variance)
        correction = correction + gain * error
        slopes = slopes + casadi.mtimes(gain, slope)
        covariance = _symmetric(covariance - casadi.mtimes(gain, spread.T))
        deviation = casadi.sqrt(variance)
        rows.append((error / deviation, casadi.log(variance), slope / deviation))
    errors, logs, gradients = (casadi.vertcat(*column) for column in zip(*rows, strict=True))
    return _Filtered(predicted.state + correction, covariance, slopes, errors, logs, gradients)


def _advance(model: Model, substeps: Substeps, state: SX, speed: SX, later: SX, step: SX) -> tuple[SX, SX, SX]:
    """State after one sample, and its derivatives by the state before and by the parameters.

    The derivatives weigh errors and may be coarser than the state, whose own error would pose as an effect: with the
    slopes ``F`` and ``f_p`` of the rates in the middle of a part of the step, to the fourth order or a higher one

        Gamma = h (I + h F / 2 (I + h F / 3 (I + h F / 4)))        A = I + F Gamma        B = Gamma f_p

    Over twice the time that is ``Gamma + A Gamma``: decays which are far quicker than the step then die, where the
    series would blow up.
    """
    single = _runge_kutta_step(model, speed.numel())
    path = [state]
    for begin, end in _cuts(speed, later, substeps.state):
        path.append(single(path[-1], model.parameters, begin, end, step / substeps.state))
    slope = Function(
        "slope",
        [model.states, model.inputs, model.parameters],
        [casadi.jacobian(model.rates, symbol) for symbol in (model.states, model.parameters)],
    )
    transition = SX.eye(state.numel())
    direct = SX(state.numel(), model.parameters.numel())
    part = step / substeps.slope
    for index, (begin, end) in enumerate(_cuts(speed, later, substeps.slope)):
        middle = _on(path, (index + 0.5) / substeps.slope)
        inputs = casadi.vertcat(0.5 * (begin + end), SX(3, 1))
        by_state, by_parameters = slope(middle, inputs, model.parameters)
        carried = _carried(by_state, part / 2**substeps.doublings, substeps.order)
        for _ in range(substeps.doublings):
            carried = 2.0 * carried + casadi.mtimes(casadi.mtimes(by_state, carried), carried)
        own = SX.eye(state.numel()) + casadi.mtimes(by_state, carried)
        transition = casadi.mtimes(own, transition)
        direct = casadi.mtimes(own, direct) + casadi.mtimes(carried, by_parameters)
    return path[-1], transition, direct


def _on(path: list[SX], fraction: float) -> SX:
    """A point of a path of equal steps, straight between its points."""
    steps = len(path) - 1
    before = min(int(fraction * steps), steps - 1)
    return path[before] + (fraction * steps - before) * (path[before + 1] - path[before])


def _carried(slopes: SX, step: SX, order: int) -> SX:
    """What a rate that stays makes of the state over a step."""
    still = SX.eye(slopes.shape[0])
    carried = still
    for term in range(order, 1, -1):
        carried = still + (step / term) * casadi.mtimes(slopes, carried)
    return step * carried


def _symmetric(matrix: SX) -> SX:
    """By its upper half alone: the lower one is not worked out."""
    return casadi.triu2symm(casadi.triu(matrix))


def _cuts(speed: SX, later: SX, count: int) -> list[tuple[SX, SX]]:
    """Winch speeds at both ends of equal parts of a sample interval."""
    points = [speed + (k / count) * (later - speed) for k in range(count + 1)]
    return list(pairwise(points))


def _runge_kutta_step(model: Model, cable_count: int) -> Function:
    rates = Function("rates", [model.states, model.inputs, model.parameters], [model.rates])
    begin, end, step = SX.sym("begin", cable_count), SX.sym("end", cable_count), SX.sym("step")
    none = SX(3, 1)
    at_begin, at_end = casadi.vertcat(begin, none), casadi.vertcat(end, none)
    middle = 0.5 * (at_begin + at_end)
    k1 = rates(model.states, at_begin, model.parameters)
    k2 = rates(model.states + 0.5 * step * k1, middle, model.parameters)
    k3 = rates(model.states + 0.5 * step * k2, middle, model.parameters)
    k4 = rates(model.states + step * k3, at_end, model.parameters)
    after = model.states + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return Function("runge_kutta_step", [model.states, model.parameters, begin, end, step], [after])
