from dataclasses import replace
from pathlib import Path

import casadi
import numpy as np
import pytest

from tautwire.estimation.initial_state_prior import initial_covariance, self_stress_deviation, self_stress_projection
from tautwire.estimation.kalman_filter import Noise
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.recordings.recording import Recording
from tautwire.robot.equilibrium_slopes import equilibrium_slopes
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import EffectSetting, InitialState
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.symbolic_model import symbolic_model
from tautwire_fmu.laws.effects.relaxation import RELAXATION
from tests.support.recordings import recorded
from tests.support.rigid_robots import underactuated_robot
from tests.support.robots import example

THREE, EIGHT = example("three"), example("eight")


def blind(name: str) -> Recording:
    recording = recorded(name, 1)
    return replace(recording, tension=np.full_like(recording.tension, np.nan))


def test_a_start_at_rest_is_known_to_the_sensors_noise() -> None:
    noise = estimate_noise(THREE, recorded("three", 1))
    covariance = initial_covariance(THREE, noise, 9)
    assert covariance == pytest.approx(
        np.diag([*[noise.start_position**2] * 3, *[0.0] * 3, *[noise.start_position**2] * 3])
    )


def test_three_cables_have_no_tension_that_holds_nothing() -> None:
    assert self_stress_projection(THREE) == pytest.approx(np.zeros((3, 3)), abs=1e-9)
    assert self_stress_deviation(THREE, (blind("three"),)) == (0.0, ())


def test_tensions_that_hold_nothing_pull_nowhere() -> None:
    stresses = self_stress_projection(EIGHT)
    assert np.linalg.matrix_rank(stresses, tol=1e-6) == 5
    unit = np.array(EIGHT.anchors) - EIGHT.platform.start
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    assert unit.T @ stresses == pytest.approx(np.zeros((3, 8)), abs=1e-9)


def test_lengths_are_uncertain_by_what_such_tensions_stretch() -> None:
    covariance = initial_covariance(EIGHT, Noise(1e-4, 1.0, 1e-5, 0.0, self_stress=30.0), 14)[6:, 6:]
    stiffness = [c.modulus * c.area / np.linalg.norm(np.subtract(c.anchor, EIGHT.platform.start)) for c in EIGHT.cables]
    tensions = np.diag(stiffness) @ covariance @ np.diag(stiffness)
    assert tensions == pytest.approx(900.0 * self_stress_projection(EIGHT), abs=1e-6)


def test_relaxed_ropes_have_relaxed_under_the_pretension_that_they_have() -> None:
    """The filter's start with a branch in each rope: no direction in which it is uncertain makes a strain relax."""
    relaxing = EIGHT.with_effect(
        EffectSetting("relaxation", RELAXATION.completed_values({"modulus": 1e11, "time": 0.4}), EIGHT.cable_numbers)
    )
    likelihood = Likelihood(relaxing, (), Noise(1e-4, 1.0, 1e-5, 1e-4, self_stress=30.0), 0.01)
    state, covariance = likelihood.start(())
    model = likelihood.model
    branches = [index for index, name in enumerate(model.state_names) if "relaxation" in name]
    assert len(branches) == 8
    jacobian = casadi.jacobian(model.rates, model.states)
    (slopes,) = casadi.substitute([jacobian], [model.states, model.inputs], [state, np.zeros(model.inputs.shape)])
    relaxing_rates = np.array(casadi.evalf(slopes))[branches] @ np.linalg.cholesky(covariance + 1e-18 * np.eye(22))
    lengths = np.sqrt(np.diag(covariance)[6:14])
    assert np.abs(relaxing_rates).max() < 1e-3 * lengths.min() / 0.4


def test_a_start_in_an_equilibrium_of_uncertain_numbers_is_as_uncertain_as_these_make_it() -> None:
    """Of rotation and lengths; to lengths a quarter of each tension is added."""
    robot, noise = underactuated_robot(), Noise(1e-4, 1.0, 1e-5, 1e-4, rotation=1e-4, start_rotation=1e-3)
    known = initial_covariance(robot, noise, 16)
    platform = replace(robot.platform, centre_of_mass_uncertainty=0.01)
    uncertain = replace(robot, platform=platform)
    added = (initial_covariance(uncertain, noise, 16) - known)[np.ix_([3, 4, 5, 12, 13, 14, 15], range(16))]
    slopes = equilibrium_slopes(uncertain)
    lengths = np.linalg.norm(np.subtract(robot.anchors, robot.platform.start), axis=1)
    stretches = 0.25 * static_tensions(robot) * lengths / [cable.modulus * cable.area for cable in robot.cables]
    expected = slopes @ slopes.T + np.diag([0.0, 0.0, 0.0, *stretches**2])
    assert added[:, [3, 4, 5, 12, 13, 14, 15]] == pytest.approx(expected, abs=1e-15)
    assert not np.any(added[:, [0, 1, 2, *range(6, 12)]])


@pytest.mark.validate
def test_pretension_is_uncertain_where_no_tension_is_measured_or_the_file_says_so() -> None:
    assert self_stress_deviation(EIGHT, (recorded("eight", 1),)) == (0.0, ())
    unseen, notes = self_stress_deviation(EIGHT, (blind("eight"),))
    assert unseen == pytest.approx(0.25 * np.mean(static_tensions(EIGHT)))
    assert "no tension is measured" in notes[0]
    assert EIGHT.tension is not None
    told = replace(EIGHT, tension=replace(EIGHT.tension, preferred_uncertainty=12.0))
    assert self_stress_deviation(told, (recorded("eight", 1),))[0] == 12.0
    assert self_stress_deviation(replace(told, tension=replace(EIGHT.tension, preferred_uncertainty=0.0)), ())[0] == 0.0


def test_a_robot_file_may_tell_how_uncertain_its_pretension_is(tmp_path: Path) -> None:
    assert EIGHT.tension is not None
    told = replace(EIGHT, tension=replace(EIGHT.tension, preferred_uncertainty=12.0))
    write_robot(told, tmp_path / "robot.toml")
    assert read_robot(tmp_path / "robot.toml") == told
    assert "preferred_uncertainty" not in robot_text(EIGHT)


def test_a_release_begins_with_its_velocity_and_tensions() -> None:
    release = InitialState((0.1, -0.2, 0.3), (10.0, -5.0, 2.0))
    model = symbolic_model(replace(THREE, initial_state=release))
    start = np.array(casadi.Function("start", [], [model.start])()["o0"]).ravel()
    assert start[3:6] == pytest.approx(release.velocity)
    still = start.copy()
    still[3:6] = 0.0
    tensions = casadi.Function("tensions", [model.states, model.inputs], [model.span_tensions])(still, np.zeros(6))
    assert np.array(tensions).ravel() == pytest.approx(static_tensions(THREE) + release.tensions)
