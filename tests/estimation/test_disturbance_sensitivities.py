"""Sensitivities of the innovations to a disturbance's numbers, against differences of whole runs of the filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.disturbance import OrnsteinUhlenbeck
from tautwire.estimation.disturbance_posterior import disturbance_prior, logs_of
from tautwire.estimation.disturbance_sensitivities import disturbance_sensitivities
from tautwire.estimation.kalman_filter import Noise
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot
from tests.support.recordings import recorded
from tests.support.rigid_recordings import rigid_recording, with_noise
from tests.support.rigid_robots import octahedral_robot
from tests.support.robots import example

STEP = 1e-4


def noise_of(robot: Robot, recording: Recording) -> Noise:
    noise = estimate_noise(robot, recording)
    return replace(noise, disturbance=disturbance_prior(robot, noise).median)


def require_derivatives(robot: Robot, recording: Recording, noise: Noise, tolerance: float) -> None:
    """Of innovations and logs of variances by each number, within a share of the largest one."""
    likelihood = Likelihood(robot, (), noise, float(np.median(np.diff(recording.time))))
    prior = disturbance_prior(robot, noise)
    logs = logs_of(prior.median)
    observed = likelihood.innovations(recording, ()).observed
    by_logs = disturbance_sensitivities(likelihood, prior.median, recording, ())
    assert by_logs[0].shape == by_logs[1].shape == (*observed.shape, prior.number_count)
    for number in range(prior.number_count):
        move = STEP * np.eye(prior.number_count)[number]
        ends = [
            likelihood.with_disturbance(prior.disturbance_of(logs + sign * move)).innovations(recording, ())
            for sign in (1.0, -1.0)
        ]
        moved = ([end.values for end in ends], [end.log_variances for end in ends])
        for derivatives, (later, earlier) in zip(by_logs, moved, strict=True):
            expected = (later[observed] - earlier[observed]) / (2.0 * STEP)
            largest = float(np.max(np.abs(expected)))
            assert largest > 1e-4
            assert derivatives[..., number][observed] == pytest.approx(expected, abs=tolerance * largest)


def test_sensitivities_are_the_derivatives_of_innovations_and_their_variances() -> None:
    robot, recording = example("three"), recorded("three", 1).first(300)
    require_derivatives(robot, recording, noise_of(robot, recording), 1e-4)


def test_what_was_not_observed_and_uneven_steps_are_part_of_the_derivatives() -> None:
    robot, recording = example("three"), recorded("three", 1).first(300)
    kept = np.delete(np.arange(300), np.r_[50:53, 120])
    tension, position = recording.tension[kept].copy(), recording.position[kept].copy()
    tension[20:90, 1], position[::3, 0] = np.nan, np.nan
    gappy = replace(
        recording,
        time=recording.time[kept],
        winch_speed=recording.winch_speed[kept],
        tension=tension,
        position=position,
    )
    require_derivatives(robot, gappy, noise_of(robot, recording), 1e-4)


def test_errors_of_recorded_lengths_are_no_number_of_the_disturbance() -> None:
    robot, recording = example("three"), recorded("three", 1).first(300)
    noise = replace(noise_of(robot, recording), rope_lengths=(OrnsteinUhlenbeck(1e-4, 1.0),) * robot.cable_count)
    require_derivatives(robot, recording, noise, 1e-4)


@pytest.mark.validate
def test_a_platform_that_turns_has_moments_and_a_third_kind_of_sensor() -> None:
    """Its rotations are less linear: what the numbers change in the states changes the linearisation a little."""
    robot = with_noise(octahedral_robot())
    recording = rigid_recording(robot, 60)
    require_derivatives(robot, recording, noise_of(robot, recording), 1e-3)
