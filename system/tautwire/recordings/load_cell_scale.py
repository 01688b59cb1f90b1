"""Scale or zero that all load cells have in common, by the balance of tensions with the platform's weight."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import AXES, Robot
from .alternative_readings import winding_as_declared
from .clock_fit import JACKKNIFE_BLOCKS
from .geometry_reading import GeometryReading
from .recording import Recording
from .weight_balance import ForceBalance, force_balance

Array = NDArray[np.float64]

# Share of the weight to which load cells and masses are usually known, and standard deviations of what is declared.
MIN_SHARE, MIN_SIGMAS = 0.03, 4.0
# Of what is not declared: a load cell's gain, and an exit point's error in lengths of the rope.
GAIN_DEVIATION, ANGLE_DEVIATION = 0.005, 0.002
# Rms of the forces that are not balanced, with a cause over that without.
MAX_RESIDUAL_SHARE = 0.5
# Beyond them a cause is no effect: of gains, and of a payload by the platform's mass. A share that is farther off is
# told for whatever cause.
GAINS, MIN_PAYLOAD_SHARE, MAX_UNEXPLAINED = (0.25, 4.0), -0.75, 0.5


@dataclass(frozen=True)
class LoadCellScale:
    """Share ``carried`` of weight and inertia that the tensions carry, its deviation, and what would balance them.

    ``gain`` is what cells show over the true tension, ``offset`` (N) what each shows too much, ``payload`` in kg; None
    where it would not.
    """

    carried: float
    deviation: float
    gain: float | None
    offset: float | None
    payload: float | None


def load_cell_scale(robot: Robot, recording: Recording) -> LoadCellScale | None:
    """What all load cells have in common that is off, significantly against declared uncertainties; None else.

    Least squares of the forces that tensions lack, block by block, on those of the tensions, of one newton in each rope
    and of the weight.
    """
    balance = force_balance(robot, recording, GeometryReading(), winding_as_declared(robot.cable_count))
    if balance is None:
        return None
    # A payload beside the centre of mass does not balance moments.
    axes = slice(len(AXES))
    balance = replace(balance, directions=balance.directions[:, axes], required=balance.required[:, axes])
    order = tuple(range(robot.cable_count))
    carried, deviation = balance.carried(order), _deviation(robot, balance)
    if abs(carried - 1.0) <= max(MIN_SHARE, MIN_SIGMAS * deviation):
        return None
    forces = np.einsum("bci,bi->bc", balance.directions, balance.tensions)
    gain, offset, payload = (
        _balancing(forces - balance.required, shape)
        for shape in (forces, balance.directions.sum(axis=2), balance.required)
    )
    gain = None if gain is None or not GAINS[0] < 1.0 / max(1.0 - gain, 1e-9) < GAINS[1] else gain
    payload = None if payload is None or payload < MIN_PAYLOAD_SHARE else payload
    if gain is None and offset is None and payload is None and abs(carried - 1.0) <= MAX_UNEXPLAINED:
        return None
    return LoadCellScale(
        carried,
        deviation,
        gain=None if gain is None else 1.0 / (1.0 - gain),
        offset=offset,
        payload=None if payload is None else payload * robot.platform.mass,
    )


def _balancing(excess: Array, shape: Array) -> float | None:
    """By how much of a shape (B, 3) forces exceed what is required; None where that leaves more than a share."""
    energy = float(np.sum(shape**2))
    amount = float(np.sum(excess * shape)) / energy if energy > 0.0 else 0.0
    is_balanced = np.linalg.norm(excess - amount * shape) <= MAX_RESIDUAL_SHARE * np.linalg.norm(excess)
    return amount if is_balanced else None


def _deviation(robot: Robot, balance: ForceBalance) -> float:
    """Standard deviation of the share carried: of blocks, by a jackknife, mass, cells, and exit points."""
    energy = float(np.sum(balance.required**2))
    by_cell = np.einsum("bci,bc->bi", balance.directions, balance.required) / energy
    tensions, sensors, platform = balance.tensions, robot.sensors, robot.platform
    left = np.sum(by_cell * tensions, axis=1) - np.sum(balance.required**2, axis=1) / energy * np.sum(
        by_cell * tensions
    )
    blocks = np.array([block.sum() for block in np.array_split(left, JACKKNIFE_BLOCKS)])
    lengths = np.linalg.norm(np.array(robot.anchors) - platform.start, axis=1)
    angles = np.maximum([cable.anchor_uncertainty for cable in robot.cables] / lengths, ANGLE_DEVIATION)
    weight = float(np.sqrt(energy / len(tensions)))
    parts = (
        np.sqrt(blocks @ blocks * JACKKNIFE_BLOCKS / (JACKKNIFE_BLOCKS - 1)),
        platform.mass_uncertainty / platform.mass,
        sensors.tension_offset_uncertainty * np.linalg.norm(by_cell.sum(axis=0)),
        max(sensors.tension_gain_uncertainty, GAIN_DEVIATION) * np.linalg.norm((by_cell * tensions).sum(axis=0)),
        np.linalg.norm(angles * tensions.mean(axis=0)) / weight,
    )
    return float(np.linalg.norm(parts))
