"""The filter of a platform that turns, against a plain one on other equations, closed forms, and the point mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.errors import RecordingError
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.recordings.recording import Recording
from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.symbolic_model import FreeParameter
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.rigid_filter import innovations_and_variances
from tests.support.rigid_motion import RigidRobot
from tests.support.rigid_recordings import rigid_recording, with_noise
from tests.support.rigid_robots import crane_robot, octahedral_robot, underactuated_robot
from tests.support.robots import example

OCTAHEDRAL, CRANE = with_noise(octahedral_robot()), with_noise(crane_robot())


def likelihood_of(robot: Robot, recording: Recording) -> Likelihood:
    interval = float(np.median(np.diff(recording.time)))
    return Likelihood(robot, (), estimate_noise(robot, recording), interval)


@pytest.mark.validate
def test_innovations_are_those_of_a_plain_filter_on_other_equations() -> None:
    recording = rigid_recording(OCTAHEDRAL, 12)
    likelihood = likelihood_of(OCTAHEDRAL, recording)
    noise = likelihood.noise
    innovations = likelihood.innovations(recording, ())
    equilibrium = static_equilibrium(OCTAHEDRAL)
    system = RigidRobot(OCTAHEDRAL, equilibrium.tensions)
    length, angle = noise.start_position**2, noise.start_rotation**2
    covariance = np.diag([length] * 3 + [angle] * 3 + [0.0] * 6 + [length] * 6)
    start = system.start(np.array(equilibrium.orientation))
    deviations = np.array(noise.of_outputs(6))
    values, logs = innovations_and_variances(system, start, covariance, recording, deviations, noise.winch_speed)
    assert innovations.log_variances == pytest.approx(logs, abs=2e-4)
    assert innovations.values == pytest.approx(values, abs=2e-3)


@pytest.mark.validate
@pytest.mark.parametrize("robot", [OCTAHEDRAL, CRANE], ids=["octahedral", "crane"])
def test_innovations_of_a_true_model_are_white_with_unit_variance(robot: Robot) -> None:
    recording = rigid_recording(robot, 120)
    innovations = likelihood_of(robot, recording).innovations(recording, ())
    squares = innovations.mean_square(np.ones(120, dtype=bool))
    assert squares == pytest.approx(np.ones(6 + robot.cable_count), abs=5.0 * np.sqrt(2.0 / 120))


def test_with_all_attachments_at_the_origin_positions_and_tensions_are_those_of_a_point_mass() -> None:
    robot, recording = example("three"), recorded("three", 1).first(300)
    inertia = ((4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 6.0))
    rigid = replace(robot, platform=replace(robot.platform, inertia=inertia))
    expected = likelihood_of(robot, recording).innovations(recording, ())
    found = likelihood_of(rigid, recording).innovations(recording, ())
    assert found.values[:, :6] == pytest.approx(expected.values, rel=1e-9, abs=1e-9)
    rows = np.ones(300, dtype=bool)
    assert found.log_likelihood(rows) == pytest.approx(expected.log_likelihood(rows), rel=1e-9)


def test_the_sign_of_a_quaternion_and_a_tracker_that_loses_the_platform_are_no_matter() -> None:
    recording = rigid_recording(OCTAHEDRAL, 120)
    likelihood = likelihood_of(OCTAHEDRAL, recording)
    whole = likelihood.innovations(recording, ())
    flipped = replace(recording, orientation=recording.orientation * np.where(np.arange(120) % 2, -1.0, 1.0)[:, None])
    assert likelihood.innovations(flipped, ()).values == pytest.approx(whole.values, abs=1e-9)
    seen = recording.orientation.copy()
    seen[40:80] = np.nan
    lost = likelihood.innovations(replace(recording, orientation=seen), ())
    assert np.all(np.isnan(lost.values[40:80, -3:]))
    assert lost.values[:40] == pytest.approx(whole.values[:40], abs=1e-9)
    assert np.nanmean(lost.values[40:] ** 2) == pytest.approx(1.0, abs=0.2)


def test_beside_a_disturbance_free_parameters_leave_innovations_as_they_are() -> None:
    """Of a platform on few cables the static start has no formula, whether or not something of it is free."""
    robot = with_noise(underactuated_robot()).with_effect(EffectSetting("payload", {"mass": 0.5}))
    recording = rigid_recording(robot, 60)
    noise = estimate_noise(robot, recording)
    noise = replace(noise, disturbance=disturbance_prior(robot, noise).median)
    fixed, free = (
        Likelihood(robot, parameters, noise, 0.02).innovations(recording, [0.5] * len(parameters)).values
        for parameters in ([], [FreeParameter(0, "mass")])
    )
    assert fixed == pytest.approx(free, rel=1e-9, abs=1e-9)


def test_a_platform_that_is_turned_by_more_than_the_filter_can_follow_is_refused() -> None:
    recording = rigid_recording(OCTAHEDRAL, 120)
    turned = Rotation.from_rotvec([0.0, 0.0, 2.6]) * Rotation.from_quat(np.roll(recording.orientation, -1, axis=1))
    far = replace(recording, orientation=np.roll(turned.as_quat(), 1, axis=1))
    with pytest.raises(RecordingError, match=r"turned by 2\.6.* rad from its start.*2\.5 rad at most"):
        likelihood_of(OCTAHEDRAL, recording).innovations(far, ())


@pytest.mark.validate
@pytest.mark.parametrize("robot", [OCTAHEDRAL, CRANE], ids=["octahedral", "crane"])
def test_slopes_are_the_derivatives_of_the_innovations(robot: Robot) -> None:
    recording = rigid_recording(robot, 40)
    drum = BY_NAME["drum"].completed_values({"radius_ratio": 1.0})
    extended = robot.with_effect(EffectSetting("drum", drum, robot.cable_numbers))
    extended = extended.with_effect(EffectSetting("payload", {"mass": 0.0}))
    free = [FreeParameter(0, "radius_ratio"), FreeParameter(1, "mass")]
    likelihood = Likelihood(extended, free, estimate_noise(robot, recording), 0.01)
    at = np.array([1.0, 0.0])
    slopes = likelihood.innovations(recording, at).sensitivities
    for index, width in enumerate((1e-5, 1e-3)):
        step = width * np.eye(2)[index]
        more, less = (likelihood.innovations(recording, at + sign * step).values for sign in (1, -1))
        difference = (more - less) / (2.0 * width)
        # Slopes are those of a filter whose gain is held.
        assert np.max(np.abs(difference - slopes[:, :, index])) < 0.05 * np.max(np.abs(difference))
