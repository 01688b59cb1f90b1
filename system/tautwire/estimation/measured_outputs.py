"""Outputs of a robot as numbers: what was measured or simulated of positions, tensions and orientation, and residuals.

Orientation has three columns: a rotation vector in rad, in the axes of the world, that counts from a reference q_0.
Residuals are small rotations, ``log(q q_s^-1)`` from the simulated orientation to the measured one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire_fmu.laws.rotation import Quaternion

from ..errors import RecordingError
from ..recordings.quaternion_columns import rotation_vectors, rotations_between
from ..recordings.recording import Recording
from ..robot.schema import AXES

Array = NDArray[np.float64]

# rad: beyond, the rotation vector from the start nears half a turn, where it is not unique.
MAX_ROTATION = 2.5


class Outputs(Protocol):
    """Positions (N, 3) in m, tensions (N, n) in N, and unit quaternions (N, 4) or None; NaN where not measured."""

    @property
    def position(self) -> Array: ...
    @property
    def tension(self) -> Array: ...
    @property
    def orientation(self) -> Array | None: ...


@dataclass(frozen=True)
class SimulatedOutputs:
    """Simulated outputs, as :class:`Outputs` has them."""

    position: Array
    tension: Array
    orientation: Array | None


def output_names(cable_count: int, is_rigid: bool) -> tuple[str, ...]:
    """Names of the outputs: x, y, z, the tensions, and where the platform turns its rotations."""
    tensions = (f"tension_{cable}" for cable in range(1, cable_count + 1))
    return (*AXES, *tensions, *(f"rotation_{axis}" for axis in AXES if is_rigid))


def measured_outputs(recording: Recording, is_rigid: bool, reference: Quaternion | None = None) -> Array:
    """Measured outputs, shape (N, m), in the order of :func:`output_names`, in SI units; NaN where missing.

    Rotations count from the ``reference``, by default the first orientation that was measured.
    """
    if not is_rigid:
        return recording.measured()
    return np.hstack([recording.measured(), rotation_vectors(recording.orientation, reference)])


def output_residuals(measured: Outputs, simulated: Outputs) -> Array:
    """Measured less simulated, shape (N, m); of orientations the rotation vector from simulated to measured."""
    linear = np.hstack([measured.position - simulated.position, measured.tension - simulated.tension])
    if measured.orientation is None or simulated.orientation is None:
        return linear
    return np.hstack([linear, rotations_between(simulated.orientation, measured.orientation)])


def orientations(rotations: Array, reference: Quaternion) -> Array:
    """Unit quaternions (N, 4) of rotation vectors (N, 3) in rad from a reference."""
    turned = Rotation.from_rotvec(rotations) * Rotation.from_quat(np.roll(np.array(reference, dtype=float), -1))
    return np.roll(turned.as_quat(), 1, axis=1)


def require_small_rotations(recording: Recording, reference: Quaternion) -> None:
    """Raises RecordingError where the platform turns too far from a reference for a rotation vector."""
    angles = np.linalg.norm(rotation_vectors(recording.orientation, reference), axis=1)
    largest = float(np.nanmax(angles, initial=0.0))
    if largest > MAX_ROTATION:
        row = int(np.nanargmax(angles))
        problem = f"at {recording.time[row]:g} s the platform is turned by {largest:.3g} rad from its start"
        raise RecordingError(recording.path, problem, f"trace a part in which it turns by {MAX_ROTATION:g} rad at most")
