"""Vibration modes of the platform with the winches held: frequencies, damping, shapes and energy in each cable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from ..robot.platform_symbols import StateIndices
from .operating_point import OperatingPointError, Pose

Array = NDArray[np.float64]

REAL_EIGENVALUE_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Modes:
    """The modes of a platform with d degrees of freedom with the winches held, by ascending frequency.

    ``frequencies`` (d,) in Hz, undamped, from ``K phi = omega^2 M phi``; ``damping_ratios`` (d,) and
    ``damped_frequencies`` (d,) in Hz from the eigenvalues of A, the latter zero where a mode is overdamped;
    ``shapes`` (d, d), columns in m, and for a rigid body rad below, by which the centre of mass or an attachment moves
    by 1 m at most; ``cable_shares`` (n, d), each cable's share of the potential energy of the mode, columns sum to 1;
    ``translational_shares`` (d,), that of the centre of mass in the kinetic energy, 1 for a point mass.
    """

    frequencies: Array
    damping_ratios: Array
    damped_frequencies: Array
    shapes: Array
    cable_shares: Array
    translational_shares: Array


def modes_of(pose: Pose, indices: StateIndices, tensions: Array, tension_slopes: Array, A: Array, B: Array) -> Modes:
    """Modes of a robot linearised at a pose under tensions (N) with ``tension_slopes`` (n, d) in N/m, and N/rad.

    K is the stiffness at constant unstrained lengths and states of effects.

    Raises OperatingPointError where the platform is not held stably.
    """
    mass: Array = np.asarray(np.linalg.inv(B[indices.twist, indices.cable_count :]), dtype=np.float64)
    stiffness = -mass @ A[indices.twist, indices.pose]
    squared_frequencies, unscaled = eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
    if squared_frequencies[0] <= 0.0:
        raise OperatingPointError(pose.robot.name, pose.position, "the platform is not held stably")
    omega: Array = np.sqrt(squared_frequencies)
    shapes: Array = unscaled / np.linalg.norm(pose.displacements(unscaled), axis=1).max(axis=0)
    shapes = shapes * np.sign(shapes[np.argmax(np.abs(shapes), axis=0), range(len(shapes))])
    ratios, damped = _damping_ratios(_without_lengths(A, indices), omega, shapes)
    return Modes(
        frequencies=omega / (2.0 * np.pi),
        damping_ratios=ratios,
        damped_frequencies=damped / (2.0 * np.pi),
        shapes=shapes,
        cable_shares=cable_shares(pose, tensions, tension_slopes, shapes),
        translational_shares=translational_shares(pose, mass, shapes),
    )


def translational_shares(pose: Pose, mass: Array, shapes: Array) -> Array:
    """Shares (k,) of the centre of mass in the kinetic energy ``phi' M phi`` of motions along ``shapes`` (d, k)."""
    of_centre = pose.displacements(shapes)[0]
    shares: Array = mass[0, 0] * np.sum(of_centre**2, axis=0) / np.sum(shapes * (mass @ shapes), axis=0)
    return shares


def cable_shares(pose: Pose, tensions: Array, tension_slopes: Array, shapes: Array) -> Array:
    """Each cable's share of :func:`cable_energies`, shape (n, k)."""
    energies = cable_energies(pose, tensions, tension_slopes, shapes)
    shares: Array = energies / energies.sum(axis=0)
    return shares


def cable_energies(pose: Pose, tensions: Array, tension_slopes: Array, shapes: Array) -> Array:
    """Twice the potential energy of each cable in motions along ``shapes`` (d, k), in N m, shape (n, k).

    Where along a shape the attachment of cable i moves by a, the platform turns by r, and the attachment's arm from the
    centre of mass is s

        E_i = -(u a) dT + T (a^2 - (u a)^2) / l - T u (r x (r x s))

    In equilibrium they sum to ``phi' K phi``. ``tension_slopes`` are the derivatives dT by the pose, in N/m and N/rad.
    """
    moved = pose.displacements(shapes)[1:]
    along = np.einsum("in,nik->nk", pose.unit_directions, moved)
    across = np.sum(moved**2, axis=1) - along**2
    curved = np.einsum("in,nik->nk", pose.unit_directions, pose.curvatures(shapes)[1:])
    energies: Array = -along * (tension_slopes @ shapes)
    energies += (tensions / pose.chords)[:, None] * across - tensions[:, None] * curved
    return energies


def _without_lengths(A: Array, indices: StateIndices) -> Array:
    """A without the unstrained lengths, which are constant with the winches held and only add zero eigenvalues."""
    remaining_states = np.delete(np.arange(len(A)), indices.lengths)
    reduced: Array = A[np.ix_(remaining_states, remaining_states)]
    return reduced


def _damping_ratios(A: Array, omega: Array, shapes: Array) -> tuple[Array, Array]:
    """Damping ratio and damped frequency (rad/s) of each mode.

    From the eigenvalues of A whose eigenvectors are most similar to its shape; a pair p, q belongs to
    ``s^2 + 2 zeta w s + w^2``: ``w^2 = p q``, ``zeta = -(p + q) / (2 w)``.
    """
    values, vectors = np.linalg.eig(A)
    of_pose = vectors[: len(shapes)]
    eigenvector_shapes = of_pose / np.maximum(np.linalg.norm(of_pose, axis=0), np.finfo(float).tiny)
    similarity = np.abs((shapes / np.linalg.norm(shapes, axis=0)).T @ eigenvector_shapes)
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
