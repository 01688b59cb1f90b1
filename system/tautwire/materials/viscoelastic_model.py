"""Complex modulus of a rope as a generalised Maxwell model with hysteresis, and its model structures.

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

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

MAX_BRANCHES = 3
# "modulus": friction that grows with amplitude, a constant loss modulus; "stress": one stress at all amplitudes.
Hysteresis = Literal["none", "modulus", "stress"]


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


class FreeParameter(NamedTuple):
    """One free parameter: the ``effect`` that it belongs to, its ``name``, and its unit."""

    effect: str
    name: str
    unit: str


@dataclass(frozen=True)
class ModelStructure:
    """Model structure: which terms of the complex modulus are free beside the long-term modulus, which always is."""

    damping: bool = False
    branches: int = 0
    hysteresis: Hysteresis = "none"
    delay: bool = False

    @property
    def effects(self) -> frozenset[str]:
        """The free terms by the names of effects in robot files."""
        present = {
            "damping": self.damping,
            "relaxation": self.branches > 0,
            "hysteresis": self.hysteresis != "none",
            "sensor_delay": self.delay,
        }
        return frozenset(name for name, is_present in present.items() if is_present)

    @property
    def family(self) -> ModelStructure:
        """The same structure with one branch where there are any."""
        return replace(self, branches=min(self.branches, 1))

    def without(self, effect: str) -> ModelStructure:
        """The same structure without one of its effects."""
        return ModelStructure(
            damping=self.damping and effect != "damping",
            branches=0 if effect == "relaxation" else self.branches,
            hysteresis="none" if effect == "hysteresis" else self.hysteresis,
            delay=self.delay and effect != "sensor_delay",
        )

    def includes(self, other: ModelStructure) -> bool:
        """Whether this structure includes all terms of the other, whatever the number of branches."""
        same_hysteresis = other.hysteresis in ("none", self.hysteresis)
        return self.effects >= other.effects and same_hysteresis

    @property
    def label(self) -> str:
        """The structure in words."""
        words = ["damping"] * self.damping
        if self.branches:
            words.append("relaxation" if self.branches == 1 else f"relaxation ({self.branches} branches)")
        if self.hysteresis != "none":
            words.append("hysteresis" if self.hysteresis == "modulus" else "hysteresis (one stress)")
        return " + ".join([*words, *(["sensor_delay"] * self.delay)]) or "elastic"

    @property
    def linear_count(self) -> int:
        """Number of parameters in which the modulus is linear; they come first."""
        return 1 + self.damping + (self.hysteresis != "none") + self.branches

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Free parameters: moduli and damping, then relaxation times and delay; branches from the shortest time on."""
        suffixes = ["", *(f"_{number}" for number in range(2, self.branches + 1))][: self.branches]
        kinds = {"none": [], "modulus": ["loss_modulus"], "stress": ["friction_stress"]}
        return (
            FreeParameter("modulus", "modulus", "Pa"),
            *([FreeParameter("damping", "damping", "Pa s")] if self.damping else []),
            *(FreeParameter("hysteresis", kind, "Pa") for kind in kinds[self.hysteresis]),
            *(FreeParameter("relaxation", f"modulus{suffix}", "Pa") for suffix in suffixes),
            *(FreeParameter("relaxation", f"time{suffix}", "s") for suffix in suffixes),
            *([FreeParameter("sensor_delay", "delay", "s")] if self.delay else []),
        )

    def material(self, values: Sequence[float]) -> Material:
        """The material whose parameters have these values, in SI units."""
        remaining = iter([float(value) for value in values])
        modulus = next(remaining)
        damping = next(remaining) if self.damping else 0.0
        loss = next(remaining) if self.hysteresis == "modulus" else 0.0
        friction = next(remaining) if self.hysteresis == "stress" else 0.0
        moduli = [next(remaining) for _ in range(self.branches)]
        times = [next(remaining) for _ in range(self.branches)]
        branches = tuple(MaxwellBranch(*pair) for pair in zip(moduli, times, strict=True))
        return Material(modulus, damping, branches, loss, friction, next(remaining) if self.delay else 0.0)


def branch_variants(structure: ModelStructure, max_parameters: int) -> tuple[ModelStructure, ...]:
    """The structure with no branch, one, two ..., as long as it has at most ``max_parameters`` parameters."""
    choices = (replace(structure, branches=branches) for branches in range(MAX_BRANCHES + 1))
    return tuple(each for each in choices if len(each.parameters) <= max_parameters)
