"""Estimates of uncertain numbers, as far as what is stated of them allows."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire import read_recording, read_robot
from tautwire.estimation.estimation_data import DataSet
from tautwire.estimation.hypotheses import hypotheses
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.smoothed_states import Calibration, calibrate_beside_effects, with_initial_state
from tautwire.estimation.trace_result import Estimate, FoundEffect
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import AXES, EffectSetting
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.uncertain_parameters import uncertain_parameters
from tautwire_fmu.laws.effects.relaxation import RELAXATION
from tests.rig import make_recording, wander
from tests.support.planar import VERTICAL, planar_case
from tests.support.recordings import recorded
from tests.support.rig_robots import rig_of
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


def test_shifts_widen_deviations_up_to_what_is_declared() -> None:
    count = len(calibration(0.0).parameters)
    widened = calibration(2.0).widened(np.array([np.full(count, 0.4), np.full(count, -0.3)]))
    assert widened.standard_deviations == pytest.approx(np.full(count, (0.1**2 + 0.4**2 + 0.3**2) ** 0.5))
    assert np.array_equal(widened.estimates, calibration(2.0).estimates)
    assert np.array_equal(calibration(2.0).widened(np.full((1, count), 5.0)).standard_deviations, np.ones(count))


def test_uncertain_numbers_are_no_better_known_than_the_interval_of_an_effect_beside_them_lets_them() -> None:
    """A weight is the platform's mass or a payload; stiffness has nothing to do with it."""
    robot = example("three")
    cables = tuple(replace(cable, modulus_uncertainty=0.02 * cable.modulus) for cable in robot.cables)
    robot = replace(robot, cables=cables, platform=replace(robot.platform, mass_uncertainty=1.0))
    payload = next(h for h in hypotheses(robot) if h.effect.name == "payload")
    loaded = robot.with_effect(payload.setting(robot, {"mass": 3.0}))
    recording = recorded("three", 1, {"payload": {"mass": 3.0}}).first(400)
    data = DataSet(recording, robot.platform.start, np.ones(400, dtype=bool))
    fitter = Fitter(estimate_noise(robot, recording))

    def deviations(half_width: float) -> dict[str, float]:
        estimate = Estimate(3.0, "kg", 3.0 - half_width, 3.0 + half_width, None)
        effect = FoundEffect("payload", "platform", (), {"mass": estimate}, 100.0)
        found = calibrate_beside_effects(fitter, loaded, (payload,), [effect], data)
        return {p.label: d for p, d in zip(found.parameters, found.standard_deviations.tolist(), strict=True)}

    exact, wide = deviations(0.0), deviations(0.98)
    assert wide["mass"] == pytest.approx(np.hypot(exact["mass"], 0.5), rel=0.05)
    assert wide["modulus of cable 1"] == pytest.approx(exact["modulus of cable 1"], rel=0.2)


def test_a_note_says_by_how_many_standard_deviations_a_number_moved() -> None:
    (note,) = calibration(-2.0).notes(example("three"), "fit.csv")
    assert "gain of tension 2 0.98, +- 0.002 (-2.0 declared standard deviations)" in note
    assert "offset of tension 1 -4 N, +- 0.39 (-2.0 declared standard deviations)" in note
    assert calibration(0.1).notes(example("three"), "fit.csv") == ()
    (note,) = calibration(0.5).notes(example("three"), "fit.csv")
    assert note.endswith("uncertainties: 15 by less than 1 declared standard deviation")


def test_the_number_that_moved_farthest_comes_first() -> None:
    moved = calibration(1.0)
    (note,) = replace(moved, estimates=np.linspace(-1.0, 2.5, len(moved.parameters))).notes(example("three"), "fit.csv")
    sizes = [abs(float(size)) for size in re.findall(r"\(([+-][0-9.]+) declared", note)]
    assert len(sizes) > 2 and sizes == sorted(sizes, reverse=True)


@pytest.mark.validate
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


@pytest.mark.validate
def test_pretension_is_estimated_beside_ropes_that_relax() -> None:
    """The rig's eight cables are 60 N tighter than the file says, and have long relaxed under it."""
    robot = example("eight")
    effect = {"modulus": float(robot.cables[0].modulus), "time": 0.4}
    declared = rig_of(robot)
    tight = replace(declared, tension=replace(declared.tension, preferred=declared.tension.preferred + 60.0))
    program = wander(tight, 1, 0.8, slow=(5.0, 12.0), shake=0.6)
    frame = make_recording(tight, {"relaxation": effect}, program, duration=4.0, rate=100.0, seed=1, noise=False)
    columns = [[f"{name}_{cable}" for cable in robot.cable_numbers] for name in ("winch_speed", "tension")]
    speeds, tensions = (frame[names].to_numpy() for names in columns)
    recording = Recording("tight.csv", frame["time"].to_numpy(), speeds, tensions, frame[list(AXES)].to_numpy())
    values = RELAXATION.completed_values(effect)
    relaxing = robot.with_effect(EffectSetting("relaxation", values, robot.cable_numbers))
    noise = replace(estimate_noise(robot, recording), self_stress=60.0)
    data = DataSet(recording, robot.platform.start, np.ones(len(recording.time), dtype=bool))
    started = with_initial_state(Fitter(noise), relaxing, data)
    assert started.initial_state is not None
    assert static_tensions(started) + started.initial_state.tensions == pytest.approx(tensions[0], abs=1.0)


@pytest.mark.validate
def test_an_initial_state_is_that_of_the_robot_whose_numbers_the_simulation_has(tmp_path: Path) -> None:
    """Positions alone, of a softer robot: a smoother would move its moduli along with the pretension."""
    robot_file, _, _ = planar_case(
        tmp_path, VERTICAL, {"modulus": {"modulus": 0.8e10}}, 1, preferred=60.0, duration=3.0
    )
    robot, recording = read_robot(robot_file), read_recording(tmp_path / "fit.csv", 4)
    cables = tuple(replace(c, modulus_uncertainty=2.5e9, anchor_uncertainty=0.004) for c in robot.cables)
    data = DataSet(recording, robot.platform.start, np.ones(len(recording.time), dtype=bool))
    noise = replace(estimate_noise(robot, recording), self_stress=30.0)
    known, uncertain = (
        with_initial_state(Fitter(noise), each, data).initial_state for each in (robot, replace(robot, cables=cables))
    )
    assert known is not None and uncertain is not None
    assert uncertain.tensions == pytest.approx(known.tensions, abs=1e-3)


def test_a_sensor_off_zero_moves_no_initial_state() -> None:
    """Within its uncertainty it stays the sensor's: the platform starts where it is declared, held by the ropes."""
    robot, recording = example("eight"), recorded("eight", 1)
    robot = replace(robot, sensors=replace(robot.sensors, position_offset_uncertainty=2e-3))
    off_zero = replace(recording, position=recording.position + np.array([4e-3, -2e-3, 1e-3]))
    noise = replace(estimate_noise(robot, recording), self_stress=60.0)
    true_start, started = (
        with_initial_state(Fitter(noise), robot, DataSet(each, robot.platform.start, np.ones(len(each.time), bool)))
        for each in (recording, off_zero)
    )
    assert started.platform.start == pytest.approx(true_start.platform.start, abs=2e-4)
    assert true_start.initial_state is not None and started.initial_state is not None
    assert started.initial_state.tensions == pytest.approx(true_start.initial_state.tensions, abs=2.0)
