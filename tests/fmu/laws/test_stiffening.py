"""The rope that stiffens, against its tangent modulus and against the rig."""

from pathlib import Path

import numpy as np
import pytest

from tautwire.robot.reference_simulation import integrate
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.schema import EffectSetting
from tautwire_fmu.laws.cable import LINEAR, CableConstants, CableInputs, CableState, cable_motion, cable_outputs, span
from tautwire_fmu.laws.effects import ALL, BY_NAME, UNLISTED, ActiveEffect
from tautwire_fmu.laws.mathematics import COMPLEX_STEP, REAL, Mathematics, rate_of, with_rate
from tests.rig import load_robot, make_recording
from tests.rig.program import SampledProgram
from tests.support.robots import EXAMPLES, example

STIFFENING = BY_NAME["stiffening"]
QUADRATIC = 100.0
MODULUS, AREA, LENGTH, TENSION = 1e11, 1e-5, 10.0, 500.0


def shown_tension(m: Mathematics, stretch: complex) -> complex:
    cable = CableConstants(LINEAR, (0.0, 0.0, LENGTH), MODULUS, AREA, 0.0, LENGTH, TENSION, (0.0, 0.0, 1.0), 9.81)
    effects = (ActiveEffect(STIFFENING, STIFFENING.values(quadratic=QUADRATIC)),)
    line = span(m, cable, CableInputs((0.0, 0.0, -stretch), (0.0, 0.0, 0.0), 0.0), effects)
    state = CableState(LENGTH, 0.0, ((),))
    return cable_outputs(m, cable, effects, state, cable_motion(m, cable, effects, state, line, 0.0)).tension


def test_the_static_start_keeps_its_tension() -> None:
    assert shown_tension(REAL, 0.0) == pytest.approx(TENSION, rel=1e-15)


@pytest.mark.parametrize("stretch", [-0.003, 0.0, 0.01])
def test_the_tangent_modulus_grows_with_the_strain_from_no_tension(stretch: float) -> None:
    length = LENGTH + stretch
    total_strain = stretch / length + TENSION / (MODULUS * AREA)
    tangent_modulus = rate_of(shown_tension(COMPLEX_STEP, with_rate(stretch, 1.0))) * length**2 / (AREA * LENGTH)
    assert tangent_modulus == pytest.approx(MODULUS * (1.0 + 2.0 * QUADRATIC * total_strain), rel=1e-9)


def test_a_rope_of_another_modulus_stiffens_from_that() -> None:
    values = {"modulus": {"modulus": 2.0 * MODULUS}, "stiffening": {"quadratic": QUADRATIC}}
    effects = tuple(ActiveEffect(BY_NAME[name], BY_NAME[name].values(**own)) for name, own in values.items())
    cable = CableConstants(LINEAR, (0.0, 0.0, LENGTH), MODULUS, AREA, 0.0, LENGTH, TENSION, (0.0, 0.0, 1.0), 9.81)
    line = span(REAL, cable, CableInputs((0.0, 0.0, -0.01), (0.0, 0.0, 0.0), 0.0), effects)
    state = CableState(LENGTH, 0.0, ((), ()))
    motion = cable_motion(REAL, cable, effects, state, line, 0.0)
    start, strain = TENSION / (2.0 * MODULUS * AREA), TENSION / (2.0 * MODULUS * AREA) + motion.strain
    expected = TENSION + 2.0 * MODULUS * AREA * (strain + QUADRATIC * strain**2 - start - QUADRATIC * start**2)
    assert cable_outputs(REAL, cable, effects, state, motion).tension == pytest.approx(expected, rel=1e-12)


def test_it_is_no_effect_of_the_list() -> None:
    assert STIFFENING in UNLISTED
    assert STIFFENING not in ALL


def test_a_robot_file_may_have_it(tmp_path: Path) -> None:
    robot = example("three").with_effect(EffectSetting("stiffening", {"quadratic": QUADRATIC}, (1, 3)))
    (tmp_path / "robot.toml").write_text(robot_text(robot), encoding="utf-8")
    assert read_robot(tmp_path / "robot.toml").effects == robot.effects


@pytest.mark.validate
def test_the_robot_follows_the_rigs() -> None:
    declared = load_robot(EXAMPLES / "three" / "robot.toml")
    times = np.arange(0.0, 4.01, 0.02)
    speeds = np.outer(np.sin(times) * np.minimum(times, 1.0), (0.2, -0.1, 0.15))
    hidden = {"unlisted_stiffening": {"quadratic": QUADRATIC, "cables": [1, 3]}}
    truth = make_recording(
        declared, hidden, SampledProgram(times, speeds), duration=4.0, rate=50.0, seed=0, noise=False
    )
    robot = example("three").with_effect(EffectSetting("stiffening", {"quadratic": QUADRATIC}, (1, 3)))
    run, plain = integrate(robot, times, speeds), integrate(example("three"), times, speeds)
    for columns, name in ((["x", "y", "z"], "position"), ([f"tension_{k}" for k in (1, 2, 3)], "tension")):
        recorded = truth[columns].to_numpy(dtype=float)
        errors = [np.max(np.abs(getattr(shown, name) - recorded)) for shown in (run, plain)]
        assert errors[0] < 1e-3 * errors[1]
