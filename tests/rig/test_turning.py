"""Platforms of the test rig that turn: conservation laws, closed forms, and the limit in which they are points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.rig import (
    EFFECTS,
    Rig,
    Robot,
    Run,
    StillProgram,
    crane,
    make_recording,
    paper_robot,
    pose_wander,
    simulate,
    swing,
)
from tests.rig.modes import frequencies_of
from tests.rig.record import Accuracy, readings
from tests.rig.robot import Body
from tests.rig.turning import cayley
from tests.rig.wander import natural_frequencies

ROBOTS = {"crane": crane, "swing": swing}
PUSH, SPIN = (0.3, -0.2, 0.1), (0.2, -0.3, 0.4)
# Effects of bodies with values that show, and values that mean nothing.
CASES: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
    ("payload", {"mass": 6.0, "x": 0.1, "y": -0.2, "z": 0.3}, {"mass": 0.0, "x": 0.1}),
    ("centre_of_mass", {"x": 0.02, "y": 0.01, "z": -0.03}, {}),
    ("attachment", {"x": 0.02, "y": 0.01, "z": -0.03, "cables": [2]}, {"cables": [2]}),
    ("inertia", {"factor_x": 1.4, "factor_y": 0.8, "factor_z": 1.2}, {}),
    ("rotational_drag", {"damping": 20.0}, {"damping": 0.0}),
    ("rotational_drag", {"damping": 20.0, "exponent": 2.0}, {"damping": 0.0, "exponent": 2.0}),
    ("transverse_damping", {"damping": 30.0}, {"damping": 0.0}),
    ("transverse_damping", {"damping": 30.0, "exponent": 2.0}, {"damping": 0.0, "exponent": 2.0}),
    ("drag", {"drag_area": 3.0, "wind": [2.0, 1.0, 0.0]}, {"drag_area": 0.0}),
    ("sag", {"linear_density": 0.1}, {"linear_density": 0.0}),
    ("pulley", {"radius": 0.05}, {"radius": 1e-9}),
]


def undamped(robot: Robot) -> Robot:
    return replace(robot, damping=np.zeros(robot.count))


def energies(run: Run) -> np.ndarray:
    """Kinetic, potential and strain energy with still winches and the logarithmic law, J."""
    robot, turning, rotation = run.rig.robot, run.rig.turning, run.rotation
    assert turning is not None and rotation is not None and run.turning is not None
    stretch = run.length * np.log(run.length / run.rig.start_length) - run.length + run.rig.start_length
    ropes = (run.rig.axial * stretch + run.rig.start_tension * (run.length - run.rig.start_length)).sum(axis=1)
    centre = rotation @ turning.body.centre
    velocity = run.velocity + np.cross(run.turning, centre)
    spin = np.einsum("kji,kj->ki", rotation, run.turning)
    kinetic = 0.5 * robot.mass * (velocity**2).sum(axis=1)
    kinetic += 0.5 * np.einsum("ki,ij,kj->k", spin, turning.body.inertia, spin)
    return kinetic + robot.mass * robot.gravity * (run.position + centre)[:, 2] + ropes


def swung(robot: Robot, effects: dict[str, Any], duration: float = 1.0) -> Run:
    """Free motion after a push and a twist, weak ones where no rope below keeps the others tight."""
    times, strength = np.linspace(0.0, duration, 21), 1.0 if robot.count == 8 else 0.1
    push, spin = strength * np.array(PUSH), strength * np.array(SPIN)
    return simulate(robot, effects, StillProgram(robot.count), times, velocity=push, turning=spin)


@pytest.mark.validate(but=["swing"])
@pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS)
def test_a_free_swing_keeps_its_energy(make: Callable[[], Robot]) -> None:
    found = energies(swung(undamped(make()), {}, 2.0))
    assert np.ptp(found) < 1e-6
    run = swung(undamped(make()), {})
    assert run.turning is not None and np.abs(run.turning - run.turning[0]).max() > 0.02
    assert run.tension.min() > 0.0


def test_a_free_body_turns_as_eulers_equations_say() -> None:
    loose = replace(undamped(crane()), modulus=np.full(8, 1e-9))
    rig = Rig(loose, {}, StillProgram(8))
    rig.start_tension, rig.weight = np.zeros(8), np.zeros(3)
    assert rig.turning is not None
    spin = np.array([1.0, -2.0, 0.5])
    inertia, state = rig.turning.body.inertia, rig.begin(np.zeros(3), rig.turning.start @ spin)
    # The origin moves about the centre of mass, which rests.
    state[3:6] = rig.turning.start @ np.cross(rig.turning.body.centre, spin)
    found = solve_ivp(rig.rates, (0.0, 0.8), state, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]

    def rates(time: float, body: np.ndarray) -> np.ndarray:
        rate = np.linalg.solve(inertia, np.cross(inertia @ body[:3], body[:3]))
        return np.concatenate([rate, (body[3:].reshape(3, 3) @ np.cross(np.eye(3), body[:3])).ravel()])

    start = np.concatenate([spin, rig.turning.start.ravel()])
    expected = solve_ivp(rates, (0.0, 0.8), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    gibbs, turning = found[rig.turning.part].reshape(2, 3)
    assert turning == pytest.approx(expected[:3], abs=1e-7)
    assert rig.turning.start @ cayley(gibbs) == pytest.approx(expected[3:].reshape(3, 3), abs=1e-7)
    centre = found[:3] + rig.turning.start @ cayley(gibbs) @ rig.turning.body.centre
    assert centre == pytest.approx(rig.turning.start @ rig.turning.body.centre, abs=1e-7)


@pytest.mark.validate(only=["sag+pulley+payload"])
@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"sag": {"linear_density": 0.3}, "pulley": {"radius": 0.15}, "payload": {"mass": 20.0}},
        {"drag": {"drag_area": 5.0}, "transverse_damping": {"damping": 40.0}, "friction": {"coefficient": 0.05}},
    ],
    ids=lambda effects: "+".join(effects) or "none",
)
def test_a_body_whose_ropes_hold_its_centre_of_mass_is_a_point(effects: dict[str, Any]) -> None:
    point = replace(paper_robot(), damping=np.full(3, 4e8))
    body = Body(np.diag([30.0, 20.0, 25.0]), np.zeros(3), np.zeros((3, 3)))
    times, push = np.linspace(0.0, 2.0, 21), (0.3, 0.2, -0.1)
    runs = [
        simulate(robot, effects, StillProgram(3), times, velocity=push, rtol=1e-12, atol=1e-13)
        for robot in (point, replace(point, body=body))
    ]
    assert runs[1].position == pytest.approx(runs[0].position, abs=1e-9)
    assert runs[1].tension == pytest.approx(runs[0].tension, rel=1e-9)
    assert runs[1].rotation == pytest.approx(np.tile(np.eye(3), (21, 1, 1)), abs=1e-12)
    assert frequencies_of(replace(point, body=body))[3:] == pytest.approx(natural_frequencies(point), rel=1e-6)


@pytest.mark.validate
@pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS)
@pytest.mark.parametrize(("name", "strong", "neutral"), CASES, ids=[f"{case[0]}-{len(case[1])}" for case in CASES])
def test_effects_of_bodies_show_and_vanish_and_rest_at_the_start(
    name: str, strong: dict[str, Any], neutral: dict[str, Any], make: Callable[[], Robot]
) -> None:
    plain, absent, present = (swung(make(), effects, 0.2) for effects in ({}, {name: neutral}, {name: strong}))
    assert absent.position == pytest.approx(plain.position, abs=1e-7)
    assert absent.rotation == pytest.approx(plain.rotation, abs=1e-7)
    assert present.rotation is not None and plain.rotation is not None
    assert max(np.ptp(present.position - plain.position), np.ptp(present.rotation - plain.rotation)) > 1e-5
    rig = Rig(make(), {name: strong}, StillProgram(make().count))
    assert np.abs(rig.evaluate(0.0, rig.begin()).rates[:6]).max() < 1e-6


def test_drag_takes_the_energy_that_it_should() -> None:
    robot, drag = undamped(swing()), 15.0
    run = simulate(
        robot,
        {"rotational_drag": {"damping": drag}},
        StillProgram(4),
        np.linspace(0.0, 1.0, 501),
        velocity=0.1 * np.array(PUSH),
        turning=0.1 * np.array(SPIN),
    )
    assert run.turning is not None
    power = drag * (run.turning**2).sum(axis=1)
    lost = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(run.time))
    assert energies(run)[0] - energies(run)[-1] == pytest.approx(lost, rel=1e-4)


def test_the_platform_hangs_in_the_nearest_orientation_in_equilibrium() -> None:
    robot = swing()
    rig = Rig(robot, {"centre_of_mass": {"x": 0.03, "y": -0.02}}, StillProgram(4))
    assert rig.turning is not None
    angle = Rotation.from_matrix(rig.turning.start).magnitude()
    assert 0.01 < angle < 0.5
    assert np.abs(rig.evaluate(0.0, rig.begin()).rates).max() < 1e-7
    # Of all orientations in equilibrium near it none is nearer to the declared one.
    for axis in np.eye(3):
        for sign in (-1.0, 1.0):
            aside = cayley(0.005 * sign * axis) @ rig.turning.start
            assert robot.body is not None
            other = Rig(
                replace(robot, body=replace(robot.body, orientation=aside)),
                {"centre_of_mass": {"x": 0.03, "y": -0.02}},
                StillProgram(4),
            )
            assert other.turning is not None
            assert Rotation.from_matrix(other.turning.start).magnitude() > angle - 1e-8


def test_what_is_not_for_a_kind_of_platform_is_refused() -> None:
    for name, values in (("unlisted_swing", {"mass": 1.0, "length": 1.0}), ("unlisted_filling", {"rate": 1.0})):
        with pytest.raises(ValueError, match="not for this kind"):
            Rig(crane(), {name: values}, StillProgram(8))
    for name in [name for name, effect in EFFECTS.items() if effect.of_bodies]:
        values = {"damping": 1.0} if name == "rotational_drag" else {}
        with pytest.raises(ValueError, match="not for this kind"):
            Rig(paper_robot(), {name: values}, StillProgram(3))


@pytest.mark.parametrize(("make", "tilt"), [(crane, 0.2), (swing, 0.0)])
def test_a_pose_program_reels_what_its_path_asks_for(make: Callable[[], Robot], tilt: float) -> None:
    program = pose_wander(make(), 1, 0.3, tilt)
    for time in (2.0, 11.0):
        slope = (program.travel(time + 1e-6) - program.travel(time - 1e-6)) / 2e-6
        assert program.speed(time) == pytest.approx(slope, abs=1e-8)
    assert np.array_equal(program.speed(0.0), np.zeros(make().count))
    assert np.ptp([program.pose(time)[0][3:] for time in range(60)]) == pytest.approx(tilt, abs=0.5 * tilt)


def test_stiff_ropes_follow_the_planned_pose() -> None:
    robot = crane()
    program = pose_wander(robot, 2, 0.2, 0.1, slow=(2.0, 4.0), shake=0.0)
    stiff = replace(robot, modulus=100.0 * robot.modulus, damping=100.0 * robot.damping)
    times = np.linspace(0.0, 0.6, 4)
    seen = readings(Rig(stiff, {}, program), times, Accuracy("Radau", 1e-5, 1e-7))
    assert robot.body is not None and seen.rotation is not None
    assert np.abs(program.pose(0.6)[0]).max() > 0.01
    for time, position, rotation in zip(times, seen.position, seen.rotation, strict=True):
        place = program.pose(float(time))[0]
        assert position - robot.start == pytest.approx(place[:3], abs=1e-3)
        assert rotation == pytest.approx(robot.body.orientation @ cayley(place[3:]), abs=2e-3)


def test_a_recording_has_the_orientation_with_its_noise() -> None:
    robot = replace(swing(), noise=replace(swing().noise, orientation=2e-3, position=1e-3))
    frame = make_recording(robot, {}, StillProgram(4), duration=4.0, rate=50.0, seed=1)
    columns = frame[["qx", "qy", "qz", "qw"]].to_numpy()
    turned = Rotation.from_quat(columns)
    start = Rig(robot, {}, StillProgram(4)).turning
    assert start is not None
    vectors = (turned * Rotation.from_matrix(start.start).inv()).as_rotvec()
    assert vectors.std(axis=0) == pytest.approx(2e-3, rel=0.2)
    assert np.abs(np.linalg.norm(columns, axis=1) - 1.0).max() < 1e-12
