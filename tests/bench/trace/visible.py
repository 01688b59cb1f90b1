"""How well a change of the outputs shows beside all that may hide it: noise, drift, constants and nuisances.

With d the change in standard deviations of the sensors, and columns A of what else may change the outputs, each scaled
by how much of it there may be, the visibility is

    1/2 d' (I + A A')^-1 d = 1/2 (d'd - d'A (I + A'A)^-1 A'd)     nats,

the mean log-likelihood ratio that separates the true model from the best one without the effect, where the change is
linear.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from tests.rig import Robot

KNOTS = 480
# In standard deviations of the whole recording: free, yet without loss of digits.
FREE = 1e5


@dataclass(frozen=True)
class Hiding:
    """Scaled columns (samples times outputs, k), with the factor of I + A'A."""

    columns: np.ndarray
    factor: tuple[np.ndarray, bool]

    def nats(self, change: np.ndarray) -> float:
        """Visibility of a change (samples, outputs), in standard deviations of the sensors."""
        flat = change.ravel()
        seen = self.columns.T @ flat
        return max(0.0, 0.5 * float(flat @ flat - seen @ cho_solve(self.factor, seen)))


def hiding(drift: np.ndarray, free: Iterable[np.ndarray], constant: bool = True) -> Hiding:
    """Drift columns as they are, free ones (samples, outputs) of any size, and a free constant of each output."""
    samples, outputs = drift.shape[:2]
    constants = [np.tile(row, (samples, 1)) for row in np.eye(outputs)] if constant else []
    loose = [FREE * column.ravel() / np.linalg.norm(column) for column in (*constants, *free)]
    columns = np.column_stack([drift.reshape(samples * outputs, -1), *loose])
    return Hiding(columns, cho_factor(np.eye(columns.shape[1]) + columns.T @ columns))


def drift_columns(robot: Robot, interval: float, position: np.ndarray, tension: np.ndarray) -> np.ndarray:
    """What noise of the winch speeds, which adds up to a random walk of each rope's length, changes in the outputs.

    One column for each knot of each cable's walk, shape (samples, cables + 3, columns), tensions in N before positions
    in m, along the way of a run. Ropes follow as in statics: K dp = -sum a_i u_i d_i, dT_i = -a_i (u_i dp + d_i), with
    a = E S / l and K = sum (a_i - T_i / l_i) u_i u_i' + T_i / l_i.
    """
    count, samples = robot.count, len(position)
    span = robot.anchors[None] - position[:, None, :]
    length = np.linalg.norm(span, axis=2)
    unit = span / length[:, :, None]
    axial, string = robot.modulus * robot.area / length, tension / length
    stiffness = np.einsum("ti,tij,tik->tjk", axial - string, unit, unit) + np.sum(string, 1)[:, None, None] * np.eye(3)
    moved = -np.linalg.solve(stiffness, np.swapaxes(axial[:, :, None] * unit, 1, 2))
    pulled = -axial[:, :, None] * (np.einsum("tij,tjk->tik", unit, moved) + np.eye(count))
    shown = np.concatenate([pulled, moved], axis=1)
    stride = max(1, samples * count // KNOTS)
    begun = np.arange(samples)[:, None] >= np.arange(0, samples, stride)[None, :]
    size = robot.noise.winch_speed * interval * np.sqrt(stride)
    return (size * shown[:, :, :, None] * begun[:, None, None, :]).reshape(samples, count + 3, -1)
