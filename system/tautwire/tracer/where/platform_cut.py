"""The platform FMU alone under measured tensions: which force is missing to the measured path.

The FMU's acceleration, integrated twice, is taken off the measured positions, and what is left is smoothed and
differentiated: an error of the start, and what the smoothing takes away, then fall out. Smoothing passes what is slower
than ``omega_c``, where noise of positions and of load cells weigh the same, with ``u_i`` the cables' directions along
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

from ...master import Component
from .cable_cut import AXES, CableRun
from .path import FEWEST_SEEN, Path, intensity_at, smooth

Array = NDArray[np.float64]

# Share of a step by which the external force leads the FMU back to the measured path.
LEADING = 0.5
FREQUENCIES = 2000
# Of the cut-off in a recording: an axis across all cables would have none.
FEWEST_PERIODS = 5
# In medians of the sample interval.
LONGEST_STEP = 5.5
SLACK = 1e-9
# Of the load cells' variance, what an axis across all cables is taken to feel.
LEAST = 1e-6


@dataclass(frozen=True)
class Balance:
    """Force missing along each axis: ``force`` (N, 3) and its standard deviation ``expected`` (N, 3), in N.

    ``cutoff`` (3,) in rad/s; all are NaN along an axis that was not measured, ``force`` also where no tension was.
    """

    force: Array
    expected: Array
    cutoff: Array


def measured_forces(runs: list[CableRun], tension: Array, anchors: Array, position: Array) -> Array:
    """Forces on the platform by measured tensions (N, n) along the directions that the cable FMUs show; (N, n, 3)."""
    forces = []
    for run, measured, anchor in zip(runs, tension.T, anchors, strict=True):
        line = anchor - position
        straight = line / np.linalg.norm(line, axis=1)[:, None]
        carried = run.tension > SLACK * max(float(np.max(run.tension)), 1.0)
        shown = np.where(carried, run.tension, 1.0)[:, None]
        forces.append(measured[:, None] * np.where(carried[:, None], run.force / shown, straight))
    return np.stack(forces, axis=1)


def run_platform(fmu: FilePath, path: Path, forces: Array, mass: float) -> Array:
    """Accelerations (N, 3) in m/s^2 that a platform FMU shows along a path under forces (N, n, 3) in N.

    An external force keeps it on the path, so that what depends on its motion is right; it is off when they are read.
    NaN where a force is. Raises ComponentError.
    """
    time, shown = path.time, np.empty((len(path.time), 3))
    given_rows = np.all(np.isfinite(forces), axis=(1, 2))
    with Component("platform", fmu) as component:
        inputs = [f"force_{i}.{axis}" for i in range(1, forces.shape[1] + 1) for axis in AXES]
        given = component.block((*inputs, *(f"external_force.{axis}" for axis in AXES)))
        seen = component.block([f"{n}.{axis}" for n in ("position", "velocity", "acceleration") for axis in AXES])
        component.initialize(float(time[0]), dict(zip((f"start.{a}" for a in AXES), path.position[0], strict=True)))
        component.run()
        component.read(given)
        for row, pushed in enumerate(forces):
            if given_rows[row]:
                given.values[:-3] = pushed.ravel()
            given.values[-3:] = 0.0
            component.write(given)
            component.read(seen)
            place, speed, shown[row] = seen.values.reshape(3, 3)
            if row + 1 < len(time):
                step = float(time[row + 1] - time[row])
                lead = LEADING / step
                behind = 2.0 * lead * (path.velocity[row] - speed) + lead**2 * (path.position[row] - place)
                given.values[-3:] = mass * (path.acceleration[row] - shown[row] + behind)
                component.write(given)
                component.step(float(time[row]), step)
    shown[~given_rows] = np.nan
    return shown


def balance(path: Path, measured: Array, shown: Array, forces: Array, mass: float, sigmas: Sequence[float]) -> Balance:
    """The force missing to measured positions (N, 3) where an FMU showed these accelerations (N, 3) in m/s^2.

    ``sigmas`` are standard deviations of x, y, z in m and of the tensions in N; ``forces`` (N, n, 3) are the cables'.
    """
    known = np.all(np.isfinite(shown), axis=1)
    force, expected, cutoff = np.full(shown.shape, np.nan), np.full(shown.shape, np.nan), np.full(3, np.nan)
    if np.sum(known) >= FEWEST_SEEN:
        cells = _felt_noise(forces[known], np.array(sigmas[3:])) / mass
        slowest = 2.0 * pi * FEWEST_PERIODS / float(path.time[-1] - path.time[0])
        for axis in np.flatnonzero(path.measured).tolist():
            cutoff[axis] = max(float(np.sqrt(cells[axis] / sigmas[axis])), slowest)
            found = _missing(path.time, measured[:, axis], shown[:, axis], cutoff[axis], cells[axis], sigmas[axis])
            force[:, axis], expected[:, axis] = mass * found[0], mass * found[1]
    return Balance(force, expected, cutoff)


def _felt_noise(forces: Array, sigmas: Array) -> Array:
    """Standard deviation of the cables' summed force along each axis by noise of the load cells (n,), in N; (3,)."""
    sizes = np.maximum(np.linalg.norm(forces, axis=2), np.finfo(float).tiny)
    squares = np.mean((forces / sizes[:, :, None]) ** 2, axis=0)
    felt: Array = np.sqrt(np.maximum(sigmas**2 @ squares, LEAST * np.sum(sigmas**2)))
    return felt


def _missing(
    time: Array, measured: Array, shown: Array, cutoff: float, cell: float, sigma: float
) -> tuple[Array, Array]:
    """Acceleration that is missing along an axis, and its standard deviation, in m/s^2; (N,) each.

    Each stretch between gaps counts for itself: how fast the platform leaves a gap is not known.
    """
    # Imported here: it takes long to import, and only traces need it.
    from scipy.interpolate import CubicSpline

    known = np.flatnonzero(np.isfinite(shown))
    steps = np.diff(time[known])
    missing, doubt = np.full(len(time), np.nan), np.full(len(time), np.nan)
    least = np.inf
    for rows in np.split(known, np.flatnonzero(steps > LONGEST_STEP * np.median(steps)) + 1):
        if np.sum(np.isfinite(measured[rows])) < FEWEST_SEEN:
            continue
        apart = measured[rows] - CubicSpline(time[rows], shown[rows]).antiderivative(2)(time[rows])
        found = smooth(time[rows], apart, sigma, intensity_at(cutoff, time[rows], apart, sigma))
        missing[rows], doubt[rows] = found.state[:, 2], found.covariance[:, 2, 2]
        least = min(least, float(np.median(doubt[rows])))
    position_step = float(np.median(np.diff(time[np.isfinite(measured)])))
    steady = _variance(cutoff, sigma, position_step, cell, float(np.median(steps)))
    return missing, np.sqrt(steady * doubt / least)


def _variance(cutoff: float, position: float, position_step: float, cell: float, cell_step: float) -> float:
    """Variance of a smoothed acceleration, (m/s^2)^2, by noise of positions (m) and of the cables' pull (m/s^2)."""
    # Imported here: it takes long to import, and only traces need it.
    from scipy.integrate import trapezoid

    omega = np.linspace(0.0, pi / max(position_step, cell_step), FREQUENCIES + 1)[1:]
    passed = 1.0 / (1.0 + (omega / cutoff) ** 6) ** 2
    density = passed * (omega**4 * position**2 * position_step + cell**2 * cell_step)
    return float(trapezoid(density, omega)) / pi
