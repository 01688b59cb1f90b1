"""Smoothed estimates from a whole recording: uncertain declared constants and the initial state.

They are constant states of the augmented filter, so its last state estimates them from the whole recording.

Fixed-point smoothing of the filter's first state by all samples: with whitened innovations ``e_k`` and their slopes
``J_k`` by it

    x_0|N = x_0 - P_0 sum_k J_k' e_k

Source: Anderson and Moore (1979), Optimal Filtering, sec. 7.2.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import casadi
import numpy as np
from numpy.typing import NDArray

from ..errors import UnreachableError
from ..recordings.recording import Recording
from ..recordings.start_position import with_start
from ..robot.measured_start import with_true_start
from ..robot.schema import InitialState, Robot
from ..robot.static_equilibrium import static_tensions
from ..robot.symbolic_model import SymbolicModel
from ..robot.uncertain_parameters import (
    ANCHOR,
    DAMPING,
    MASS,
    MODULUS,
    UncertainParameter,
    limited_perturbation,
    perturbed_robot,
    sensor_errors,
    uncertain_parameters,
)
from .estimation_data import DataSet
from .filter_linearisation import linearise_filter
from .hypotheses import Hypothesis
from .kalman_filter import Noise
from .likelihood import Likelihood
from .measured_outputs import orientations
from .parameter_fit import NORMAL_QUANTILE_95, Fitter
from .trace_result import FoundEffect

Array = NDArray[np.float64]

# Standard deviations by which a constant has to differ from its declared value to be reported.
MIN_REPORTED_SIGMAS = 2.0
# In declared standard deviations: constants that moved by less are counted, not listed.
MIN_LISTED_SIGMAS = 1.0


@dataclass(frozen=True)
class Calibration:
    """Estimates (k,) of uncertain constants and their posterior standard deviations (k,).

    Both count in declared standard deviations; the estimates from the declared values.
    """

    parameters: tuple[UncertainParameter, ...]
    estimates: Array
    standard_deviations: Array

    def clipped(self, max_sigmas: float) -> Calibration:
        """The same with estimates at most so many declared standard deviations from the declared values."""
        return replace(self, estimates=np.clip(self.estimates, -max_sigmas, max_sigmas))

    def widened(self, shifts: Array) -> Calibration:
        """The same with deviations that hold independent shifts (s, k) of the estimates, one deviation each.

        No number is less well known than declared.
        """
        variances = self.standard_deviations**2 + np.sum(np.square(shifts), axis=0)
        return replace(self, standard_deviations=np.fmin(np.sqrt(variances), 1.0))

    def calibrated_robot(self, robot: Robot) -> Robot:
        """The robot with its constants as estimated, each with its posterior uncertainty."""
        updated = perturbed_robot(robot, self.parameters, self.estimates.tolist())
        platform, cables = updated.platform, list(updated.cables)
        for parameter, deviation in zip(self.parameters, self.standard_deviations.tolist(), strict=True):
            if parameter.kind == MASS:
                platform = replace(platform, mass_uncertainty=parameter.standard_deviation * deviation)
            elif parameter.kind in (MODULUS, DAMPING):
                key, index = f"{parameter.kind}_uncertainty", parameter.cable - 1
                cables[index] = replace(cables[index], **{key: parameter.standard_deviation * deviation})
        for number, deviations in self._anchor_deviations().items():
            uncertainty = float(np.sqrt(np.mean(np.square(deviations))))
            cables[number - 1] = replace(cables[number - 1], anchor_uncertainty=uncertainty)
        return replace(updated, platform=platform, cables=tuple(cables))

    def _anchor_deviations(self) -> dict[int, list[float]]:
        """Posterior standard deviations of the uncertain coordinates of each anchor, by cable."""
        deviations: dict[int, list[float]] = {}
        for parameter, deviation in zip(self.parameters, self.standard_deviations.tolist(), strict=True):
            if parameter.kind == ANCHOR:
                deviations.setdefault(parameter.cable, []).append(parameter.standard_deviation * deviation)
        return deviations

    def without_sensor_errors(self, recording: Recording) -> Recording:
        """The recording without the estimated constant errors of its sensors."""
        errors = sensor_errors(self.parameters, self.estimates.tolist(), recording.cable_count)
        gains, offsets = np.array(errors.gains), np.array(errors.offsets)
        if np.all(gains == 1.0) and not np.any(offsets):
            return recording
        return replace(
            recording,
            position=(recording.position - offsets[:3]) / gains[:3],
            tension=(recording.tension - offsets[3:]) / gains[3:],
        )

    def notes(self, robot: Robot, path: str) -> tuple[str, ...]:
        """A note of the constants that differ significantly from their declared values, the farthest first."""
        significant, others = [], 0
        constants = zip(self.parameters, self.estimates.tolist(), self.standard_deviations.tolist(), strict=True)
        for parameter, estimate, deviation in sorted(constants, key=lambda constant: -abs(constant[1])):
            if abs(estimate) < MIN_REPORTED_SIGMAS * deviation:
                continue
            if abs(estimate) < MIN_LISTED_SIGMAS:
                others += 1
                continue
            value, half_width = (
                parameter.declared(robot) + parameter.standard_deviation * estimate,
                1.96 * parameter.standard_deviation * deviation,
            )
            quantity = f"{parameter.label} {value:.4g} {parameter.unit}".rstrip()
            significant.append(f"{quantity}, +- {half_width:.2g} ({estimate:+.1f} declared standard deviations)")
        significant += [f"{others} by less than {MIN_LISTED_SIGMAS:g} declared standard deviation"] if others else []
        if not significant:
            return ()
        return (f"{path}: estimated within the robot file's uncertainties: {'; '.join(significant)}",)


def calibrate(fitter: Fitter, robot: Robot, sample: DataSet, chosen: Collection[Hypothesis] = ()) -> Calibration:
    """Estimate the uncertain constants of a robot with its effects from a recording.

    The effects are taken as exact; robots that differ in those of ``chosen`` share a compiled likelihood.
    """
    parameters = uncertain_parameters(robot)
    if not parameters:
        return Calibration((), np.zeros(0), np.zeros(0))
    likelihood, values = fitter.likelihood(robot, chosen, sample)
    *_, last_segment = likelihood.segments(sample.recording, values)
    end = likelihood.model.states.numel()
    rows = slice(end - len(parameters), end)
    deviations = np.sqrt(np.maximum(np.diag(last_segment.results.covariances[-1])[rows], 0.0))
    estimates = limited_perturbation(last_segment.results.states[rows, -1], np.sqrt)
    return Calibration(parameters, estimates, deviations)


def calibrate_beside_effects(
    fitter: Fitter, robot: Robot, chosen: Collection[Hypothesis], effects: Sequence[FoundEffect], sample: DataSet
) -> Calibration:
    """Estimate the uncertain constants; their deviations hold the intervals of the effects' parameters.

    With half-widths ``w_j`` of the parameters ``theta_j``, each to the farther end, and estimates ``d``

        s^2 = s_exact^2 + sum_j ((d(theta_j + w_j) - d(theta_j)) / 1.96)^2

    What an effect's formula lacks beside nature's is in its intervals, and so moves what is estimated beside it.
    """
    calibration = calibrate(fitter, robot, sample, chosen)
    shifts = []
    for moved in (each for effect in effects for each in _robots_at_interval_ends(robot, effect)):
        try:
            estimates = calibrate(fitter, moved, sample, chosen).estimates
        except UnreachableError:
            continue
        shifts.append((estimates - calibration.estimates) / NORMAL_QUANTILE_95)
    return calibration.widened(np.array(shifts)) if shifts else calibration


def _robots_at_interval_ends(robot: Robot, effect: FoundEffect) -> Iterator[Robot]:
    """The robot with one parameter of the effect after the other at the farther end of its interval."""
    setting = next(each for each in robot.effects if (each.name, each.cables) == (effect.name, effect.cables))
    for name, estimate in effect.parameters.items():
        farther = max(estimate.low, estimate.high, key=lambda end: abs(end - estimate.value))
        yield robot.with_effect(replace(setting, values={**setting.values, name: farther}))


def calibrated_robot(fitter: Fitter, robot: Robot, sample: DataSet) -> Robot:
    """The robot with its uncertain constants as estimated from a recording, see :func:`calibrate`."""
    return calibrate(fitter, robot, sample).calibrated_robot(robot)


def is_initial_state_uncertain(noise: Noise) -> bool:
    """Whether the initial state is uncertain beyond the sensors' noise."""
    deviations = (noise.start_velocity, noise.start_stretch, noise.self_stress, noise.start_angular_velocity)
    return max(deviations) > 0.0


def with_initial_state(fitter: Fitter, robot: Robot, sample: DataSet) -> Robot:
    """The robot with the smoothed initial state of a recording; at rest where the recording starts at rest."""
    robot_at_start = with_true_start(sample.placed(robot))
    if not is_initial_state_uncertain(fitter.noise):
        return robot_at_start
    likelihood, values = fitter.likelihood(robot, (), sample)
    # A simulation that begins there has the robot's own numbers, not those that the smoother would move too.
    constants = np.zeros(len(likelihood.uncertain))
    conditional = likelihood.given_constants(constants)
    # Zeros and gains of sensors are not the robot's numbers: they are as the recording shows them.
    recording = calibrate(fitter, robot, sample).without_sensor_errors(sample.recording)
    smoothed = _smoothed_initial_state(conditional, values, replace(sample, recording=recording))
    state = np.append(smoothed[: conditional.model.states.numel()], constants)
    in_plane, start = robot.axes_in_plane, robot_at_start.platform.start
    # Ropes in a plane cannot hold the platform beside it, where noise shows it.
    x, y, z = (float(state[axis]) if axis in in_plane else start[axis] for axis in range(3))
    indices, model = likelihood.model.indices, likelihood.model
    vx, vy, vz, *turning = state[indices.twist].tolist()
    smoothed_robot = with_start(robot_at_start, (x, y, z))
    velocity = (vx, vy, vz) if fitter.noise.start_velocity > 0.0 else (0.0, 0.0, 0.0)
    initial_state = InitialState(velocity, (0.0,) * robot.cable_count)
    if turning:
        w, x, y, z = orientations(state[indices.pose][None, 3:], model.reference_orientation)[0].tolist()
        wx, wy, wz = turning
        initial_state = replace(initial_state, orientation=(w, x, y, z), angular_velocity=(wx, wy, wz))
        platform = replace(smoothed_robot.platform, start_orientation=(w, x, y, z))
        smoothed_robot = replace(smoothed_robot, platform=platform)
    extra_tensions = _static_tensions_of(model, state, robot.cable_count) - static_tensions(smoothed_robot)
    return replace(smoothed_robot, initial_state=replace(initial_state, tensions=tuple(extra_tensions.tolist())))


def initial_state_note(robot: Robot, path: str) -> tuple[str, ...]:
    """A note of the initial state of a recording where it is not the robot file's."""
    initial_state = robot.initial_state
    if initial_state is None:
        return ()
    tensions = ", ".join(f"{tension:.4g}" for tension in static_tensions(robot) + np.array(initial_state.tensions))
    speed = float(np.linalg.norm(initial_state.velocity))
    moving = f" and a speed of {speed:.3g} m/s" if speed > 0.0 else ""
    return (f"{path}: the estimated initial state has tensions of {tensions} N{moving}",)


def _smoothed_initial_state(likelihood: Likelihood, values: list[float], sample: DataSet) -> Array:
    """Initial state (n,), smoothed by all samples of the recording."""
    state, covariance = likelihood.start(values)
    state_sensitivities = np.eye(len(state))
    score = np.zeros(len(state))
    for segment in linearise_filter(likelihood, values, sample.recording):
        count = len(segment.is_recorded)
        no_direct_sensitivity = np.zeros((count, len(state), len(state)))
        state_sensitivities, innovation_sensitivities = segment.propagate_sensitivities(
            state_sensitivities, no_direct_sensitivity, np.zeros((count, segment.observed.shape[1], len(state)))
        )
        score += np.einsum("kmp,km->p", innovation_sensitivities, segment.values)
    smoothed: Array = state - covariance @ score
    return smoothed


def _static_tensions_of(model: SymbolicModel, state: Array, cable_count: int) -> Array:
    """Static tensions of the ropes (n,) in N with platform and winches held at a state's position."""
    static_state = state.copy()
    static_state[model.indices.twist] = 0.0
    tensions = casadi.Function("tensions", [model.states, model.inputs], [model.span_tensions])
    result: Array = np.array(tensions(static_state, np.zeros(model.inputs.numel()))).ravel()
    return result
