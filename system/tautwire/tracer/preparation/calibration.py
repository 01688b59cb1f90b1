"""Numbers that the robot file states with an uncertainty, as a recording has them.

They are states of the filter that never move, so its last state knows them by the whole recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.uncertain import DAMPING, MASS, MODULUS, UncertainNumber, offsets, uncertain_numbers, with_moves
from ...recordings.recording import Recording
from ...robots.robot import Robot
from ..data import Sample
from ..fit import Fitter

Array = NDArray[np.float64]

# Standard deviations by which a number has to differ from what is declared to be told.
TOLD = 2.0


@dataclass(frozen=True)
class Calibration:
    """Moves (k,) of uncertain numbers in their declared standard deviations, and the standard deviations left (k,)."""

    numbers: tuple[UncertainNumber, ...]
    moves: Array
    left: Array

    def robot(self, robot: Robot) -> Robot:
        """The robot with its numbers as they were found, each with the uncertainty that is left of it."""
        moved = with_moves(robot, self.numbers, self.moves.tolist())
        platform, cables = moved.platform, list(moved.cables)
        for number, left in zip(self.numbers, self.left.tolist(), strict=True):
            if number.kind == MASS:
                platform = replace(platform, mass_uncertainty=number.deviation * left)
            elif number.kind in (MODULUS, DAMPING):
                key, place = f"{number.kind}_uncertainty", number.place - 1
                cables[place] = replace(cables[place], **{key: number.deviation * left})
        return replace(moved, platform=platform, cables=tuple(cables))

    def recording(self, recording: Recording) -> Recording:
        """The recording without the constant errors of its sensors."""
        off = np.array(offsets(self.numbers, self.moves.tolist(), recording.tension.shape[1]))
        if not np.any(off):
            return recording
        return replace(recording, position=recording.position - off[:3], tension=recording.tension - off[3:])

    def notes(self, robot: Robot, path: str) -> tuple[str, ...]:
        """What is told of the numbers: each that clearly differs from what is declared."""
        told = []
        for number, move, left in zip(self.numbers, self.moves.tolist(), self.left.tolist(), strict=True):
            if abs(move) < TOLD * left:
                continue
            value, reach = number.declared(robot) + number.deviation * move, 1.96 * number.deviation * left
            told.append(f"{number.label} {value:.4g} {number.unit}, +- {reach:.2g}")
        if not told:
            return ()
        return (f"{path}: within what the robot file says of its own uncertainty, {'; '.join(told)}",)


def calibrated(fitter: Fitter, robot: Robot, sample: Sample) -> Calibration:
    """What a recording says of the uncertain numbers under a robot with its effects."""
    numbers = uncertain_numbers(robot)
    if not numbers:
        return Calibration((), np.zeros(0), np.zeros(0))
    likelihood, values = fitter.likelihood(robot, (), sample)
    *_, last = likelihood.stretches(sample.recording, values)
    count = len(numbers)
    left = np.sqrt(np.maximum(np.diag(last.covariances[-1])[-count:], 0.0))
    return Calibration(numbers, last.states[-count:, -1], left)
