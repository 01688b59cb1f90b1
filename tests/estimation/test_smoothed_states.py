"""Estimates of uncertain numbers, as far as what is stated of them allows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire import read_recording, read_robot
from tautwire.estimation.estimation_data import DataSet
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.smoothed_states import Calibration, with_initial_state
from tautwire.robot.uncertain_parameters import uncertain_parameters
from tests.support.planar import VERTICAL, planar_case
from tests.support.recordings import recorded
from tests.support.robots import example


def calibration(estimate: float) -> Calibration:
    """Every number of a roughly known robot off by so many standard deviations, each known ten times better since."""
    robot = example("three")
    cables = tuple(replace(cable, anchor_uncertainty=0.002) for cable in robot.cables)
    sensors = replace(robot.sensors, tension_gain_uncertainty=0.01, tension_offset_uncertainty=2.0)
    numbers = uncertain_parameters(replace(robot, cables=cables, sensors=sensors))
    return Calibration(numbers, np.full(len(numbers), estimate), np.full(len(numbers), 0.1))


def test_an_estimate_beyond_what_is_stated_is_taken_at_its_bound() -> None:
    assert np.array_equal(calibration(25.0).clipped(3.0).estimates, calibration(3.0).estimates)
    assert np.array_equal(calibration(-25.0).clipped(3.0).estimates, calibration(-3.0).estimates)
    assert np.array_equal(calibration(2.0).clipped(3.0).estimates, calibration(2.0).estimates)


def test_a_calibrated_robot_has_its_exit_points_where_they_are_and_better_known() -> None:
    robot = example("three")
    calibrated = calibration(2.0).calibrated_robot(robot)
    for cable, before in zip(calibrated.cables, robot.cables, strict=True):
        assert cable.anchor == pytest.approx([value + 0.004 for value in before.anchor])
        assert cable.anchor_uncertainty == pytest.approx(2e-4)


def test_gains_and_offsets_of_load_cells_are_taken_out_of_a_recording() -> None:
    recording = recorded("three", 1)
    corrected = calibration(2.0).without_sensor_errors(recording)
    assert corrected.tension == pytest.approx((recording.tension - 4.0) / 1.02)
    assert np.array_equal(corrected.position, recording.position)


def test_a_note_says_by_how_many_standard_deviations_a_number_moved() -> None:
    (note,) = calibration(-2.0).notes(example("three"), "fit.csv")
    assert "gain of tension 2 0.98, +- 0.002 (-2.0 declared standard deviations)" in note
    assert "offset of tension 1 -4 N, +- 0.39 (-2.0 declared standard deviations)" in note
    assert calibration(0.1).notes(example("three"), "fit.csv") == ()


def test_a_planar_robot_starts_in_its_plane_beside_an_uncertain_pretension(tmp_path: Path) -> None:
    robot_file, fit, _ = planar_case(tmp_path, VERTICAL, {}, 1, duration=3.0)
    robot, recording = read_robot(robot_file), read_recording(fit, 4)
    across = np.random.default_rng(1).normal(scale=1e-4, size=len(recording.time))
    recording = replace(
        recording, position=np.column_stack([recording.position[:, 0], across, recording.position[:, 2]])
    )
    noise = replace(estimate_noise(robot, recording), self_stress=8.0)
    data = DataSet(recording, robot.platform.start, np.ones(len(recording.time), dtype=bool))
    started = with_initial_state(Fitter(noise), robot, data)
    assert started.initial_state is not None
    assert started.platform.start[1] == 0.0
    assert started.platform.start != robot.platform.start
