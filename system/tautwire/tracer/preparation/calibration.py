"""Calibration of the constants that the robot file declares with an uncertainty.

They are constant states of the augmented filter, so its last state estimates them from the whole recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.uncertain import (
    DAMPING,
    MASS,
    MODULUS,
    UncertainParameter,
    perturbed_robot,
    sensor_offsets,
    uncertain_parameters,
)
from ...recordings.recording import Recording
from ...robots.robot import Robot
from ..data import DataSet
from ..fit import Fitter

Array = NDArray[np.float64]

# Standard deviations by which a constant has to differ from its declared value to be reported.
MIN_REPORTED_SIGMAS = 2.0


@dataclass(frozen=True)
class Calibration:
    """Estimates (k,) of uncertain constants and their posterior standard deviations (k,).

    Both count in declared standard deviations; the estimates from the declared values.
    """

    numbers: tuple[UncertainParameter, ...]
    estimates: Array
    standard_deviations: Array

    def calibrated_robot(self, robot: Robot) -> Robot:
        """The robot with its constants as estimated, each with its posterior uncertainty."""
        updated = perturbed_robot(robot, self.numbers, self.estimates.tolist())
        platform, cables = updated.platform, list(updated.cables)
        for number, deviation in zip(self.numbers, self.standard_deviations.tolist(), strict=True):
            if number.kind == MASS:
                platform = replace(platform, mass_uncertainty=number.standard_deviation * deviation)
            elif number.kind in (MODULUS, DAMPING):
                key, index = f"{number.kind}_uncertainty", number.index - 1
                cables[index] = replace(cables[index], **{key: number.standard_deviation * deviation})
        return replace(updated, platform=platform, cables=tuple(cables))

    def without_sensor_offsets(self, recording: Recording) -> Recording:
        """The recording without the estimated constant errors of its sensors."""
        offset_vector = np.array(sensor_offsets(self.numbers, self.estimates.tolist(), recording.tension.shape[1]))
        if not np.any(offset_vector):
            return recording
        return replace(
            recording, position=recording.position - offset_vector[:3], tension=recording.tension - offset_vector[3:]
        )

    def notes(self, robot: Robot, path: str) -> tuple[str, ...]:
        """A note of the constants that differ significantly from their declared values."""
        significant = []
        for number, estimate, deviation in zip(
            self.numbers, self.estimates.tolist(), self.standard_deviations.tolist(), strict=True
        ):
            if abs(estimate) < MIN_REPORTED_SIGMAS * deviation:
                continue
            value, half_width = (
                number.declared(robot) + number.standard_deviation * estimate,
                1.96 * number.standard_deviation * deviation,
            )
            significant.append(f"{number.label} {value:.4g} {number.unit}, +- {half_width:.2g}")
        if not significant:
            return ()
        return (f"{path}: within what the robot file says of its own uncertainty, {'; '.join(significant)}",)


def calibrate(fitter: Fitter, robot: Robot, sample: DataSet) -> Calibration:
    """Estimate the uncertain constants of a robot with its effects from a recording."""
    numbers = uncertain_parameters(robot)
    if not numbers:
        return Calibration((), np.zeros(0), np.zeros(0))
    likelihood, values = fitter.likelihood(robot, (), sample)
    *_, last_segment = likelihood.segments(sample.recording, values)
    count = len(numbers)
    deviations = np.sqrt(np.maximum(np.diag(last_segment.covariances[-1])[-count:], 0.0))
    return Calibration(numbers, last_segment.states[-count:, -1], deviations)
