"""Random processes with a memory, sampled at a steady rate."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from tests.rig.robot import Vector


def ornstein_uhlenbeck(
    random: np.random.Generator, shape: tuple[int, int], interval: float, rms: float, bandwidth: float
) -> Vector:
    """Independent columns of an Ornstein-Uhlenbeck process, stationary from the first row.

    x_k+1 = a x_k + sqrt(1 - a^2) rms xi_k, a = exp(-2 pi bandwidth interval); `bandwidth` in Hz, `interval` in s.
    """
    memory = np.exp(-2.0 * np.pi * bandwidth * interval)
    pushes = random.normal(scale=rms * np.sqrt(1.0 - memory**2), size=shape)
    pushes[0] = random.normal(scale=rms, size=shape[1])
    return np.asarray(lfilter([1.0], [1.0, -memory], pushes, axis=0), float)


def swaying(
    random: np.random.Generator, shape: tuple[int, int], interval: float, rms: float, frequency: float
) -> Vector:
    """Independent columns of a lightly damped oscillation (5 %) that white noise excites; begins at zero, at rest.

    x'' = -2 zeta w x' - w^2 x + noise, by the exact sampled recursion; the deviation is `rms` once it has built up.
    """
    angular, damping_ratio = 2.0 * np.pi * frequency, 0.05
    decay = np.exp(-damping_ratio * angular * interval)
    turn = angular * np.sqrt(1.0 - damping_ratio**2) * interval
    denominator = [1.0, -2.0 * decay * np.cos(turn), decay**2]
    pushes = random.normal(size=shape)
    pushes[: min(len(pushes), 3)] = 0.0
    # Variance of the second-order recursion under white noise of unit variance.
    gain = (1.0 + decay**2) / ((1.0 - decay**2) * ((1.0 + decay**2) ** 2 - denominator[1] ** 2))
    return np.asarray(lfilter([rms / np.sqrt(gain)], denominator, pushes, axis=0), float)
