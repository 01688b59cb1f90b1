"""Simulation of a single cable FMU along the measured path with the recorded winch speed, and its error propagation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import NDArray

from ...cosimulation import Component
from ...fmus.fmu_variables import INPUT_TIME
from ...robot.schema import AXES
from .path_smoothing import SmoothedPath

Array = NDArray[np.float64]

MOTION = tuple(f"{name}.{axis}" for name in ("position", "velocity") for axis in AXES)
INPUT_RATES = (*(f"acceleration.{axis}" for axis in AXES), "winch_acceleration")
OUTPUTS = ("tension", "length", *(f"force.{axis}" for axis in AXES))
# Finite-difference steps of the inputs in m, m/s, m/s, for the sensitivities of the tension.
PERTURBATIONS = np.array([1e-4] * 3 + [1e-3] * 3 + [1e-3])
MAX_LINEARISATIONS = 50


@dataclass(frozen=True)
class CableSimulation:
    """Simulated cable FMU at N times: ``tension`` in N and ``length`` in m (N,), ``force`` (N, 3) on the platform in N.

    ``sensitivities`` (N, 7) of the tension are by position (N/m), velocity and winch speed (N s/m).
    """

    tension: Array
    length: Array
    force: Array
    sensitivities: Array

    @property
    def stiffness(self) -> Array:
        """Stiffness, tension per metre of rope let out less, N/m; shape (N,)."""
        return np.linalg.norm(self.sensitivities[:, :3], axis=1)


def simulate_cable(
    name: str, fmu: FilePath, path: SmoothedPath, winch_speed: Array, winch_acceleration: Array | None = None
) -> CableSimulation:
    """Simulate a cable FMU from sample to sample along a path, winch speeds (N,) in m/s; raises ComponentError.

    Speeds are linear between samples, where their rate jumps, or cubic with the rates (N,) in m/s^2.
    """
    time, rates = path.time, winch_acceleration
    if rates is None:
        rates = np.append(0.0, np.diff(winch_speed) / np.diff(time))
    input_rows = np.hstack([path.position, path.velocity, winch_speed[:, None], path.acceleration, rates[:, None]])
    results = np.empty((len(time), len(OUTPUTS)))
    linearised_rows = np.unique(np.linspace(0, len(time) - 1, min(MAX_LINEARISATIONS, len(time))).astype(int))
    sensitivities = np.empty((len(linearised_rows), len(PERTURBATIONS)))
    linearisation_index = {int(row): index for index, row in enumerate(linearised_rows)}
    with Component(name, fmu) as component:
        inputs, outputs = component.block((INPUT_TIME, *MOTION, "winch_speed", *INPUT_RATES)), component.block(OUTPUTS)
        next_rate = component.block(INPUT_RATES[-1:])
        component.initialize(float(time[0]), {})
        component.run()
        for row, input_values in enumerate(input_rows):
            if row and winch_acceleration is None:
                next_rate.values[0] = rates[row]
                component.write(next_rate)
            inputs.values[0], inputs.values[1:] = time[row], input_values
            component.write(inputs)
            if row:
                component.step(float(time[row - 1]), float(time[row] - time[row - 1]))
            component.read(outputs)
            results[row] = outputs.values
            if row in linearisation_index:
                sensitivities[linearisation_index[row]] = _tension_sensitivities(
                    component, input_values[: len(PERTURBATIONS)]
                )
    is_taut = (results[:, 0] > 0.0)[:, None]
    interpolated = np.column_stack([np.interp(time, time[linearised_rows], column) for column in sensitivities.T])
    return CableSimulation(results[:, 0], results[:, 1], results[:, 2:], np.where(is_taut, interpolated, 0.0))


def tension_variance(
    run: CableSimulation, path: SmoothedPath, load_cell_noise: float, winch_speed_noise: float
) -> Array:
    """Variance of measured less simulated tension without drift, in N^2; shape (N,).

    Due to noise of the load cell (standard deviation in N), of the path, and of the winch speed (in m/s) directly.
    """
    sensitivities_by_axis = np.stack([run.sensitivities[:, :3], run.sensitivities[:, 3:6]], axis=2)
    path_variance = np.einsum(
        "nai,naij,naj->n", sensitivities_by_axis, path.covariance[:, :, :2, :2], sensitivities_by_axis
    )
    variance: Array = load_cell_noise**2 + path_variance + (run.sensitivities[:, 6] * winch_speed_noise) ** 2
    return variance


def drift_variance(run: CableSimulation, time: Array, winch_speed_noise: float) -> tuple[Array, float]:
    """Variance of the tension by integrated noise of the winch speeds, in N^2; (N,), and that of its mean.

    With speeds linear between samples ``h_k`` apart and of noise ``sigma`` (m/s), rope let out has the variance
    ``sigma^2 sum h_k^2``.
    """
    steps = np.diff(time, prepend=time[0])
    increment_variances = (winch_speed_noise * steps) ** 2
    remaining_stiffness = np.cumsum(run.stiffness[::-1])[::-1]
    return run.stiffness**2 * np.cumsum(increment_variances), float(
        np.sum(increment_variances * remaining_stiffness**2)
    ) / len(time) ** 2


def exit_shift(run: CableSimulation, residual: Array, expected: float, max_shift: float) -> tuple[Array, Array]:
    """Shift ``s`` of the exit point (3,) in m that explains a residual ``r`` (N,), and the remainder (N,) in N.

    Rope is known by its length at the start, so a shift shows as the rope turns: by the stiffness times the change of
    its direction, ``C s``. Regularised least squares:

        min  mean (r - C s)^2 / expected^2 + |s|^2 / max_shift^2
    """
    is_measured = np.isfinite(residual)
    columns = exit_shift_columns(run)
    columns = columns - np.mean(columns[is_measured], axis=0)
    weighted_columns = columns[is_measured] / (expected * np.sqrt(np.sum(is_measured)))
    weighted_residual = weighted_columns.T @ (residual[is_measured] / (expected * np.sqrt(np.sum(is_measured))))
    shift: Array = np.linalg.solve(weighted_columns.T @ weighted_columns + np.eye(3) / max_shift**2, weighted_residual)
    return shift, residual - columns @ shift


def exit_shift_columns(run: CableSimulation) -> Array:
    """Change of the tension for each metre by which the exit point shifts along each axis, C; (N, 3) in N/m."""
    direction = run.sensitivities[:, :3] / np.maximum(run.stiffness, np.finfo(float).tiny)[:, None]
    columns: Array = -run.stiffness[:, None] * (direction - direction[0])
    return columns


def _tension_sensitivities(component: Component, input_values: Array) -> Array:
    """Sensitivities of the pull by position, velocity and winch speed at present; restores the inputs."""
    inputs, pull = component.block((*MOTION, "winch_speed")), component.block(("pull",))
    sensitivities = np.empty(len(PERTURBATIONS))
    for index, perturbation in enumerate(PERTURBATIONS):
        tensions = []
        for sign in (1.0, -1.0):
            inputs.values[:] = input_values
            inputs.values[index] += sign * perturbation
            component.write(inputs)
            component.read(pull)
            tensions.append(pull.values[0])
        sensitivities[index] = (tensions[0] - tensions[1]) / (2.0 * perturbation)
    inputs.values[:] = input_values
    component.write(inputs)
    component.read(pull)
    return sensitivities
