"""Formulas in the FMUs, in memory and in the linear plant, against the rig's own equations of the same effects."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import build_fmus
from tautwire.linear import linearise
from tautwire.robot.reference_simulation import integrate
from tautwire.robot.schema import Formula, Robot
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.symbolic_model import FORMULA_INDEX, FreeParameter, symbolic_model
from tests.rig import Rig, SampledProgram
from tests.rig.record import outputs
from tests.support.effects import EXACT
from tests.support.fmus import in_hand
from tests.support.rig_robots import rig_of
from tests.support.robots import example, gentle_speeds

ROBOT = example("three")
AXIAL = ROBOT.cables[0].modulus * ROBOT.cables[0].area
RHYTHM = 2.0 * np.pi * 1.7
EVERYWHERE = ROBOT.cable_numbers
SAME: dict[str, tuple[dict[str, Any], tuple[Formula, ...]]] = {
    "sideways": ({"constant": 80.0}, (Formula("force_x", "-80*vy"), Formula("force_y", "80*vx"))),
    "shaker": (
        {"amplitude": [10.0, 5.0, 0.0], "frequency": 1.7},
        (Formula("force_x", f"10*sin({RHYTHM!r}*time)"), Formula("force_y", f"5*sin({RHYTHM!r}*time)")),
    ),
    "filling": ({"rate": 5.0}, (Formula("mass", "5*time"),)),
    "stiffening": ({"quadratic": 100.0}, (Formula("tension", f"{100.0 / AXIAL!r}*tension**2", EVERYWHERE),)),
    "wave": (
        {"amplitude": [20.0, 0.0, 10.0], "wavelength": 4.0},
        (Formula("force_x", f"20*sin({np.pi / 2!r}*x)"), Formula("force_z", f"10*sin({np.pi / 2!r}*x)")),
    ),
}


def with_formulas(robot: Robot, *formulas: Formula) -> Robot:
    return replace(robot, formulas=formulas)


def by_the_rig(name: str, time: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tensions and positions."""
    return outputs(Rig(rig_of(ROBOT), {f"unlisted_{name}": SAME[name][0]}, SampledProgram(time, speed)), time, EXACT)


@pytest.mark.validate(but=["sideways"])
@pytest.mark.parametrize("name", SAME)
def test_a_formula_in_the_fmus_is_the_effect_of_the_rig(name: str, tmp_path: Path) -> None:
    time, speed = gentle_speeds(ROBOT, 1.0, 0.02)
    motion = cosimulate(build_fmus(with_formulas(ROBOT, *SAME[name][1]), tmp_path), time, speed)
    tension, position = by_the_rig(name, time, speed)
    assert np.max(np.abs(motion.position - position)) < 1e-9
    assert np.max(np.abs(motion.tension - tension)) < 1e-4
    plain = integrate(ROBOT, time, speed)
    assert np.max(np.abs(plain.tension - tension)) > 1.0


@pytest.mark.parametrize("name", SAME)
def test_a_formula_in_memory_is_the_effect_of_the_rig(name: str) -> None:
    time, speed = gentle_speeds(ROBOT, 1.0, 0.02)
    run = integrate(with_formulas(ROBOT, *SAME[name][1]), time, speed)
    tension, position = by_the_rig(name, time, speed)
    assert np.max(np.abs(run.position - position)) < 1e-9
    assert np.max(np.abs(run.tension - tension)) < 1e-4


@pytest.mark.validate
def test_formulas_of_one_place_add_up(tmp_path: Path) -> None:
    time, speed = gentle_speeds(ROBOT, 0.3, 0.02)
    parts = with_formulas(ROBOT, Formula("tension", "3e4*strain", (1, 3)), Formula("tension", "20*travel", (3,)))
    whole = with_formulas(
        ROBOT, Formula("tension", "3e4*strain", (1,)), Formula("tension", "3e4*strain + 20*travel", (3,))
    )
    runs = [cosimulate(build_fmus(robot, tmp_path), time, speed) for robot in (parts, whole)]
    assert np.max(np.abs(runs[0].tension - runs[1].tension)) < 1e-9


def test_the_robot_rests_under_its_formulas_at_the_start(tmp_path: Path) -> None:
    pulled = Formula("tension", "0.3*tension + 5*length", EVERYWHERE)
    robot = with_formulas(ROBOT, pulled, Formula("force_z", "-50 + x"))
    motion = cosimulate(build_fmus(robot, tmp_path), np.linspace(0.0, 0.5, 11), np.zeros((11, 3)))
    assert np.max(np.abs(motion.position - motion.position[0])) < 1e-10
    assert np.sum(static_tensions(robot)) > np.sum(static_tensions(ROBOT))


def test_the_linear_plant_has_them() -> None:
    softer = with_formulas(ROBOT, Formula("tension", f"-{0.19 * AXIAL!r}*strain", EVERYWHERE))
    ratio = linearise(softer).modes.frequencies / linearise(ROBOT).modes.frequencies
    assert ratio == pytest.approx(0.9, abs=0.01)
    shaken = with_formulas(ROBOT, *SAME["shaker"][1])
    assert linearise(shaken).system.nstates == linearise(ROBOT).system.nstates


def test_the_time_of_all_formulas_is_one_state() -> None:
    timed = with_formulas(ROBOT, Formula("tension", "time + travel", EVERYWHERE), Formula("force_x", "time"))
    names = symbolic_model(timed).state_names
    assert names.count("formula.time") == 1
    assert [name for name in names if name.startswith("formula.travel")] == [f"formula.travel_{i}" for i in (1, 2, 3)]


def test_numbers_of_a_formula_may_stay_symbols() -> None:
    robot = with_formulas(ROBOT, Formula("force_x", "c1*vx + c1*c2", (), {"c1": 2.0, "c2": 0.5}))
    model = symbolic_model(robot, [FreeParameter(FORMULA_INDEX, "c2")])
    assert model.parameters.numel() == 1
    assert np.array_equal(static_tensions(robot), static_tensions(with_formulas(ROBOT, Formula("force_x", "1"))))


def test_an_fmu_with_a_formula_goes_back_to_saved_states(tmp_path: Path) -> None:
    fmus = build_fmus(with_formulas(ROBOT, Formula("force_x", "30*sin(9*time)*vx - 40*time")), tmp_path)
    with in_hand(fmus.platform) as hand:
        hand.run()
        hand.step(0.0, 0.01)
        state = hand.fmu.getFMUState()
        results = []
        for _ in range(2):
            hand.fmu.setFMUState(state)
            hand.step(0.01, 0.01)
            results.append(hand.get("position.x", "velocity.x", "acceleration.x", "effect.formula.time"))
        hand.fmu.freeFMUState(state)
    assert results[0] == results[1]
    assert results[0][3] == 0.02


def test_a_formula_without_a_value_stops_the_fmu_with_its_reason(tmp_path: Path) -> None:
    robot = with_formulas(ROBOT, Formula("force_x", "log(0.05 - time)"))
    with in_hand(build_fmus(robot, tmp_path).platform) as hand:
        hand.run()
        hand.step(0.0, 0.01)
        with pytest.raises(Exception, match="fmi2DoStep failed"):
            hand.step(0.01, 0.1)
