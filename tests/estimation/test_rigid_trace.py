"""Whole traces of platforms that turn, on recordings by their textbook equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire import trace
from tautwire.cosimulation.robot_cosimulation import CosimulationResult
from tautwire.estimation import likelihood
from tautwire.estimation.cosimulation_validation import as_tracked
from tautwire.estimation.disturbance import sensor_noise_only
from tautwire.estimation.disturbance_posterior import disturbance_prior, logs_of
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import EffectSetting, Robot
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.rigid_recordings import rigid_recording, with_noise
from tests.support.rigid_robots import octahedral_robot, suspended_robot
from tests.support.robots import EXAMPLES

OCTAHEDRAL, HANGING = with_noise(octahedral_robot()), with_noise(suspended_robot(4))


def damped(robot: Robot, factor: float) -> Robot:
    return replace(robot, cables=tuple(replace(each, damping=factor * each.damping) for each in robot.cables))


@pytest.mark.validate
def test_a_load_beside_the_centre_of_mass_is_named_alone_with_its_place() -> None:
    """Of a load at the centre sag of all ropes would explain more."""
    folder = EXAMPLES / "cogiro"
    robot = read_robot(folder / "robot.toml")
    fit, check = (read_recording(folder / f"{role}.csv", robot.cable_count) for role in ("fit", "check"))
    result = trace(robot, fit, check)
    (payload,) = result.effects
    assert payload.name == "payload"
    found = {name: estimate.value for name, estimate in payload.parameters.items()}
    assert found == pytest.approx({"mass": 5.0, "x": 0.4, "y": 0.3, "z": 0.7}, rel=0.02)


@pytest.mark.validate
@pytest.mark.parametrize(
    ("declared", "truth", "effects"),
    [
        (OCTAHEDRAL, OCTAHEDRAL, ()),
        (HANGING, damped(HANGING, 4.0), ("damping",)),
    ],
    ids=["none on six", "damping on four"],
)
def test_what_a_platform_that_turns_lacks_is_named_alone(
    declared: Robot, truth: Robot, effects: tuple[str, ...]
) -> None:
    fit, check = (rigid_recording(truth, 150, seed=seed) for seed in (1, 2))
    result = trace(declared, fit, check)
    assert tuple(each.name for each in result.effects) == effects
    after = result.comparisons[-1].errors_after
    assert after.orientation_rms == pytest.approx(result.noise_floor.orientation_rms, rel=0.25)
    assert result.normalised_innovation_variance == pytest.approx(np.ones(6 + truth.cable_count), abs=0.4)


@pytest.mark.validate
def test_a_disturbance_of_no_size_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(likelihood, "MAX_STATE_ANGLE_BESIDE_DISTURBANCE", likelihood.MAX_STATE_ANGLE)
    recording = rigid_recording(OCTAHEDRAL, 60)
    noise = estimate_noise(OCTAHEDRAL, recording)
    nothing = sensor_noise_only(disturbance_prior(OCTAHEDRAL, noise).median, 0.0, 0.0, 0.0)
    nothing = replace(
        nothing, position_noise=noise.position, tension_noise=noise.tension, rotation_noise=noise.rotation or 0.0
    )
    plain = Likelihood(OCTAHEDRAL, (), noise, 0.01).innovations(recording, ())
    beside = Likelihood(OCTAHEDRAL, (), replace(noise, disturbance=nothing), 0.01).innovations(recording, ())
    assert beside.values == pytest.approx(plain.values, abs=1e-9)


def test_the_numbers_of_a_disturbance_are_those_of_their_logs() -> None:
    noise = estimate_noise(OCTAHEDRAL, rigid_recording(OCTAHEDRAL, 60))
    prior = disturbance_prior(OCTAHEDRAL, noise)
    logs = logs_of(prior.median)
    assert len(logs) == prior.number_count == 11
    assert logs_of(prior.disturbance_of(logs + 0.1)) == pytest.approx(logs + 0.1, abs=1e-12)
    assert prior.disturbance_of(logs).moment_arm == prior.median.moment_arm > 0.5


def test_a_tracker_that_lags_shows_a_past_orientation() -> None:
    time = 0.01 * np.arange(50)
    turned = Rotation.from_rotvec(np.outer(time, [0.0, 0.3, 0.4])).as_quat()
    nothing = np.zeros((50, 6))
    motion = CosimulationResult(time, *[np.zeros((50, 3))] * 2, *[nothing] * 4, orientation=np.roll(turned, 1, axis=1))
    late = {**BY_NAME["sensor_delay"].completed_values({"position_delay": 0.025})}
    shown = as_tracked(OCTAHEDRAL.with_effect(EffectSetting("sensor_delay", late, (1,))), motion).orientation
    assert shown is not None
    angles = Rotation.from_quat(np.roll(shown, -1, axis=1)).magnitude()
    assert angles == pytest.approx(0.5 * np.maximum(time - 0.025, 0.0), abs=1e-12)
    assert as_tracked(OCTAHEDRAL, motion) is motion


def test_the_random_moment_is_the_random_force_at_the_size_of_the_platform() -> None:
    disturbance = disturbance_prior(OCTAHEDRAL, estimate_noise(OCTAHEDRAL, rigid_recording(OCTAHEDRAL, 60))).median
    sizes = [each.rms for each in disturbance.processes(6)]
    assert sizes[3:6] == pytest.approx([0.8 * size for size in sizes[:3]])
    assert len(sizes) == 6 + 3 + 6 + 3
    assert len(disturbance.white_variances(6)) == 12
