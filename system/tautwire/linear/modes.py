"""The modes of the platform with the winches held: frequencies, damping, shapes, and what each cable has in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from ..robots.robot import Robot
from ..statics.equilibrium import directions
from .rest import OperatingPointError

Array = NDArray[np.float64]

POSITION, VELOCITY = slice(0, 3), slice(3, 6)
REAL_EIGENVALUE = 1e-9


@dataclass(frozen=True)
class Modes:
    """The three translational modes with the winches held, by ascending frequency.

    ``frequencies`` (3,) in Hz, undamped, from ``K phi = omega^2 M phi``; ``damping_ratios`` (3,) and
    ``damped_frequencies`` (3,) in Hz from the eigenvalues of A, the latter zero where a mode is overdamped;
    ``shapes`` (3, 3), unit columns; ``cable_shares`` (n, 3), each cable's part of the energy stored in the mode,
    columns sum to 1.
    """

    frequencies: Array
    damping_ratios: Array
    damped_frequencies: Array
    shapes: Array
    cable_shares: Array


def modes_of(robot: Robot, position: Array, tensions: Array, slopes: Array, A: Array, B: Array) -> Modes:
    """Modes of a linearised robot at rest at a position (m) under tensions (N) whose ``slopes`` (n, 3) are in N/m.

    K is that at constant unstrained lengths and states of effects.

    Raises OperatingPointError where the platform is not held stably.
    """
    mass = np.linalg.inv(B[VELOCITY, robot.cable_count :])
    stiffness = -mass @ A[VELOCITY, POSITION]
    squares, shapes = eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
    if squares[0] <= 0.0:
        raise OperatingPointError(robot.name, position, "the platform is not held stably")
    omega: Array = np.sqrt(squares)
    shapes = shapes / np.linalg.norm(shapes, axis=0)
    shapes = shapes * np.sign(shapes[np.argmax(np.abs(shapes), axis=0), range(3)])
    ratios, turning = _damping(_held(A, robot.cable_count), omega, shapes)
    return Modes(
        frequencies=omega / (2.0 * np.pi),
        damping_ratios=ratios,
        damped_frequencies=turning / (2.0 * np.pi),
        shapes=shapes,
        cable_shares=cable_shares(robot, position, tensions, slopes, shapes),
    )


def cable_shares(robot: Robot, position: Array, tensions: Array, slopes: Array, shapes: Array) -> Array:
    """Each cable's part of the energy stored in motions along ``shapes`` (3, k), shape (n, k).

    ``phi' K_i phi / sum_i phi' K_i phi``, ``K_i = -u (dT/dp) + T (I - u u') / l`` for each cable, ``slopes`` dT/dp in
    N/m.
    """
    unit = directions(robot, position)
    lengths = np.linalg.norm(np.array(robot.anchors) - position, axis=1)
    along = unit.T @ shapes
    across = 1.0 - along**2
    energy: Array = -along * (slopes @ shapes) + (tensions / lengths)[:, None] * across
    return energy / energy.sum(axis=0)


def _held(A: Array, cable_count: int) -> Array:
    """A without the unstrained lengths: they stand still with the winches and only add zero eigenvalues."""
    rest = np.r_[0:6, 6 + cable_count : len(A)]
    held: Array = A[np.ix_(rest, rest)]
    return held


def _damping(A: Array, omega: Array, shapes: Array) -> tuple[Array, Array]:
    """Damping ratio and damped frequency (rad/s) of each mode.

    From the eigenvalues of A whose eigenvectors look most like its shape; a pair p, q belongs to
    ``s^2 + 2 zeta w s + w^2``: ``w^2 = p q``, ``zeta = -(p + q) / (2 w)``.
    """
    values, vectors = np.linalg.eig(A)
    moved = vectors[POSITION] / np.maximum(np.linalg.norm(vectors[POSITION], axis=0), np.finfo(float).tiny)
    likeness = np.abs(shapes.T @ moved)
    ratios, damped = np.full(len(omega), np.nan), np.zeros(len(omega))
    turning = np.flatnonzero(values.imag > REAL_EIGENVALUE * np.abs(values))
    distance = np.abs(np.log(np.abs(values[turning])[None, :] / omega[:, None]))
    for mode, place in zip(*linear_sum_assignment(distance - likeness[:, turning]), strict=True):
        value = values[turning[place]]
        ratios[mode], damped[mode] = -value.real / abs(value), value.imag
    free = set(np.flatnonzero(np.abs(values.imag) <= REAL_EIGENVALUE * np.abs(values)).tolist())
    for mode in np.flatnonzero(np.isnan(ratios)):
        pair = _real_pair(values.real, likeness[mode], omega[mode], sorted(free))
        free.difference_update(pair)
        p, q = values.real[list(pair)]
        ratios[mode] = -(p + q) / (2.0 * np.sqrt(p * q))
    return ratios, damped


def _real_pair(values: Array, likeness: Array, omega: float, free: Sequence[int]) -> tuple[int, ...]:
    """The two real eigenvalues of one sign that fit an overdamped mode best."""

    def misfit(pair: tuple[int, ...]) -> float:
        p, q = values[list(pair)]
        if p * q <= 0.0:
            return np.inf
        return float(abs(np.log(p * q / omega**2)) - likeness[list(pair)].sum())

    return min(combinations(free, 2), key=misfit)
