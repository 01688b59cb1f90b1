"""Natural frequencies of any robot at its start, from the slopes of its accelerations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.rig.mechanics import Rig
from tests.rig.program import StillProgram
from tests.rig.robot import Robot, Vector
from tests.rig.wander import natural_frequencies

STEP = 1e-6  # m, and of Gibbs vectors


def frequencies_of(robot: Robot) -> Vector:
    """Undamped modes at the start, Hz: three of a point mass, six of a platform that turns, rising."""
    if robot.body is None:
        return natural_frequencies(robot)
    rig = Rig(replace(robot, damping=np.zeros(robot.count)), {}, StillProgram(robot.count))
    assert rig.turning is not None
    places = [0, 1, 2, *range(rig.turning.part.start, rig.turning.part.start + 3)]
    speeds = [3, 4, 5, *range(rig.turning.part.start + 3, rig.turning.part.stop)]
    slopes = np.empty((6, 6))
    for column, place in enumerate(places):
        aside = STEP * np.eye(rig.size)[place]
        slopes[:, column] = (rig.rates(0.0, aside)[speeds] - rig.rates(0.0, -aside)[speeds]) / (2.0 * STEP)
    # An angle is twice its Gibbs vector.
    slopes[:, 3:] *= 0.5
    squares = np.sort(np.linalg.eigvals(-slopes).real)
    return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
