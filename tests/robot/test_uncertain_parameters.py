"""Declared numbers with a stated uncertainty: refitted under every hypothesis, and no effect within it."""

from __future__ import annotations

from dataclasses import replace
from math import dist
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from casadi import DM, Function

from tautwire.estimation import Trace, trace
from tautwire.recordings.recording import Recording
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.schema import Robot
from tautwire.robot.symbolic_model import symbolic_model
from tautwire.robot.uncertain_parameters import (
    is_surveyed,
    limited_perturbation,
    perturbed_robot,
    sensor_errors,
    uncertain_parameters,
)
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot
from tests.support.robots import example

STIFFER = {"modulus": {"modulus": 1.03 * 1.022e11}}
DAMPING = {"damping": {"damping": 9e8}}


def unsure(modulus: float = 0.0, damping: float = 0.0, mass: float = 0.0, tension: float = 0.0) -> Robot:
    """The three-cable robot with stated uncertainties."""
    robot = example("three")
    cables = tuple(replace(c, modulus_uncertainty=modulus, damping_uncertainty=damping) for c in robot.cables)
    sensors = replace(robot.sensors, tension_offset_uncertainty=tension)
    return replace(robot, cables=cables, sensors=sensors, platform=replace(robot.platform, mass_uncertainty=mass))


def traced(
    robot: Robot, effects: dict[str, Any], off: tuple[float, ...] = (0.0, 0.0, 0.0), samples: int = 401
) -> Trace:
    fit, check = (with_offsets(recorded("three", seed, effects).first(samples), off) for seed in (3, 53))
    return trace(robot, fit, check, lambda what, done: None)


def with_offsets(recording: Recording, off: tuple[float, ...]) -> Recording:
    return replace(recording, tension=recording.tension + np.array(off))


def test_a_robot_file_states_them_and_reads_back(tmp_path: Path) -> None:
    robot = unsure(2e9, 1e8, 3.0, 5.0)
    sensors = replace(robot.sensors, position_offset_uncertainty=1e-3, tension_gain_uncertainty=0.01)
    cables = tuple(replace(cable, anchor_uncertainty=0.002) for cable in robot.cables)
    robot = replace(robot, sensors=sensors, cables=cables)
    (tmp_path / "robot.toml").write_text(robot_text(robot), encoding="utf-8")
    assert read_robot(tmp_path / "robot.toml") == robot
    assert len(uncertain_parameters(robot)) == 1 + 3 * (2 + 3 + 2) + 3


def test_nothing_is_uncertain_that_is_not_stated() -> None:
    assert uncertain_parameters(example("three")) == ()


def test_numbers_move_by_their_own_standard_deviations() -> None:
    robot = unsure(modulus=2e9, mass=3.0, tension=5.0)
    numbers = uncertain_parameters(robot)
    moves = [float(place) for place in range(len(numbers))]
    by_label = {number.label: move for number, move in zip(numbers, moves, strict=True)}
    moved = perturbed_robot(robot, numbers, moves)
    assert moved.platform.mass == robot.platform.mass + 3.0 * by_label["mass"]
    assert moved.cables[1].modulus == robot.cables[1].modulus + 2e9 * by_label["modulus of cable 2"]
    assert moved.cables[1].damping == robot.cables[1].damping
    assert sensor_errors(numbers, moves, 3).offsets[3:] == tuple(
        5.0 * by_label[f"offset of tension {cable}"] for cable in (1, 2, 3)
    )


def test_constants_of_a_rigid_platform_move_by_theirs() -> None:
    robot = crane_robot()
    platform = replace(robot.platform, inertia_uncertainty=0.5, centre_of_mass_uncertainty=0.01)
    cables = (replace(robot.cables[0], attachment_uncertainty=0.002), *robot.cables[1:])
    robot = replace(robot, platform=platform, cables=cables)
    numbers = uncertain_parameters(robot)
    assert [number.label for number in numbers] == [
        *(f"principal moment {axis}" for axis in "xyz"),
        *(f"centre of mass {axis}" for axis in "xyz"),
        *(f"attachment {axis} of cable 1" for axis in "xyz"),
    ]
    moved = perturbed_robot(robot, numbers, [2.0, -1.0, 3.0, 1.0, 0.0, -2.0, 0.0, 4.0, 0.0])
    assert moved.platform.centre_of_mass == pytest.approx(np.add(platform.centre_of_mass, [0.01, 0.0, -0.02]))
    assert moved.cables[0].attachment == pytest.approx(np.add(robot.cables[0].attachment, [0.0, 0.008, 0.0]))
    assert moved.cables[1:] == robot.cables[1:]
    moments, axes = np.linalg.eigh(np.array(platform.inertia))
    nearest = np.argmax(np.abs(axes), axis=0)
    change = np.array([1.0, -0.5, 1.5])[nearest]
    assert np.array(moved.platform.inertia) == pytest.approx((axes * (moments + change)) @ axes.T, abs=1e-12)
    declared = [number.declared(robot) for number in numbers]
    assert declared[:3] == pytest.approx(moments[np.argsort(nearest)], rel=1e-12)
    assert declared[3:] == [*platform.centre_of_mass, *robot.cables[0].attachment]
    assert is_surveyed(robot)


def surveyed_roughly(anchor: float, gain: float) -> Robot:
    """The three-cable robot with uncertain exit points and load-cell gains."""
    robot = example("three")
    cables = tuple(replace(cable, anchor_uncertainty=anchor) for cable in robot.cables)
    return replace(robot, cables=cables, sensors=replace(robot.sensors, tension_gain_uncertainty=gain))


def test_anchors_move_by_coordinate_and_gains_about_one() -> None:
    robot = surveyed_roughly(0.004, 0.01)
    numbers = uncertain_parameters(robot)
    moves = [float(index) for index in range(len(numbers))]
    by_label = {number.label: move for number, move in zip(numbers, moves, strict=True)}
    moved = perturbed_robot(robot, numbers, moves)
    assert moved.cables[2].anchor == pytest.approx(
        [
            value + 0.004 * by_label[f"anchor {axis} of cable 3"]
            for axis, value in zip("xyz", robot.anchors[2], strict=True)
        ]
    )
    assert sensor_errors(numbers, moves, 3).gains == (
        *(1.0, 1.0, 1.0),
        *(1.0 + 0.01 * by_label[f"gain of tension {cable}"] for cable in (1, 2, 3)),
    )


def test_anchors_of_a_planar_robot_are_not_uncertain_across_its_plane() -> None:
    robot = example("three")
    cables = tuple(replace(c, anchor=(c.anchor[0], 0.5, c.anchor[2]), anchor_uncertainty=0.004) for c in robot.cables)
    x, _, z = robot.platform.start
    planar = replace(robot, platform=replace(robot.platform, start=(x, 0.5, z)), cables=cables)
    assert [each.axis for each in uncertain_parameters(planar)] == [0, 2] * 3


def test_a_robot_with_other_anchors_still_starts_in_equilibrium_at_its_reference_lengths() -> None:
    robot = surveyed_roughly(0.05, 0.01)
    numbers = uncertain_parameters(robot)
    model = symbolic_model(robot, (), numbers)
    start = np.array(Function("start", [], [model.start])()["o0"]).ravel()
    assert start[6:9] == pytest.approx([dist(anchor, robot.platform.start) for anchor in robot.anchors])
    start[-len(numbers) :] = np.random.default_rng(1).normal(size=len(numbers))
    of_state = Function("f", [model.states, model.inputs], [model.rates, model.outputs])
    rates, outputs = of_state(start, np.zeros(6))
    assert np.array(rates).ravel() == pytest.approx(np.zeros(len(start)), abs=1e-9)
    perturbations = limited_perturbation(start[-len(numbers) :], np.sqrt).tolist()
    moved = perturbed_robot(robot, numbers, perturbations)
    gains = sensor_errors(numbers, perturbations, 3).gains[3:]
    directions = np.array([np.subtract(anchor, robot.platform.start) for anchor in moved.anchors]).T
    tensions = np.linalg.solve(directions / np.linalg.norm(directions, axis=0), [0.0, 0.0, 9.81 * robot.platform.mass])
    assert np.array(outputs).ravel()[6:9] == pytest.approx(gains * tensions)


def test_they_are_states_that_never_move_and_start_as_declared() -> None:
    robot = unsure(modulus=2e9, mass=3.0, tension=5.0)
    numbers = uncertain_parameters(robot)
    plain, model = symbolic_model(robot), symbolic_model(robot, (), numbers)
    assert model.states.numel() == plain.states.numel() + len(numbers)
    assert model.rates[-len(numbers) :].is_zero()
    assert model.state_names[-len(numbers) :] == tuple(f"uncertain {number.label}" for number in numbers)
    assert np.array_equal(np.array(DM(model.start[: plain.states.numel()])), np.array(DM(plain.start)))


def test_the_limit_of_a_perturbation_has_no_kink() -> None:
    """A kink makes the filter's gain jump, and the likelihood with it: no fit finds a maximum among jumps."""
    states = np.linspace(-6.0, 6.0, 1201)
    slopes = np.diff(limited_perturbation(states, np.sqrt)) / np.diff(states)
    assert slopes[600] == pytest.approx(1.0, abs=1e-4)
    assert np.all(slopes > 0.1) and np.all(slopes < 1.0 + 1e-6)
    assert np.max(np.abs(np.diff(slopes))) < 0.01


@pytest.mark.validate
def test_beyond_three_standard_deviations_only_a_tenth_counts() -> None:
    states = np.array([-13.0, -8.0, -2.0, -1.0, 0.0, 0.1, 2.0, 8.0, 13.0])
    expected = [-4.0, -3.5, -2.0, -1.0, 0.0, 0.1, 2.0, 3.5, 4.0]
    assert limited_perturbation(states, np.sqrt) == pytest.approx(expected, abs=0.1)
    robot = unsure(mass=9.0)
    model = symbolic_model(robot, (), uncertain_parameters(robot))
    at_start = Function("start", [], [model.start])()["o0"]
    states = [DM(at_start) for _ in range(3)]
    states[1][-1], states[2][-1] = 3.0, 13.0
    outputs = Function("outputs", [model.states, model.inputs], [model.outputs])
    tensions = [float(outputs(state, 0.0)[6]) for state in states]
    # A heavier platform hangs in its equilibrium, too: its ropes carry more.
    masses = 300.0 + 9.0 * limited_perturbation(np.array([0.0, 3.0, 13.0]), np.sqrt)
    assert masses == pytest.approx([300.0, 327.0, 336.0], abs=3.0)
    assert tensions == pytest.approx([tensions[0] * mass / 300.0 for mass in masses.tolist()], rel=1e-9)


@pytest.mark.validate
def test_a_stiffness_within_what_is_stated_is_no_effect_and_is_put_right() -> None:
    found = traced(unsure(modulus=3e9), STIFFER)
    assert found.verdict == "none"
    for cable in found.robot_after.cables:
        assert cable.modulus == pytest.approx(1.03 * 1.022e11, abs=4.0 * cable.modulus_uncertainty)
        assert cable.modulus_uncertainty < 0.3 * 3e9
    assert any("modulus of cable 1 1.05" in note for note in found.notes)
    for comparison in found.comparisons:
        assert comparison.errors_after.tension_rms < 1.2 * found.noise_floor.tension_rms
        assert comparison.errors_after.tension_rms < comparison.errors_before.tension_rms


@pytest.mark.validate
def test_a_mass_within_what_is_stated_is_no_payload() -> None:
    found = traced(unsure(mass=3.0), {"payload": {"mass": 2.0}})
    assert found.verdict == "none"
    assert found.robot_after.platform.mass == pytest.approx(
        302.0, abs=4.0 * found.robot_after.platform.mass_uncertainty
    )
    assert found.robot_after.platform.mass_uncertainty < 0.3
    assert found.components.faulty_component == "nothing"


@pytest.mark.validate
def test_a_tracker_off_its_frame_is_no_anchor_elsewhere() -> None:
    robot = example("three")
    robot = replace(robot, sensors=replace(robot.sensors, position_offset_uncertainty=5e-3))
    fit, check = (recorded("three", seed, {}).first(401) for seed in (3, 53))
    off = np.array([4e-3, -3e-3, 2e-3])
    shifted = [replace(each, position=each.position + off) for each in (fit, check)]
    found = trace(robot, *shifted, lambda what, done: None)
    assert found.verdict == "none"
    assert found.components.faulty_component == "nothing"


@pytest.mark.validate
def test_an_effect_is_found_beside_load_cells_that_are_off_zero() -> None:
    off = (8.0, -5.0, 12.0)
    found = traced(unsure(tension=10.0), DAMPING, off)
    assert [effect.name for effect in found.effects] == ["damping"]
    assert found.effects[0].parameters["damping"].value == pytest.approx(9e8, rel=0.01)
    assert any("offset of tension 3 12" in note or "offset of tension 3 11.9" in note for note in found.notes)
    for comparison in found.comparisons:
        assert comparison.errors_after.tension_rms < 1.2 * found.noise_floor.tension_rms


def test_a_robot_is_surveyed_whose_exit_points_or_load_cells_are_known_to_some_accuracy() -> None:
    robot = example("three")
    cables = tuple(replace(cable, anchor_uncertainty=0.002) for cable in robot.cables)
    assert not is_surveyed(unsure(modulus=1e9, mass=1.0, tension=2.0))
    assert is_surveyed(replace(robot, cables=cables))
    assert is_surveyed(replace(robot, sensors=replace(robot.sensors, tension_gain_uncertainty=0.004)))
