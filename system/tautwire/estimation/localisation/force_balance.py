"""Force balance of the platform FMU alone under measured tensions: the force missing to the measured path.

The FMU's acceleration, integrated twice, is subtracted from the measured positions, and the deviation is smoothed and
differentiated: an error of the start, and what the smoothing takes away, then cancel. Smoothing passes frequencies
below ``omega_c``, where noise of positions and of load cells weigh the same, with ``u_i`` the cables' directions along
the axis and ``h`` the seconds between samples:

    sigma_F^2 = sum_i u_i^2 sigma_i^2    omega_c^2 = sigma_F / (m sigma_x)    H = -omega^2 / (1 + (omega / omega_c)^6)

    variance = 1/pi integral |H|^2 (sigma_x^2 h_x + (sigma_F / m)^2 h_T / omega^4) d omega
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import NDArray

from ...cosimulation import Component
from ...robot.schema import AXES
from .cable_simulation import CableSimulation
from .component_residuals import PLATFORM
from .path_smoothing import MIN_MEASURED_SAMPLES, SmoothedPath, intensity_for_cutoff, smooth_axis

Array = NDArray[np.float64]

# Tracking rate of the external force that keeps the FMU on the measured path, times the step.
TRACKING_STEP_RATIO = 0.5
FREQUENCY_COUNT = 2000
# Of the cut-off in a recording: an axis perpendicular to all cables would have none.
MIN_PERIODS = 5
# In medians of the sample interval: a longer step is a gap.
MAX_STEP_INTERVALS = 5.5
SLACK_TENSION_RATIO = 1e-9
# Least share of the load cells' variance along an axis, for one perpendicular to all cables.
MIN_AXIS_VARIANCE_RATIO = 1e-6


@dataclass(frozen=True)
class ForceBalance:
    """Missing force along each axis: ``force`` (N, 3) and its standard deviation ``expected_deviation`` (N, 3), in N.

    ``cutoff`` (3,) in rad/s; all are NaN along an axis that was not measured, ``force`` also where no tension was.
    """

    force: Array
    expected_deviation: Array
    cutoff: Array


def measured_forces(runs: Sequence[CableSimulation], tension: Array, anchors: Array, position: Array) -> Array:
    """Forces on the platform by measured tensions (N, n) along the directions of the cable FMUs' forces; (N, n, 3)."""
    forces = []
    for run, measured, anchor in zip(runs, tension.T, anchors, strict=True):
        to_anchor = anchor - position
        chord_direction = to_anchor / np.linalg.norm(to_anchor, axis=1)[:, None]
        is_taut = run.tension > SLACK_TENSION_RATIO * max(float(np.max(run.tension)), 1.0)
        simulated_tension = np.where(is_taut, run.tension, 1.0)[:, None]
        forces.append(measured[:, None] * np.where(is_taut[:, None], run.force / simulated_tension, chord_direction))
    return np.stack(forces, axis=1)


def simulate_platform(fmu: FilePath, path: SmoothedPath, forces: Array, mass: float) -> Array:
    """Simulate a platform FMU along a path under forces (N, n, 3) in N; returns its accelerations (N, 3) in m/s^2.

    An external force keeps it on the path, so that what depends on its motion is right; it is zero when they are read.
    NaN where a force is. Raises ComponentError.
    """
    time, accelerations = path.time, np.empty((len(path.time), 3))
    has_forces = np.all(np.isfinite(forces), axis=(1, 2))
    with Component("platform", fmu) as component:
        force_names = [f"force_{i}.{axis}" for i in range(1, forces.shape[1] + 1) for axis in AXES]
        input_block = component.block((*force_names, *(f"external_force.{axis}" for axis in AXES)))
        output_block = component.block(
            [f"{n}.{axis}" for n in ("position", "velocity", "acceleration") for axis in AXES]
        )
        component.initialize(float(time[0]), dict(zip((f"start.{a}" for a in AXES), path.position[0], strict=True)))
        component.run()
        component.read(input_block)
        for row, cable_forces in enumerate(forces):
            if has_forces[row]:
                input_block.values[:-3] = cable_forces.ravel()
            input_block.values[-3:] = 0.0
            component.write(input_block)
            component.read(output_block)
            position, velocity, accelerations[row] = output_block.values.reshape(3, 3)
            if row + 1 < len(time):
                step = float(time[row + 1] - time[row])
                tracking_rate = TRACKING_STEP_RATIO / step
                correction = 2.0 * tracking_rate * (path.velocity[row] - velocity) + tracking_rate**2 * (
                    path.position[row] - position
                )
                input_block.values[-3:] = mass * (path.acceleration[row] - accelerations[row] + correction)
                component.write(input_block)
                component.step(float(time[row]), step)
    accelerations[~has_forces] = np.nan
    return accelerations


def force_balance(
    path: SmoothedPath, measured: Array, accelerations: Array, forces: Array, mass: float, sigmas: Sequence[float]
) -> ForceBalance:
    """Force balance of measured positions (N, 3) and the platform FMU's accelerations (N, 3) in m/s^2.

    ``sigmas`` are standard deviations of x, y, z in m and of the tensions in N; ``forces`` (N, n, 3) are the cables'.
    """
    has_acceleration = np.all(np.isfinite(accelerations), axis=1)
    force, expected, cutoff = (
        np.full(accelerations.shape, np.nan),
        np.full(accelerations.shape, np.nan),
        np.full(3, np.nan),
    )
    if np.sum(has_acceleration) >= MIN_MEASURED_SAMPLES:
        load_cell_noise = _summed_force_noise(forces[has_acceleration], np.array(sigmas[3:])) / mass
        min_cutoff = 2.0 * pi * MIN_PERIODS / float(path.time[-1] - path.time[0])
        for axis in np.flatnonzero(path.measured).tolist():
            cutoff[axis] = max(float(np.sqrt(load_cell_noise[axis] / sigmas[axis])), min_cutoff)
            missing = _missing_acceleration(
                path.time, measured[:, axis], accelerations[:, axis], cutoff[axis], load_cell_noise[axis], sigmas[axis]
            )
            force[:, axis], expected[:, axis] = mass * missing[0], mass * missing[1]
    return ForceBalance(force, expected, cutoff)


def _summed_force_noise(forces: Array, sigmas: Array) -> Array:
    """Standard deviation of the cables' summed force along each axis by noise of the load cells (n,), in N; (3,)."""
    sizes = np.maximum(np.linalg.norm(forces, axis=2), np.finfo(float).tiny)
    squares = np.mean((forces / sizes[:, :, None]) ** 2, axis=0)
    noise: Array = np.sqrt(np.maximum(sigmas**2 @ squares, MIN_AXIS_VARIANCE_RATIO * np.sum(sigmas**2)))
    return noise


def _missing_acceleration(
    time: Array, measured: Array, accelerations: Array, cutoff: float, load_cell_noise: float, position_noise: float
) -> tuple[Array, Array]:
    """Missing acceleration along an axis, and its standard deviation, in m/s^2; (N,) each.

    Each part between gaps is smoothed separately: how fast the platform leaves a gap is not known.
    """
    # Imported here: it takes long to import, and only traces need it.
    from scipy.interpolate import CubicSpline

    known_rows = np.flatnonzero(np.isfinite(accelerations))
    steps = np.diff(time[known_rows])
    missing, variance = np.full(len(time), np.nan), np.full(len(time), np.nan)
    min_variance = np.inf
    for rows in np.split(known_rows, np.flatnonzero(steps > MAX_STEP_INTERVALS * np.median(steps)) + 1):
        if np.sum(np.isfinite(measured[rows])) < MIN_MEASURED_SAMPLES:
            continue
        deviation = measured[rows] - CubicSpline(time[rows], accelerations[rows]).antiderivative(2)(time[rows])
        smoothed = smooth_axis(
            time[rows], deviation, position_noise, intensity_for_cutoff(cutoff, time[rows], deviation, position_noise)
        )
        missing[rows], variance[rows] = smoothed.state[:, 2], smoothed.covariance[:, 2, 2]
        min_variance = min(min_variance, float(np.median(variance[rows])))
    position_step = float(np.median(np.diff(time[np.isfinite(measured)])))
    steady_variance = _acceleration_variance(
        cutoff, position_noise, position_step, load_cell_noise, float(np.median(steps))
    )
    return missing, np.sqrt(steady_variance * variance / min_variance)


def _acceleration_variance(
    cutoff: float, position_noise: float, position_step: float, load_cell_noise: float, cell_step: float
) -> float:
    """Variance of a smoothed acceleration, (m/s^2)^2, by noise of positions (m) and of the cables' pull (m/s^2)."""
    # Imported here: it takes long to import, and only traces need it.
    from scipy.integrate import trapezoid

    omega = np.linspace(0.0, pi / max(position_step, cell_step), FREQUENCY_COUNT + 1)[1:]
    squared_gain = 1.0 / (1.0 + (omega / cutoff) ** 6) ** 2
    density = squared_gain * (omega**4 * position_noise**2 * position_step + load_cell_noise**2 * cell_step)
    return float(trapezoid(density, omega)) / pi


def offset_candidates(balance: ForceBalance, directions: Array, path: SmoothedPath, max_ratio: float) -> list[str]:
    """Components by whose constant error a balance closes: one load cell's zero, or the platform's weight or a force.

    ``directions`` (N, n, 3) are the cables', u. With the missing force F and the acceleration a, by least squares in
    the numbers b, m and the vector c

        F = b u_i        F = c + m a

    The better of both, or both where the other leaves less than twice as much; none where neither leaves less than
    ``max_ratio`` of F.
    """
    axes = np.flatnonzero(np.any(np.isfinite(balance.force), axis=0))
    rows = np.all(np.isfinite(balance.force[:, axes]), axis=1)
    missing = balance.force[rows][:, axes]

    def left(regressors: Array) -> float:
        columns = regressors.reshape(-1, missing.size).T
        solution, *_ = np.linalg.lstsq(columns, missing.ravel(), rcond=None)
        return float(np.linalg.norm(missing.ravel() - columns @ solution) / np.linalg.norm(missing))

    constants = [np.tile(np.arange(len(axes)) == axis, (len(missing), 1)) for axis in range(len(axes))]
    of_platform = left(np.array([*constants, path.acceleration[rows][:, axes]], dtype=float))
    of_cells = [left(directions[rows][:, cable, axes]) for cable in range(directions.shape[1])]
    best = int(np.argmin(of_cells))
    candidates = {f"load cell {best + 1} (its zero)": of_cells[best], PLATFORM: of_platform}
    closest = min(candidates.values())
    return [name for name, share in candidates.items() if share <= min(max_ratio, 2.0 * closest)]
