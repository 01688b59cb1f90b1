"""A cable FMU alone along a path with the recorded winch speed: which tension it shows, and how that errs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import NDArray

from ...master import Component
from ...master.seat import STAMP
from .path import Path

Array = NDArray[np.float64]

AXES = ("x", "y", "z")
MOTION = tuple(f"{name}.{axis}" for name in ("position", "velocity") for axis in AXES)
RATES = (*(f"acceleration.{axis}" for axis in AXES), "winch_acceleration")
SHOWN = ("tension", "length", *(f"force.{axis}" for axis in AXES))
# m, m/s, m/s: what an input is moved by to see how the tension follows.
NUDGES = np.array([1e-4] * 3 + [1e-3] * 3 + [1e-3])
PROBES = 50


@dataclass(frozen=True)
class CableRun:
    """A cable FMU at N times: ``tension`` in N and ``length`` in m (N,), ``force`` (N, 3) on the platform in N.

    ``slopes`` (N, 7) are how the tension follows position (N/m), velocity and winch speed (N s/m).
    """

    tension: Array
    length: Array
    force: Array
    slopes: Array

    @property
    def stiffness(self) -> Array:
        """Tension for each metre of rope let out less, N/m; shape (N,)."""
        return np.linalg.norm(self.slopes[:, :3], axis=1)


def run_cable(name: str, fmu: FilePath, path: Path, winch_speed: Array) -> CableRun:
    """Step a cable FMU from sample to sample along a path, winch speeds (N,) in m/s; raises ComponentError."""
    time = path.time
    # Speeds are linear between samples: their rate jumps at each.
    rates = np.append(0.0, np.diff(winch_speed) / np.diff(time))
    moved = np.hstack([path.position, path.velocity, winch_speed[:, None], path.acceleration, rates[:, None]])
    shown = np.empty((len(time), len(SHOWN)))
    probed = np.unique(np.linspace(0, len(time) - 1, min(PROBES, len(time))).astype(int))
    slopes = np.empty((len(probed), len(NUDGES)))
    places = {int(row): place for place, row in enumerate(probed)}
    with Component(name, fmu) as component:
        inputs, outputs = component.block((STAMP, *MOTION, "winch_speed", *RATES)), component.block(SHOWN)
        next_rate = component.block(RATES[-1:])
        component.initialize(float(time[0]), {})
        component.run()
        for row, now in enumerate(moved):
            if row:
                next_rate.values[0] = rates[row]
                component.write(next_rate)
            inputs.values[0], inputs.values[1:] = time[row], now
            component.write(inputs)
            if row:
                component.step(float(time[row - 1]), float(time[row] - time[row - 1]))
            component.read(outputs)
            shown[row] = outputs.values
            if row in places:
                slopes[places[row]] = _slopes(component, now[: len(NUDGES)])
    carries = (shown[:, 0] > 0.0)[:, None]
    everywhere = np.column_stack([np.interp(time, time[probed], column) for column in slopes.T])
    return CableRun(shown[:, 0], shown[:, 1], shown[:, 2:], np.where(carries, everywhere, 0.0))


def tension_variance(run: CableRun, path: Path, cell: float, winch_speed: float) -> Array:
    """Variance of measured less shown tension without what drifts, in N^2; shape (N,).

    By noise of the load cell (standard deviation in N), of the path, and of the winch speed (in m/s) as it is felt.
    """
    by_axis = np.stack([run.slopes[:, :3], run.slopes[:, 3:6]], axis=2)
    spread = np.einsum("nai,naij,naj->n", by_axis, path.covariance[:, :, :2, :2], by_axis)
    variance: Array = cell**2 + spread + (run.slopes[:, 6] * winch_speed) ** 2
    return variance


def drift_variance(run: CableRun, time: Array, winch_speed: float) -> tuple[Array, float]:
    """What noise of the winch speeds makes of the tension as it integrates, in N^2; (N,), and that of its mean.

    With speeds linear between samples ``h_k`` apart and of noise ``sigma`` (m/s), rope let out has the variance
    ``sigma^2 sum h_k^2``.
    """
    steps = np.diff(time, prepend=time[0])
    each = (winch_speed * steps) ** 2
    later = np.cumsum(run.stiffness[::-1])[::-1]
    return run.stiffness**2 * np.cumsum(each), float(np.sum(each * later**2)) / len(time) ** 2


def exit_shift(run: CableRun, residual: Array, expected: float, largest: float) -> tuple[Array, Array]:
    """The shift ``s`` of the exit point (3,) in m that explains a residual ``r`` (N,), and what is then left (N,) in N.

    Rope is known by its length at the start, so a shift shows as the rope turns: by the stiffness times the change of
    its direction, ``C s``. It is that of

        min  mean (r - C s)^2 / expected^2 + |s|^2 / largest^2
    """
    seen = np.isfinite(residual)
    direction = run.slopes[:, :3] / np.maximum(run.stiffness, np.finfo(float).tiny)[:, None]
    columns = -run.stiffness[:, None] * (direction - direction[0])
    columns = columns - np.mean(columns[seen], axis=0)
    weighed = columns[seen] / (expected * np.sqrt(np.sum(seen)))
    pulled = weighed.T @ (residual[seen] / (expected * np.sqrt(np.sum(seen))))
    shift: Array = np.linalg.solve(weighed.T @ weighed + np.eye(3) / largest**2, pulled)
    return shift, residual - columns @ shift


def _slopes(component: Component, now: Array) -> Array:
    """How the pull follows position, velocity and winch speed at present; the inputs are as before afterwards."""
    inputs, pull = component.block((*MOTION, "winch_speed")), component.block(("pull",))
    found = np.empty(len(NUDGES))
    for place, nudge in enumerate(NUDGES):
        pair = []
        for sign in (1.0, -1.0):
            inputs.values[:] = now
            inputs.values[place] += sign * nudge
            component.write(inputs)
            component.read(pull)
            pair.append(pull.values[0])
        found[place] = (pair[0] - pair[1]) / (2.0 * nudge)
    inputs.values[:] = now
    component.write(inputs)
    component.read(pull)
    return found
