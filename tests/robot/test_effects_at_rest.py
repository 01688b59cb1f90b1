"""Static start, symbols and robot files with every effect switched on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import casadi
import numpy as np
import pytest
from scipy.integrate import trapezoid

from tautwire.control import path_tensions
from tautwire.errors import RobotFileError, UnreachableError
from tautwire.linear import linearise
from tautwire.robot.cable_routes import cable_routes, unit_directions
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import PER_CABLE_COMPONENTS, EffectSetting, Platform, Robot
from tautwire.robot.static_equilibrium import static_forces, static_tensions
from tautwire.robot.symbolic_model import FreeParameter, SymbolicModel, symbolic_model
from tautwire.robot.trajectory import Line
from tautwire.robot.winch_speeds import ideal_winch_speeds
from tautwire_fmu.laws.effects import ALL, BY_NAME, Effect
from tautwire_fmu.laws.mathematics import REAL
from tests.rig import Rig, StillProgram
from tests.support.effect_cases import CASES, Case, same
from tests.support.effects import with_effects
from tests.support.rig_robots import rig_of
from tests.support.robots import example

DRIFTING = {"creep", "thermal"}
OF_ANY_PLATFORM = [effect for effect in ALL if not effect.needs_rigid_body]


def everything(*without: str) -> list[Case]:
    return list({case.name: case for case in CASES if case.name not in without}.values())


def rates_at_start(model: SymbolicModel) -> np.ndarray:
    rates = casadi.Function("rates", [model.states, model.inputs], [model.rates])
    start = casadi.Function("start", [], [model.start])()["o0"]
    return np.array(rates(start, 0.0)).ravel()


@pytest.mark.parametrize("name", ["three", "eight"])
@pytest.mark.parametrize("case", CASES, ids=str)
def test_start_tensions_are_those_of_the_rig(case: Case, name: str) -> None:
    robot = with_effects(example(name), case)
    rig = Rig(rig_of(example(name)), {case.name: case.for_rig()}, StillProgram(robot.cable_count))
    assert static_tensions(robot) == pytest.approx(rig.start_tension, rel=1e-9)
    assert unit_directions(robot) == pytest.approx(rig.start_direction.T, abs=1e-12)


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
@pytest.mark.parametrize("shape", [0.0, 1.0])
def test_with_all_of_them_the_start_is_an_equilibrium(name: str, shape: float) -> None:
    robot = with_effects(example(name), *everything(*DRIFTING, "sag"), same("sag", linear_density=0.3, catenary=shape))
    assert np.max(np.abs(rates_at_start(symbolic_model(robot))[:6])) < 1e-9
    wind = np.array([5.0 * 0.6125 * np.linalg.norm([2.0, 1.0, 0.5]) * v for v in (2.0, 1.0, 0.5)])
    mass = robot.platform.mass + 20.0
    assert static_forces(robot).sum(axis=0) + wind == pytest.approx([0.0, 0.0, mass * robot.gravity], abs=1e-8)


def test_time_moves_a_resting_robot_only_by_what_it_adds_in_the_rope() -> None:
    robot = with_effects(example("three"), same("thermal", rate=0.5))
    assert 0.0 < np.max(np.abs(rates_at_start(symbolic_model(robot))[3:6])) < 1e-3


def neutral_setting(robot: Robot, effect: Effect, begun: bool) -> EffectSetting:
    cables = robot.cable_numbers if effect.component in PER_CABLE_COMPONENTS else ()
    declared = {p.name: getattr(robot.cables[0], p.name) for p in effect.parameters if p.neutral is None}
    values = {p.name: p.start for p in effect.parameters} if begun else effect.completed_values(declared)
    return EffectSetting(effect.name, values, cables)


@pytest.mark.parametrize("begun", [False, True], ids=["neutral", "begun"])
@pytest.mark.parametrize("effect", OF_ANY_PLATFORM, ids=lambda e: e.name)
def test_every_slope_is_finite_at_rest_and_slack(effect: Effect, begun: bool) -> None:
    robot = example("three").with_effect(neutral_setting(example("three"), effect, begun))
    model = symbolic_model(robot, [FreeParameter(0, p.name) for p in effect.parameters])
    symbols = [model.states, model.inputs, model.parameters]
    shown = casadi.vertcat(model.rates, model.outputs, model.span_tensions, model.sensor_delays)
    slopes = casadi.Function("slopes", symbols, [shown, *(casadi.jacobian(shown, symbol) for symbol in symbols)])
    values = [robot.effects[0].values[p.name] for p in effect.parameters]
    start = casadi.Function("start", [model.parameters], [model.start, casadi.jacobian(model.start, model.parameters)])
    state, by_values = start(values)
    assert np.isfinite(np.array(by_values)).all()
    slack = np.array(state).ravel()
    slack[6:9] *= 1.01
    for at in (state, slack):
        assert all(np.isfinite(np.array(value)).all() for value in slopes(at, 0.0, values))


@pytest.mark.parametrize("effect", OF_ANY_PLATFORM, ids=lambda e: e.name)
def test_neutral_values_are_the_plain_model(effect: Effect) -> None:
    plain = example("three")
    model = symbolic_model(plain.with_effect(neutral_setting(plain, effect, False)))
    bare = symbolic_model(plain)
    point = np.array(casadi.Function("start", [], [bare.start])()["o0"]).ravel() * 1.001
    inputs = np.array([0.1, -0.2, 0.3, 1.0, 2.0, 3.0])
    results = []
    for m in (model, bare):
        shown = casadi.Function("shown", [m.states, m.inputs], [m.rates[:9], m.outputs, m.start[:9]])
        results.append(shown(np.append(point, np.zeros(m.states.numel() - 9)), inputs))
    assert all(np.array_equal(np.array(a), np.array(b)) for a, b in zip(*results, strict=True))
    assert model.states.numel() == 9 or effect.name == "creep"


def test_a_model_has_only_states_that_are_felt() -> None:
    robot = with_effects(example("three"), same("relaxation", 2, modulus=3e10), same("drum", radius_ratio=1.01))
    assert symbolic_model(robot).state_names[9:] == ("relaxation.strain_1_2",)
    free = symbolic_model(robot, [FreeParameter(1, "eccentricity")])
    assert free.state_names[9:] == ("drum.travel_1", "relaxation.strain_1_2", "drum.travel_2", "drum.travel_3")


def test_lags_and_drifts_are_distinguished() -> None:
    late = {"tension_delay": 0.02, "position_delay": 0.05}
    robot = with_effects(example("three"), Case("sensor_delay", {}, late, (2,)), same("creep", 1, compliance=1e-12))
    model = symbolic_model(robot)
    assert np.array(casadi.DM(model.sensor_delays)).ravel() == pytest.approx([0.05] * 3 + [0.0, 0.02, 0.0])
    assert [model.state_names[place] for place in model.drifting] == ["creep.strain_1", "creep.elapsed_1"]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_robot_with_it_can_be_linearised_elsewhere(case: Case) -> None:
    robot = with_effects(example("three"), case)
    at = np.array([29.5, 0.5, 7.0])
    plant = linearise(robot, at)
    assert plant.tensions == pytest.approx(static_tensions(robot, at))
    assert 0.5 < plant.modes.frequencies[0] < plant.modes.frequencies[2] < 2.0
    assert np.isfinite(np.asarray(plant.system.A)).all()


def test_a_platform_inside_a_pulley_has_no_rope() -> None:
    anchor = example("three").cables[0].anchor
    robot = with_effects(example("three"), same("pulley", radius=1.0))
    inside = (anchor[0] + 0.5, anchor[1], anchor[2] - 0.1)
    with pytest.raises(UnreachableError, match="cable 1 has no length there"):
        static_tensions(replace(robot, platform=Platform(300.0, inside)))


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_file_leaves_out_is_neutral(case: Case, tmp_path: Path) -> None:
    robot = with_effects(example("three"), case)
    path = tmp_path / "robot.toml"
    write_robot(robot, path)
    back = read_robot(path)
    assert back.effects[0].values == BY_NAME[case.name].completed_values(case.law)
    assert back.effects[0].cables == robot.effects[0].cables
    write_robot(back, path)
    assert read_robot(path) == back
    written = path.read_text().partition(f"effect.{case.name}]")[2]
    named = {line.partition(" = ")[0] for line in written.splitlines()[1:] if " = " in line} - {"cables"}
    assert named <= set(case.law)


def test_one_number_alone_switches_an_effect_on_and_none_does_not(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    bare = robot_text(example("three"))
    path.write_text(f"{bare}\n[effect.drum]\nradius_ratio = 1.01\n")
    assert read_robot(path).effects[0].values["slip"] == 0.0
    path.write_text(f"{bare}\n[effect.drum]\ncables = [2]\n")
    with pytest.raises(RobotFileError, match=r"effect\.drum: sets no parameter; give true over declared"):
        read_robot(path)


def test_an_effect_of_sensors_acts_on_named_load_cells_and_on_the_platform(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text(f"{robot_text(example('three'))}\n[effect.sensor_gain]\ntension_gain = 1.1\ncables = [2]\n")
    model = symbolic_model(read_robot(path))
    start = casadi.Function("start", [], [model.start])()["o0"]
    shown = casadi.Function("shown", [model.states, model.inputs], [model.outputs, model.span_tensions])
    outputs, spans = (np.array(value).ravel() for value in shown(start, 0.0))
    assert outputs[6:9] / spans == pytest.approx([1.0, 1.1, 1.0])


def test_winches_that_follow_a_path_know_where_the_ropes_run() -> None:
    robot = with_effects(example("three"), same("pulley", radius=0.3), same("anchor", 1, x=0.5))
    path = Line((28.86, 0.0, 5.0), (29.5, 0.5, 8.0), 4.0)
    times = np.linspace(0.0, 4.0, 2001)
    wound = trapezoid(ideal_winch_speeds(robot, path, times), times, axis=0)
    lengths = [[line.length for line in cable_routes(REAL, robot, place)] for place in (path.start, path.end)]
    assert wound == pytest.approx(np.array(lengths[0]) - lengths[1], abs=1e-6)


def test_tensions_along_a_path_begin_with_those_at_rest() -> None:
    robot = with_effects(example("eight"), *everything(*DRIFTING))
    path = Line(robot.platform.start, (5.0, 4.0, 3.0), 4.0)
    assert path_tensions(robot, path, np.array([0.0]))[0] == pytest.approx(static_tensions(robot), rel=1e-9)
