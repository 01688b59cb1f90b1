"""Tables of dynamic tests that never took place."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tautwire.materials.modulus_observations import ModulusObservations
from tautwire.materials.viscoelastic_model import Material, MaxwellBranch, complex_modulus

CONSTANT = Material(modulus=131e9, damping=0.49e9)
RELAXING = Material(modulus=100e9, damping=0.3e9, branches=(MaxwellBranch(20e9, 0.02), MaxwellBranch(30e9, 1.0)))


def observed(
    material: Material,
    frequency: NDArray[np.float64],
    share: float = 0.01,
    seed: int | None = None,
    amplitude: NDArray[np.float64] | float = np.inf,
) -> ModulusObservations:
    """Both parts of the modulus with an error of this share of its size; exact where there is no seed."""
    strain = np.broadcast_to(np.asarray(amplitude, dtype=float), frequency.shape)
    modulus = complex_modulus(material, frequency, strain)
    sigma = share * np.tile(np.abs(modulus), 2)
    noise = np.zeros(len(sigma)) if seed is None else sigma * np.random.default_rng(seed).standard_normal(len(sigma))
    storage, loss = np.split(np.concatenate([modulus.real, modulus.imag]) + noise, 2)
    return ModulusObservations(frequency, storage, loss, np.diag(sigma**2), strain)


def written(path: Path, seen: ModulusObservations, extra: Sequence[str] = ()) -> Path:
    """The observations as a CSV file of storage and loss modulus, and some lines more."""
    lines = ["frequency,storage_modulus,storage_modulus_uncertainty,loss_modulus,loss_modulus_uncertainty"]
    sigma = np.sqrt(np.diag(seen.covariance))
    rows = np.column_stack([seen.frequency, seen.storage, sigma[: seen.row_count], seen.loss, sigma[seen.row_count :]])
    lines += [",".join(repr(float(number)) for number in row) for row in rows]
    path.write_text("\n".join([*lines, *extra]) + "\n", encoding="utf-8")
    return path
