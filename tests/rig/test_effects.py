"""Each effect of the test rig against its own closed form or limit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.rig import (
    EFFECTS,
    RampProgram,
    Rig,
    Robot,
    Run,
    StillProgram,
    make_recording,
    paper_robot,
    simulate,
    symmetric_robot,
    with_law,
)
from tests.rig.effect import Moment

RAMP = RampProgram(np.array([0.3, 0.25, -0.25]), 1.0)
STILL = StillProgram(3)

# Name, parameters of noticeable size, parameters that do nothing.
CASES: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
    ("damping", {"damping": 2e9}, {"damping": 4e8}),
    ("modulus", {"modulus": 9e10, "cables": [2]}, {"modulus": 1.348e11}),
    ("payload", {"mass": 20.0}, {"mass": 0.0}),
    ("relaxation", {"modulus": [3e10, 1e10], "time": [0.5, 5.0]}, {"modulus": 0.0, "time": 1.0}),
    ("hysteresis", {"force": 60.0, "yield_strain": 1e-4}, {"force": 0.0, "yield_strain": 1e-4}),
    ("creep", {"compliance": 1e-12, "time": 5.0}, {"compliance": 0.0, "time": 5.0}),
    ("thermal", {"expansion": 1.2e-5, "rise": 10.0, "time": 20.0}, {"expansion": 1.2e-5}),
    ("sag", {"linear_density": 0.1}, {"linear_density": 0.0}),
    ("pulley", {"radius": 0.15}, {"radius": 1e-9}),
    ("anchor", {"x": 0.05, "z": -0.1, "cables": [1]}, {}),
    ("drum", {"radius_ratio": 1.01, "eccentricity": 0.01, "slip": 1e-6}, {}),
    ("friction", {"coefficient": 0.05}, {"coefficient": 0.0}),
    ("drag", {"drag_area": 5.0, "wind": [2.0, 1.0, 0.0]}, {"drag_area": 0.0}),
    ("slack", {"softness": 500.0}, {"softness": 1e-3}),
    ("transverse_damping", {"damping": 100.0}, {"damping": 0.0}),
    ("sensor_delay", {"seconds": 0.02}, {"seconds": 0.0}),
    ("sensor_gain", {"gain": 1.02, "cables": [3]}, {"gain": 1.0}),
    ("sensor_offset", {"force": 20.0, "cables": [2]}, {"place": [0.0, 0.0, 0.0]}),
    ("sensor_offset", {"place": [0.0, 0.0, 0.01]}, {"force": 0.0}),
    ("damping", {"damping": 2e9, "exponent": 0.7}, {"damping": 4e8, "exponent": 0.7}),
    ("hysteresis", {"force": 60.0, "yield_strain": 1e-4, "beta": 0.6}, {"force": 0.0, "yield_strain": 1e-4}),
    ("creep", {"compliance": 1e-12, "time": 5.0, "form": "power"}, {"compliance": 0.0, "time": 5.0, "form": "power"}),
    ("thermal", {"expansion": 1.2e-5, "rise": 10.0, "form": "hyperbolic"}, {"expansion": 0.0, "form": "hyperbolic"}),
    ("sag", {"linear_density": 0.1, "form": "steep"}, {"linear_density": 0.0, "form": "steep"}),
    ("pulley", {"radius": 0.15, "tilt": 0.1}, {"radius": 1e-9, "tilt": 0.1}),
    ("drum", {"build_up": 0.01}, {"build_up": 0.0}),
    ("drum", {"second_harmonic": 0.02}, {"second_harmonic": 0.0}),
    ("friction", {"coefficient": 0.05, "form": "linear"}, {"coefficient": 0.0, "form": "linear"}),
    ("friction", {"coefficient": 0.05, "form": "stribeck"}, {"coefficient": 0.0, "form": "stribeck"}),
    ("drag", {"drag_area": 5.0, "exponent": 1.0}, {"drag_area": 0.0, "exponent": 1.0}),
    ("slack", {"softness": 500.0, "form": "root"}, {"softness": 1e-3, "form": "root"}),
    ("sensor_delay", {"seconds": 0.02, "form": "lag"}, {"seconds": 1e-6, "form": "delay"}),
    ("sensor_delay", {"seconds": 0.02, "form": "lag", "order": 2}, {"seconds": 1e-6, "form": "delay"}),
    ("sensor_gain", {"gain": 1.0, "bend": 0.05}, {"gain": 1.0, "bend": 0.0}),
    (
        "unlisted_bungee",
        {"stiffness_constant": 20.0, "point": [28, 2, 0]},
        {"stiffness_constant": 0, "point": [0] * 3},
    ),
    ("unlisted_filling", {"rate": 0.5}, {"rate": 0.0}),
    (
        "unlisted_frame",
        {"stiffness_constant": 3e5, "viscosity": 2e3},
        {"stiffness_constant": 1e9, "viscosity": 1e6, "mass": 1e9},
    ),
    ("unlisted_gusts", {"amplitude": [[30, 0, 0]], "times": [1.0]}, {"amplitude": [[0, 0, 0]], "times": [1.0]}),
    ("unlisted_slipping", {"slip": 0.01, "times": [1.0]}, {"slip": 0.0, "times": [1.0]}),
    ("unlisted_magnet", {"strength": 500.0, "centre": [26, 1, 7]}, {"strength": 0.0, "centre": [0, 0, 0]}),
    (
        "unlisted_shaker",
        {"amplitude": [20, 0, 0], "frequency": 0.7},
        {"amplitude": [0] * 3, "frequency": 1.0},
    ),
    ("unlisted_sideways", {"constant": 200.0}, {"constant": 0.0}),
    ("unlisted_stiffening", {"quadratic": 100.0}, {"quadratic": 0.0}),
    ("unlisted_swing", {"mass": 20.0, "length": 2.0}, {"mass": 1e-9, "length": 2.0, "viscosity": 0.0}),
    (
        "unlisted_wave",
        {"amplitude": [30, 0, 10], "wavelength": 4.0},
        {"amplitude": [0] * 3, "wavelength": 4.0},
    ),
]
DRIFTING = {"creep", "thermal", "unlisted_filling", "unlisted_shaker"}


def damped() -> Robot:
    return replace(paper_robot(), damping=np.full(3, 4e8))


def recorded(effects: dict[str, Any]) -> np.ndarray:
    return make_recording(damped(), effects, RAMP, duration=5.0, rate=20.0, seed=0, noise=False).to_numpy()


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return recorded({})


def test_every_effect_of_the_rig_is_tried_here() -> None:
    of_points = {name for name, effect in EFFECTS.items() if not effect.of_bodies}
    assert {name for name, _, _ in CASES} | {"unlisted_pushing"} == of_points


@pytest.mark.validate
@pytest.mark.parametrize(("name", "strong", "neutral"), CASES, ids=[case[0] for case in CASES])
def test_neutral_parameters_change_nothing_and_strong_ones_do(
    name: str, strong: dict[str, Any], neutral: dict[str, Any], plain: np.ndarray
) -> None:
    assert np.allclose(recorded({name: neutral}), plain, rtol=1e-6, atol=1e-6)
    difference = np.abs(recorded({name: strong}) - plain)
    assert difference[:, 4:7].max() > 2.0 or difference[:, 7:].max() > 1e-3


@pytest.mark.parametrize(("name", "strong"), [(name, strong) for name, strong, _ in CASES if name not in DRIFTING])
def test_start_is_in_static_equilibrium_with_the_effect(name: str, strong: dict[str, Any]) -> None:
    rig = Rig(damped(), {name: strong}, STILL)
    moment = rig.evaluate(0.0, rig.begin())
    assert np.abs(moment.acceleration).max() < 1e-10
    assert moment.tension == pytest.approx(rig.start_tension, rel=1e-10)


def test_same_effect_acts_on_two_cables_with_two_settings() -> None:
    settings = [{"modulus": 9e10, "cables": [1]}, {"modulus": 8e10, "cables": [3]}]
    assert Rig(paper_robot(), {"modulus": settings}, STILL).robot.modulus == pytest.approx([9e10, 1.348e11, 8e10])


def test_a_power_of_one_is_the_damping_of_the_list() -> None:
    times = np.arange(0, 5, 0.1)
    one = simulate(damped(), {"damping": {"damping": 2e9, "exponent": 1.0 + 1e-9}}, RAMP, times)
    other = simulate(damped(), {"damping": {"damping": 2e9}}, RAMP, times)
    assert np.abs(one.position - other.position).max() < 1e-7


def test_a_slipping_rope_loses_what_it_slips_by() -> None:
    robot = with_law(damped(), "linear")
    run = simulate(robot, {"unlisted_slipping": {"slip": 0.01, "times": [1.0, 3.0], "cables": [2]}}, STILL, [0.0, 5.0])
    assert run.state[-1, 6:9] == pytest.approx([0.0, -0.02, 0.0], abs=1e-8)


def test_a_tilted_pulley_turns_the_way_round_with_it() -> None:
    tilt = 0.3
    turn = Rotation.from_rotvec([tilt, 0.0, 0.0]).as_matrix()
    robot = replace(symmetric_robot(), anchors=symmetric_robot().anchors @ turn.T)
    plain = Rig(symmetric_robot(), {"pulley": {"radius": 0.2}}, STILL)
    leant = Rig(robot, {"pulley": {"radius": 0.2, "tilt": tilt}}, STILL)
    assert leant.start_length == pytest.approx(plain.start_length, rel=1e-12)
    assert leant.start_direction == pytest.approx(plain.start_direction @ turn.T, abs=1e-12)


@pytest.mark.validate
def test_fast_relaxation_is_damping() -> None:
    times = np.arange(0, 5, 0.1)
    one = simulate(damped(), {"relaxation": {"modulus": 1e12, "time": 1e-3}}, RAMP, times)
    other = simulate(damped(), {"damping": {"damping": 1.4e9}}, RAMP, times)
    assert np.abs(one.position - other.position).max() < 2e-4
    assert np.abs(one.position - simulate(damped(), {}, RAMP, times).position).max() > 3e-3


def test_slow_relaxation_is_stiffness() -> None:
    times = np.arange(0, 5, 0.1)
    one = simulate(damped(), {"relaxation": {"modulus": 3e10, "time": 1e6}}, RAMP, times)
    other = simulate(damped(), {"modulus": {"modulus": 1.648e11}}, RAMP, times)
    assert np.abs(one.position - other.position).max() < 1e-6


def test_hysteresis_follows_the_strain_and_not_the_clock() -> None:
    rig = Rig(paper_robot(), {"hysteresis": {"force": 50.0, "yield_strain": 1e-3}}, STILL)
    hysteresis = rig.effects[0]

    def memory_after(rate: float, duration: float) -> np.ndarray:
        def slope(_: float, memory: np.ndarray) -> np.ndarray:
            moment = Moment()
            moment.state = np.concatenate([np.zeros(9), memory])
            moment.rates = np.zeros(12)
            moment.strain_rate = np.full(3, rate)
            moment.tension = np.zeros(3)
            hysteresis.viscous(moment)
            return moment.rates[9:]

        return solve_ivp(slope, (0, duration), np.zeros(3), rtol=1e-10, atol=1e-12).y[:, -1]

    assert memory_after(1e-3, 2.0) == pytest.approx(1 - np.exp(-2.0), rel=1e-8)
    assert memory_after(4e-3, 0.5) == pytest.approx(1 - np.exp(-2.0), rel=1e-8)


@pytest.mark.validate
def test_hysteresis_takes_energy_from_a_free_swing() -> None:
    kick = [0.0, 0.0, 0.3]
    effects = {"hysteresis": {"force": 60.0, "yield_strain": 1e-4}}
    times = np.arange(0, 20, 0.02)
    run = simulate(paper_robot(), effects, STILL, times, kick, method="RK45", rtol=1e-7, atol=1e-9)
    height = np.abs(run.position[:, 2] - 5.0)
    assert height[-200:].max() < 0.7 * height[:200].max()


def free_strain(run: Run) -> np.ndarray:
    """What of the strain carries no tension, by the logarithmic law of resting ropes."""
    carried = (run.tension - run.rig.start_tension) / run.rig.axial
    return (np.log(run.length / run.rig.start_length) - carried)[1:, 0]


def test_creep_lengthens_hanging_ropes_logarithmically() -> None:
    effects = {"creep": {"compliance": 2e-11, "time": 3.0}}
    robot = replace(symmetric_robot(), damping=np.full(3, 1e7))
    run = simulate(robot, effects, STILL, [0.0, 10.0, 60.0])
    stress = run.rig.start_tension[0] / robot.area[0]
    expected = 2e-11 * stress * np.log1p(np.array([10.0, 60.0]) / 3.0)
    assert free_strain(run) == pytest.approx(expected, rel=0.003)


def test_heat_lengthens_hanging_ropes() -> None:
    effects = {"thermal": {"expansion": 1e-5, "rise": 20.0, "time": 5.0}}
    robot = replace(symmetric_robot(), damping=np.full(3, 1e7))
    run = simulate(robot, effects, STILL, [0.0, 60.0])
    assert free_strain(run) == pytest.approx(2e-4, rel=1e-3)
    assert run.tension[-1] == pytest.approx(50 * 9.8 * run.length[-1] / (3 * (3 - run.position[-1, 2])), rel=1e-6)


def test_sagging_rope_has_the_stiffness_of_ernst() -> None:
    density = 0.4
    rig = Rig(paper_robot(), {"sag": {"linear_density": density}}, STILL)
    along = rig.start_direction
    steps = []
    for sign in (-1, 1):
        state = rig.begin()
        state[0:3] = -sign * 1e-5 * along[0]
        steps.append(rig.evaluate(0.0, state).tension[0])
    axial, tension = rig.axial[0], rig.start_tension[0]
    pull = (density * 9.8 * rig.start_length[0] * np.hypot(along[0, 0], along[0, 1])) ** 2 * axial
    ernst = axial / rig.start_length[0] / (1 + pull / (12 * tension**3))
    assert ernst < 0.9 * axial / rig.start_length[0]
    assert (steps[1] - steps[0]) / 2e-5 == pytest.approx(ernst, rel=2e-3)


def test_sagging_ropes_hang_half_on_the_platform_and_half_on_the_exits() -> None:
    rig = Rig(paper_robot(), {"sag": {"linear_density": 0.1}}, STILL)
    moment = rig.evaluate(0.0, rig.begin())
    half = 0.05 * 9.8 * moment.chord
    carried = 300 * 9.8 + half.sum()
    assert (rig.start_tension @ rig.start_direction)[2] == pytest.approx(carried, rel=1e-9)
    top = moment.tension[:, None] * moment.direction + half[:, None] * [0, 0, 1]
    assert moment.cell == pytest.approx(np.linalg.norm(top, axis=1))


def test_pulley_straight_above_the_drop_has_half_a_turn_of_rope() -> None:
    radius = 0.2
    robot = replace(symmetric_robot(), start=np.array([4.0 - 2 * radius, 0.0, 0.0]))
    rig = Rig(symmetric_robot(), {"pulley": {"radius": radius}}, STILL)
    state = rig.begin()
    state[0:3] = robot.start
    moment = rig.evaluate(0.0, state)
    assert moment.length[0] == pytest.approx(3.0 + np.pi * radius)
    assert moment.direction[0] == pytest.approx([0, 0, 1], abs=1e-12)


def test_pulley_length_changes_along_the_rope() -> None:
    rig = Rig(paper_robot(), {"pulley": {"radius": 0.3}}, STILL)
    state = rig.begin()
    for axis in range(3):
        lengths = []
        for sign in (-1, 1):
            moved = state.copy()
            moved[axis] += sign * 1e-4
            lengths.append(rig.evaluate(0.0, moved).length)
        slope = (lengths[1] - lengths[0]) / 2e-4
        assert slope == pytest.approx(-rig.start_direction[:, axis], abs=1e-7)


def test_moved_anchor_moves_the_start_length() -> None:
    rig = Rig(paper_robot(), {"anchor": {"x": 0.5, "y": -1.0, "z": 2.0, "cables": [2]}}, STILL)
    assert rig.start_length[1] == pytest.approx(np.linalg.norm([0.5 - 28.86, -51.0, 47.0]))
    assert rig.start_length[0] == pytest.approx(np.linalg.norm([28.86, 50.0, 45.0]))


def test_eccentric_drum_winds_what_its_angle_says() -> None:
    effects = {"drum": {"radius_ratio": 1.02, "eccentricity": 0.05, "phase": 0.4, "radius": 0.15}}
    run = simulate(with_law(damped(), "linear"), effects, RAMP, [0.0, 5.0])
    travel = RAMP.travel(5.0)
    wave = 0.05 * 0.15 * (np.sin(travel / 0.15 + 0.4) - np.sin(0.4))
    assert run.state[-1, 6:9] == pytest.approx(1.02 * (travel + wave), abs=1e-7)


def test_slip_pays_rope_out_in_both_directions() -> None:
    program = RampProgram(np.array([0.3, -0.3, 0.0]), 0.5)
    slipping = simulate(with_law(damped(), "linear"), {"drum": {"slip": 1e-6}}, program, [0.0, 4.0])
    lost = program.travel(4.0) - slipping.state[-1, 6:9]
    assert lost[:2] == pytest.approx(1e-6 * 1600 * np.abs(program.travel(4.0)[:2]), rel=0.2)
    assert lost[2] == pytest.approx(0.0, abs=1e-12)


def test_friction_parts_load_cell_and_platform_by_the_capstan_factor() -> None:
    for law_at in ("span", "cell"):
        effects = {"friction": {"coefficient": 0.1, "wrap": 1.2, "law_at": law_at}}
        run = simulate(damped(), effects, RAMP, [0.0, 5.0])
        assert run.cell[-1] / run.pull[-1] == pytest.approx(np.exp(0.12 * np.array([1, 1, -1])))
        assert (run.cell if law_at == "cell" else run.pull)[-1] == pytest.approx(run.tension[-1])


def test_drag_brakes_by_the_square_of_the_air_speed() -> None:
    rig = Rig(damped(), {"drag": {"drag_area": 2.0, "wind": [1.0, 0.0, 0.0]}}, STILL)
    moving = rig.evaluate(0.0, rig.begin(np.array([-2.0, 4.0, 0.0])))
    plain = Rig(damped(), {}, STILL)
    pull = moving.force - (moving.pull @ moving.direction + plain.weight)
    assert pull == pytest.approx(-0.5 * 1.225 * 2.0 * 5.0 * np.array([-3.0, 4.0, 0.0]))


def test_slack_rope_carries_nothing_and_a_strut_would_push() -> None:
    fall = RampProgram(np.array([-4.0, 0.0, 0.0]), 2.0)
    times = np.arange(0, 4, 0.01)
    rope = simulate(damped(), {}, fall, times)
    strut = simulate(damped(), {"unlisted_pushing": {}}, fall, times)
    soft = simulate(damped(), {"slack": {"softness": 5.0}}, fall, times)
    assert rope.cell.min() == 0.0
    assert strut.cell.min() < -50.0
    assert 0.0 < soft.cell.min() < 1.0
