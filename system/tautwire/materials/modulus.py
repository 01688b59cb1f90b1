"""The complex modulus of a rope over the frequency of a small sinusoidal strain.

    E*(f) = (E + i omega c + sum_k E_k i omega tau_k / (1 + i omega tau_k) + i h + i 4 s / (pi a)) exp(i omega d)

with ``omega = 2 pi f`` and the strain amplitude ``a``. ``E`` is the long-term modulus and ``c`` the viscous damping of
the paper's law; each branch is a spring ``E_k`` in series with a dashpot, which relaxes in the time ``tau_k``
(generalised Maxwell model). ``h`` and ``s`` are hysteresis, which no rate changes: ``h`` of friction that grows with
amplitude, so that the loss factor does not depend on it, ``s`` the stress of dry friction of one size (first harmonic
of its loop). ``d`` is no property of the rope: the time by which the test's load channel runs ahead of its elongation
channel.

Sources: Ferry (1980), Viscoelastic Properties of Polymers, ch. 3; Den Hartog (1956), Mechanical Vibrations, sec. 8.6;
Baklouti et al. 2017, Eqs. 8 to 10.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class MaxwellBranch(NamedTuple):
    """One Maxwell branch: ``modulus`` E_k in Pa, ``relaxation_time`` tau_k in s."""

    modulus: float
    relaxation_time: float


@dataclass(frozen=True)
class Material:
    """Viscoelastic constants of a rope, named as in the module's formula.

    ``modulus`` E, ``loss_modulus`` h and ``friction_stress`` s in Pa; ``damping`` c in Pa s; ``delay`` d in s.
    """

    modulus: float
    damping: float = 0.0
    branches: tuple[MaxwellBranch, ...] = ()
    loss_modulus: float = 0.0
    friction_stress: float = 0.0
    delay: float = 0.0


def complex_modulus(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Complex:
    """Complex modulus ``E*`` as above, in Pa, at frequencies in Hz and strain amplitudes, of shapes that broadcast.

    Without an amplitude it is that of large strains, where dry friction does not count.
    """
    omega = angular_frequency(frequency)
    total = material.modulus + 1j * (omega * material.damping + material.loss_modulus)
    total = total + 1j * material.friction_stress * normalised_friction_loss(np.asarray(amplitude, dtype=float))
    for branch in material.branches:
        total = total + branch.modulus * normalised_branch_modulus(omega, branch.relaxation_time)
    modulus: Complex = total * np.exp(1j * omega * material.delay)
    return modulus


def storage_modulus(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """Storage modulus ``E' = Re E*``, in Pa: the stress in phase with strain."""
    return np.asarray(complex_modulus(material, frequency, amplitude).real)


def loss_modulus(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """Loss modulus ``E'' = Im E*``, in Pa: the stress a quarter period ahead of strain."""
    return np.asarray(complex_modulus(material, frequency, amplitude).imag)


def loss_factor(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """Loss factor ``eta = E'' / E'`` (Eq. 8), a pure number."""
    modulus = complex_modulus(material, frequency, amplitude)
    return np.asarray(modulus.imag / modulus.real)


def viscous_damping(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """Equivalent viscous damping ``c = E'' / omega``, Eq. 9's ``E' eta / (2 pi f)``, in Pa s; for f > 0."""
    return np.asarray(loss_modulus(material, frequency, amplitude) / angular_frequency(frequency))


def normalised_branch_modulus(omega: Array, relaxation_time: float) -> Complex:
    """Complex modulus of a Maxwell branch of modulus one: ``i omega tau / (1 + i omega tau)``."""
    i_omega_tau = 1j * omega * relaxation_time
    normalised: Complex = i_omega_tau / (1.0 + i_omega_tau)
    return normalised


def normalised_friction_loss(amplitude: Array) -> Array:
    """Loss modulus of dry friction of stress one: ``4 / (pi a)``."""
    normalised: Array = 4.0 / (np.pi * amplitude)
    return normalised


def angular_frequency(frequency: ArrayLike) -> Array:
    """Angular frequency ``omega = 2 pi f``, in rad/s."""
    omega: Array = 2.0 * np.pi * np.asarray(frequency, dtype=float)
    return omega
