"""Every effect in the co-simulated FMUs, at 10 ms, against the rig's own equations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.schema import Robot
from tests.rig import Rig, SampledProgram, wander
from tests.rig.record import outputs
from tests.support.effect_cases import CASES, PAIRS, Case, same
from tests.support.effects import EXACT, by_the_rig, with_effects
from tests.support.fmus import in_hand
from tests.support.rig_robots import rig_of
from tests.support.robots import example, gentle_speeds, with_damping

# Of the passage over one sample of a kink: strands that stick again, a drum that turns back.
BENT = {"hysteresis", "drum", "friction"}


def errors(motion: CosimulationResult, tension: np.ndarray, position: np.ndarray) -> tuple[float, float]:
    return float(np.max(np.abs(motion.position - position))), float(np.max(np.abs(motion.tension - tension)))


# One of a cable, one of the platform and one of a sensor; all others are tried by make validate.
QUICK = [next(case for case in CASES if case.name == name) for name in ("damping", "payload", "sensor_delay")]
OTHERS = [*((case,) for case in CASES if case not in QUICK), *PAIRS]


@pytest.mark.parametrize(
    "cases",
    [*((case,) for case in QUICK), *(pytest.param(cases, marks=pytest.mark.validate) for cases in OTHERS)],
    ids=lambda cases: "+".join(map(str, cases)),
)
def test_effects_in_the_fmus_are_those_of_the_rig(cases: tuple[Case, ...], tmp_path: Path) -> None:
    robot = example("three")
    time, speed = gentle_speeds(robot, 1.0, 0.02)
    motion = cosimulate(build_fmus(with_effects(robot, *cases), tmp_path), time, speed)
    position, tension = errors(motion, *by_the_rig(robot, time, speed, *cases))
    bent = any(case.name in BENT for case in cases)
    assert position < (5e-9 if bent else 1e-9)
    assert tension < (1e-3 if bent else 1e-4)


SHAKEN = ("relaxation", "hysteresis", "creep", "sag", "pulley", "friction", "tension_delay", "tension_time_constant")


@pytest.mark.validate
@pytest.mark.parametrize("name", SHAKEN)
def test_they_are_so_with_eight_cables_that_shake(name: str, tmp_path: Path) -> None:
    case = [case for case in CASES if name == case.name or name in case.law][-1]
    robot = with_damping(example("eight"), 1e8)
    plan = wander(rig_of(robot), seed=5, reach=0.5)
    time = np.linspace(0.0, 1.5, 151)
    speed = np.array([plan.speed(float(t)) for t in time])
    motion = cosimulate(build_fmus(with_effects(robot, case), tmp_path), time, speed)
    rig = Rig(rig_of(robot), {case.name: case.for_rig()}, SampledProgram(time, speed))
    position, tension = errors(motion, *outputs(rig, time, EXACT))
    assert position < (5e-8 if name in BENT else 1e-9)
    assert tension < (5e-3 if name in BENT else 1e-4)


@pytest.mark.validate
@pytest.mark.parametrize(
    "case", [same("relaxation", modulus=1e12, time=1e-3), same("hysteresis", force=50.0, yield_strain=1e-6)]
)
def test_fast_states_need_no_short_macro_steps(case: Case, tmp_path: Path) -> None:
    robot = example("three")
    time, speed = gentle_speeds(robot, 0.3, 0.02)
    motion = cosimulate(build_fmus(with_effects(robot, case), tmp_path), time, speed)
    position, tension = errors(motion, *by_the_rig(robot, time, speed, case))
    assert position < 1e-8
    assert tension < 1e-2


@pytest.mark.validate
def test_the_experiments_relative_tolerance_is_that_of_effects_states(tmp_path: Path) -> None:
    robot, case = example("three"), same("hysteresis", force=50.0, yield_strain=1e-6)
    time, speed = gentle_speeds(robot, 0.3, 0.02)
    fmus = build_fmus(with_effects(robot, case), tmp_path)
    exact = by_the_rig(robot, time, speed, case)
    own, tight, loose = (
        cosimulate(replace(fmus, relative_tolerance=tolerance), time, speed) for tolerance in (None, 1e-9, 1e-5)
    )
    assert np.array_equal(own.tension, tight.tension)
    assert errors(own, *exact)[1] < 0.2 * errors(loose, *exact)[1] < 0.02
    assert errors(loose, *exact)[0] < 1e-6


def at_rest(robot: Robot, folder: Path) -> CosimulationResult:
    time = np.linspace(0.0, 0.5, 11)
    return cosimulate(build_fmus(robot, folder), time, np.zeros((11, robot.cable_count)))


@pytest.mark.validate(but=["three"])
@pytest.mark.parametrize("name", ["three", "eight"])
def test_a_robot_at_rest_stays_there_whatever_acts_but_time(name: str, tmp_path: Path) -> None:
    robot = with_effects(example(name), *(c for c in CASES if c.name not in ("creep", "thermal")))
    motion = at_rest(robot, tmp_path)
    assert np.max(np.abs(motion.position - motion.position[0])) < 1e-10
    assert np.max(np.abs(motion.tension - motion.tension[0])) < 1e-5


@pytest.mark.validate
def test_neutral_values_run_as_the_plain_robot(tmp_path: Path) -> None:
    robot = example("three")
    time, speed = gentle_speeds(robot, 0.2, 0.02)
    plain = cosimulate(build_fmus(robot, tmp_path), time, speed)
    neutral = [same("pulley", radius=0.0), same("anchor", x=0.0), same("sag", linear_density=0.0)]
    neutral += [same("friction", coefficient=0.0), same("slack", softness=0.0), same("drag", drag_area=0.0)]
    neutral += [same("sensor_gain", tension_gain=1.0), same("sensor_delay", tension_delay=0.0)]
    neutral += [same("sensor_offset", tension_offset=0.0)]
    motion = cosimulate(build_fmus(with_effects(robot, *neutral), tmp_path), time, speed)
    assert np.array_equal(motion.tension, plain.tension)
    assert np.max(np.abs(motion.position - plain.position)) < 1e-14


def test_a_late_load_cell_goes_on_from_a_serialised_state(tmp_path: Path) -> None:
    robot = with_effects(example("three"), same("sensor_delay", tension_delay=0.023))
    path = build_fmus(robot, tmp_path).cables[0]

    def go_on(cable) -> list[float]:  # type: ignore[no-untyped-def]
        shown = []
        for k in range(4):
            cable.set(position__z=5.0 + 0.01 * k, winch_speed=0.1 * k)
            cable.step(0.02 + 0.01 * k, 0.01)
            shown += cable.get("tension", "tension_rate")
        return shown

    with in_hand(path) as cable:
        cable.set(winch_speed=0.3)
        cable.run()
        cable.step(0.0, 0.01)
        cable.step(0.01, 0.01)
        content = cable.fmu.serializeFMUstate(cable.fmu.getFMUstate())
        expected = go_on(cable)
    with in_hand(path) as other:
        other.run()
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(content))
        assert go_on(other) == expected
    assert expected[0] != expected[2]


@pytest.mark.validate
def test_a_sensor_of_position_is_shown_beside_the_true_one(tmp_path: Path) -> None:
    robot = with_effects(example("three"), same("sensor_gain", position_gain=1.5))
    with in_hand(build_fmus(robot, tmp_path).platform) as platform:
        platform.run()
        shown = platform.get("measured_position.x", "position.x")
        assert shown[0] == pytest.approx(1.5 * shown[1], rel=1e-15)
    with in_hand(build_fmus(example("three"), tmp_path).platform) as platform:
        assert "measured_position.x" not in platform.references


def test_load_cells_with_zeros_of_their_own_leave_the_platform_one_offset(tmp_path: Path) -> None:
    cells = [same("sensor_offset", k, tension_offset=4.0 * k) for k in (1, 2)]
    robot = with_effects(example("three"), *cells, same("sensor_offset", 3, position_offset_z=0.02))
    fmus = build_fmus(robot, tmp_path)
    assert validate_fmu(str(fmus.platform)) == []
    with in_hand(fmus.platform) as platform:
        platform.run()
        shown, true = platform.get("measured_position.z", "position.z")
        assert shown - true == pytest.approx(0.02, abs=1e-14)


@pytest.mark.validate
def test_nothing_is_wrong_with_fmus_that_have_every_effect(tmp_path: Path) -> None:
    fmus = build_fmus(with_effects(example("three"), *CASES), tmp_path)
    assert [validate_fmu(str(path)) for path in (*fmus.cables, fmus.platform)] == [[]] * 4


def test_an_fmu_starts_where_its_moved_anchor_says(tmp_path: Path) -> None:
    robot = with_effects(example("three"), same("anchor", 1, z=1.0))
    with in_hand(build_fmus(robot, tmp_path).cables[0]) as cable:
        cable.set(effect__anchor__z=0.0)
        assert cable.get("length") == cable.get("unstrained_length")
        anchor, start = np.array(robot.anchors[0]), np.array(robot.platform.start)
        assert cable.get("length")[0] == pytest.approx(float(np.linalg.norm(anchor - start)), rel=1e-15)


def test_gravity_of_a_cable_makes_its_weight(tmp_path: Path) -> None:
    robot = replace(with_effects(example("three"), same("sag", linear_density=0.2)), name="heavy")
    with in_hand(build_fmus(robot, tmp_path).cables[0]) as cable:
        before = cable.get("force.z")[0]
        cable.set(gravity=0.0)
        length = cable.get("length")[0]
        assert cable.get("force.z")[0] - before == pytest.approx(0.1 * robot.gravity * length, rel=1e-9)
