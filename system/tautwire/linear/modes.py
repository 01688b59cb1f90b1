"""Vibration modes of the platform with the winches held: frequencies, damping, shapes and energy in each cable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from ..robot.schema import Robot
from ..robot.static_equilibrium import unit_directions
from .operating_point import OperatingPointError

Array = NDArray[np.float64]

POSITION, VELOCITY = slice(0, 3), slice(3, 6)
REAL_EIGENVALUE_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Modes:
    """The three translational modes with the winches held, by ascending frequency.

    ``frequencies`` (3,) in Hz, undamped, from ``K phi = omega^2 M phi``; ``damping_ratios`` (3,) and
    ``damped_frequencies`` (3,) in Hz from the eigenvalues of A, the latter zero where a mode is overdamped;
    ``shapes`` (3, 3), unit columns; ``cable_shares`` (n, 3), each cable's share of the potential energy of the
    mode, columns sum to 1.
    """

    frequencies: Array
    damping_ratios: Array
    damped_frequencies: Array
    shapes: Array
    cable_shares: Array


def modes_of(robot: Robot, position: Array, tensions: Array, tension_slopes: Array, A: Array, B: Array) -> Modes:
    """Modes of a robot linearised at a position (m) under tensions (N) with ``tension_slopes`` (n, 3) in N/m.

    K is the stiffness at constant unstrained lengths and states of effects.

    Raises OperatingPointError where the platform is not held stably.
    """
    mass = np.linalg.inv(B[VELOCITY, robot.cable_count :])
    stiffness = -mass @ A[VELOCITY, POSITION]
    squared_frequencies, shapes = eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
    if squared_frequencies[0] <= 0.0:
        raise OperatingPointError(robot.name, position, "the platform is not held stably")
    omega: Array = np.sqrt(squared_frequencies)
    shapes = shapes / np.linalg.norm(shapes, axis=0)
    shapes = shapes * np.sign(shapes[np.argmax(np.abs(shapes), axis=0), range(3)])
    ratios, damped = _damping_ratios(_without_lengths(A, robot.cable_count), omega, shapes)
    return Modes(
        frequencies=omega / (2.0 * np.pi),
        damping_ratios=ratios,
        damped_frequencies=damped / (2.0 * np.pi),
        shapes=shapes,
        cable_shares=cable_shares(robot, position, tensions, tension_slopes, shapes),
    )


def cable_shares(robot: Robot, position: Array, tensions: Array, tension_slopes: Array, shapes: Array) -> Array:
    """Each cable's share of the potential energy of motions along ``shapes`` (3, k), shape (n, k).

    ``phi' K_i phi / sum_i phi' K_i phi``, ``K_i = -u (dT/dp) + T (I - u u') / l`` for each cable; ``tension_slopes``
    are dT/dp in N/m.
    """
    direction_matrix = unit_directions(robot, position)
    lengths = np.linalg.norm(np.array(robot.anchors) - position, axis=1)
    along = direction_matrix.T @ shapes
    across = 1.0 - along**2
    energy: Array = -along * (tension_slopes @ shapes) + (tensions / lengths)[:, None] * across
    return energy / energy.sum(axis=0)


def _without_lengths(A: Array, cable_count: int) -> Array:
    """A without the unstrained lengths, which are constant with the winches held and only add zero eigenvalues."""
    remaining_states = np.r_[0:6, 6 + cable_count : len(A)]
    reduced: Array = A[np.ix_(remaining_states, remaining_states)]
    return reduced


def _damping_ratios(A: Array, omega: Array, shapes: Array) -> tuple[Array, Array]:
    """Damping ratio and damped frequency (rad/s) of each mode.

    From the eigenvalues of A whose eigenvectors are most similar to its shape; a pair p, q belongs to
    ``s^2 + 2 zeta w s + w^2``: ``w^2 = p q``, ``zeta = -(p + q) / (2 w)``.
    """
    values, vectors = np.linalg.eig(A)
    eigenvector_shapes = vectors[POSITION] / np.maximum(np.linalg.norm(vectors[POSITION], axis=0), np.finfo(float).tiny)
    similarity = np.abs(shapes.T @ eigenvector_shapes)
    ratios, damped = np.full(len(omega), np.nan), np.zeros(len(omega))
    oscillating = np.flatnonzero(values.imag > REAL_EIGENVALUE_TOLERANCE * np.abs(values))
    distance = np.abs(np.log(np.abs(values[oscillating])[None, :] / omega[:, None]))
    for mode, column in zip(*linear_sum_assignment(distance - similarity[:, oscillating]), strict=True):
        value = values[oscillating[column]]
        ratios[mode], damped[mode] = -value.real / abs(value), value.imag
    real_indices = set(np.flatnonzero(np.abs(values.imag) <= REAL_EIGENVALUE_TOLERANCE * np.abs(values)).tolist())
    for mode in np.flatnonzero(np.isnan(ratios)):
        pair = _real_pair(values.real, similarity[mode], omega[mode], sorted(real_indices))
        real_indices.difference_update(pair)
        p, q = values.real[list(pair)]
        ratios[mode] = -(p + q) / (2.0 * np.sqrt(p * q))
    return ratios, damped


def _real_pair(values: Array, similarity: Array, omega: float, real_indices: Sequence[int]) -> tuple[int, ...]:
    """The two real eigenvalues of equal sign that fit an overdamped mode best."""

    def misfit(pair: tuple[int, ...]) -> float:
        p, q = values[list(pair)]
        if p * q <= 0.0:
            return np.inf
        return float(abs(np.log(p * q / omega**2)) - similarity[list(pair)].sum())

    return min(combinations(real_indices, 2), key=misfit)
