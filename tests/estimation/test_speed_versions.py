"""Winch speeds that are samples of a smooth motion, against the rig, which moves smoothly between samples."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tautwire.estimation import identification, preprocessing, trace
from tautwire.estimation.cosimulation_validation import cosimulate_data_set
from tautwire.estimation.estimation_data import DataSet, DataSplit
from tautwire.estimation.innovations import Innovations
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.policy import DEFAULT_POLICY
from tautwire.estimation.preprocessing import prepare_data
from tautwire.estimation.speed_versions import split_with_other_interpolation
from tautwire.estimation.worker_pool import WorkerPool
from tautwire.recordings.recording import Recording
from tautwire.recordings.speed_interpolation import with_spline_speeds
from tautwire.robot.schema import AXES, Robot
from tests.rig import SampledProgram, load_robot, make_recording, wander
from tests.rig.robot import Noise
from tests.support.recordings import REACH
from tests.support.robots import EXAMPLES, example

RATE = 50.0
RIG_ROBOT = load_robot(EXAMPLES / "three" / "robot.toml")
NOISE = RIG_ROBOT.noise
PRECISE = replace(NOISE, position=1e-6, tension=1e-2, winch_speed=1e-7)
THREE = example("three")
SURVEYED = replace(THREE, cables=tuple(replace(cable, anchor_uncertainty=1e-4) for cable in THREE.cables))

PRECISELY_MEASURED, EXACT = (
    replace(robot, sensors=replace(THREE.sensors, position_noise=1e-6, tension_noise=1e-2, winch_speed_noise=1e-7))
    for robot in (SURVEYED, THREE)
)


def shaken(
    is_smooth: bool, seed: int = 1, duration: float = 8.0, damping: float | None = None, noise: Noise | None = NOISE
) -> Recording:
    """Winches that vibrate, smoothly between samples or linearly."""
    robot = replace(RIG_ROBOT, noise=noise or NOISE)
    smooth = wander(robot, seed, REACH["three"], slow=(5.0, 12.0), shake=0.6)
    times = np.arange(round(duration * RATE) + 1) / RATE
    linear = SampledProgram(times, np.array([smooth.speed(float(time)) for time in times]))
    frame = make_recording(
        robot,
        {"damping": {"damping": damping}} if damping else {},
        smooth if is_smooth else linear,
        duration=duration,
        rate=RATE,
        seed=seed,
        noise=noise is not None,
    )
    speeds, tensions = ([f"{name}_{i}" for i in (1, 2, 3)] for name in ("winch_speed", "tension"))
    columns = [frame[names].to_numpy(dtype=float) for names in (speeds, tensions, list(AXES))]
    return Recording(f"shaken-{seed}.csv", frame["time"].to_numpy(dtype=float), *columns)


def test_filter_and_fmus_move_with_a_smooth_motion_as_the_rig_does() -> None:
    measured = shaken(True, noise=None)
    likelihood = Likelihood(THREE, (), estimate_noise(THREE, measured), 1.0 / RATE)
    errors = {}
    for name, recording in (("linear", measured), ("cubic", with_spline_speeds(measured))):
        simulated = likelihood.simulated_outputs(recording, [])
        data = DataSet(recording, THREE.platform.start, np.ones(recording.sample_count, dtype=bool))
        motion = cosimulate_data_set(THREE, data)
        errors[name] = [float(np.max(np.abs(each.position - measured.position))) for each in (simulated, motion)]
        errors[name] += [float(np.max(np.abs(each.tension - measured.tension))) for each in (simulated, motion)]
    assert all(cubic < 0.1 * linear for cubic, linear in zip(errors["cubic"], errors["linear"], strict=True)), errors


def split_of(fit: Recording, check: Recording) -> DataSplit:
    fit_data, check_data = (
        DataSet(each, THREE.platform.start, np.ones(each.sample_count, dtype=bool)) for each in (fit, check)
    )
    return DataSplit(fit_data, check_data, ())


def test_the_other_interpolation_is_that_of_both_recordings() -> None:
    recording = shaken(True, noise=None, duration=2.0)
    other = split_with_other_interpolation(split_of(recording, recording))
    assert other is not None and other.estimation.recording.winch_acceleration is not None
    assert other.validation.recording is other.estimation.recording
    back = split_with_other_interpolation(other)
    assert back is not None and back.estimation.recording.winch_acceleration is None


def test_speeds_of_an_encoder_have_no_other_interpolation() -> None:
    recording = shaken(True, noise=None, duration=2.0)
    counted = replace(recording, winch_speed=np.round(recording.winch_speed, 2))
    assert split_with_other_interpolation(split_of(counted, counted)) is None


def test_speeds_taken_from_an_encoder_stay_so() -> None:
    recording = shaken(True, noise=None, duration=2.0)
    taken = replace(split_of(recording, recording), has_speeds_between_samples=True)
    assert split_with_other_interpolation(taken) is None


@pytest.mark.validate
@pytest.mark.parametrize("robot", [PRECISELY_MEASURED, EXACT], ids=["beside a disturbance", "without one"])
def test_speeds_are_cubic_where_that_is_far_likelier(robot: Robot) -> None:
    for is_smooth in (False, True):
        recordings = (shaken(is_smooth, seed, noise=PRECISE) for seed in (1, 2))
        prepared, *_ = prepare_data(robot, *recordings, WorkerPool(1))
        is_cubic = prepared.split.estimation.recording.winch_acceleration is not None
        assert is_cubic == is_smooth


@pytest.mark.parametrize(
    ("square", "has_disturbance", "is_cubic"), [(1.0, False, True), (41.0, False, False), (41.0, True, True)]
)
def test_without_a_disturbance_cubic_speeds_explain_a_share_of_the_misfit(
    monkeypatch: pytest.MonkeyPatch, square: float, has_disturbance: bool, is_cubic: bool
) -> None:
    """They gain 20 nats on 100 values."""
    split, smooth = (SimpleNamespace(estimation=SimpleNamespace(rows=np.ones(50, dtype=bool))) for _ in range(2))
    zeros = np.zeros((50, 2))
    innovations = Innovations(np.ones((50, 2), dtype=bool), np.full((50, 2), square**0.5), zeros, zeros)
    fitter = SimpleNamespace(
        has_disturbance=has_disturbance,
        innovations=lambda robot, data: innovations,
        log_likelihood=lambda *_: 20.0 + innovations.log_likelihood(split.estimation.rows),
    )
    monkeypatch.setattr(preprocessing, "with_fitted_disturbance", lambda fitter, *_: fitter)
    monkeypatch.setattr(preprocessing, "split_with_other_interpolation", lambda split: smooth)
    fitter_after, split_after = preprocessing._with_likely_interpolation(
        cast("Any", fitter), THREE, cast("Any", split), DEFAULT_POLICY.preprocessing
    )
    assert fitter_after is fitter
    assert (split_after is smooth) == is_cubic


@pytest.mark.validate
@pytest.mark.parametrize("robot", [PRECISELY_MEASURED, EXACT], ids=["beside a disturbance", "without one"])
@pytest.mark.parametrize("is_smooth", [True, False])
def test_interpolation_is_judged_again_under_the_effects_found(
    monkeypatch: pytest.MonkeyPatch, is_smooth: bool, robot: Robot
) -> None:
    """It begins with the wrong one."""
    threshold = np.inf if is_smooth else -np.inf
    wrong_first = replace(DEFAULT_POLICY.preprocessing, min_cubic_gain=threshold, min_cubic_gain_to_misfit=threshold)
    monkeypatch.setattr(
        identification, "policy_within", lambda seconds: replace(DEFAULT_POLICY, preprocessing=wrong_first)
    )
    result = trace(robot, *(shaken(is_smooth, seed, damping=6e9, noise=PRECISE) for seed in (1, 2)))
    assert [effect.name for effect in result.effects] == ["damping"]
    notes = [note for note in result.notes if "winch speeds are cubic between samples" in note]
    assert len(notes) == (2 if is_smooth else 0)
