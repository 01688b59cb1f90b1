"""The complex modulus of a rope over the frequency of a small sinusoidal strain.

    E*(f) = (E + i omega c + sum_k E_k i omega tau_k / (1 + i omega tau_k) + i h + i 4 s / (pi a)) exp(i omega d)

with ``omega = 2 pi f`` and the strain amplitude ``a``. ``E`` is the long-term modulus and ``c`` the viscous damping of
the paper's law; each branch is a spring ``E_k`` in series with a dashpot, which lets go in the time ``tau_k``
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


class Branch(NamedTuple):
    """One Maxwell branch: ``modulus`` E_k in Pa, relaxation ``time`` tau_k in s."""

    modulus: float
    time: float


@dataclass(frozen=True)
class Material:
    """A rope's constants: ``modulus`` E, ``loss`` h, ``friction`` s in Pa; ``damping`` c in Pa s; ``delay`` d in s."""

    modulus: float
    damping: float = 0.0
    branches: tuple[Branch, ...] = ()
    loss: float = 0.0
    friction: float = 0.0
    delay: float = 0.0


def complex_modulus(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Complex:
    """``E*`` as above, in Pa, at frequencies in Hz and strain amplitudes, of shapes that go together.

    Without an amplitude it is that of large strains, where dry friction does not count.
    """
    omega = angular(frequency)
    total = material.modulus + 1j * (omega * material.damping + material.loss)
    total = total + 1j * material.friction * friction_share(np.asarray(amplitude, dtype=float))
    for branch in material.branches:
        total = total + branch.modulus * branch_share(omega, branch.time)
    modulus: Complex = total * np.exp(1j * omega * material.delay)
    return modulus


def storage_modulus(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """``E' = Re E*``, in Pa: the stress in phase with strain."""
    return np.asarray(complex_modulus(material, frequency, amplitude).real)


def loss_modulus(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """``E'' = Im E*``, in Pa: the stress a quarter period ahead of strain."""
    return np.asarray(complex_modulus(material, frequency, amplitude).imag)


def loss_factor(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """``eta = E'' / E'`` (Eq. 8), a pure number."""
    modulus = complex_modulus(material, frequency, amplitude)
    return np.asarray(modulus.imag / modulus.real)


def damping(material: Material, frequency: ArrayLike, amplitude: ArrayLike = np.inf) -> Array:
    """``c = E'' / omega``, which is Eq. 9's ``E' eta / (2 pi f)``, in Pa s; frequencies above zero."""
    return np.asarray(loss_modulus(material, frequency, amplitude) / angular(frequency))


def branch_share(omega: Array, time: float) -> Complex:
    """``i omega tau / (1 + i omega tau)``: what a branch of modulus one adds."""
    turn = 1j * omega * time
    share: Complex = turn / (1.0 + turn)
    return share


def friction_share(amplitude: Array) -> Array:
    """``4 / (pi a)``: the loss modulus of dry friction of stress one."""
    share: Array = 4.0 / (np.pi * amplitude)
    return share


def angular(frequency: ArrayLike) -> Array:
    """``omega = 2 pi f``, in rad/s."""
    omega: Array = 2.0 * np.pi * np.asarray(frequency, dtype=float)
    return omega
