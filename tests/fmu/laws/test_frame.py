"""The frame that gives way, against two springs in series and against the rig."""

from pathlib import Path

import numpy as np
import pytest

from tautwire.robot.reference_simulation import integrate
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.schema import EffectSetting
from tautwire_fmu.laws.cable import (
    LINEAR,
    CableConstants,
    CableInputs,
    CableState,
    cable_motion,
    cable_outputs,
    span,
    start_state,
)
from tautwire_fmu.laws.effects import ALL, BY_NAME, UNLISTED, ActiveEffect
from tautwire_fmu.laws.mathematics import REAL
from tests.rig import load_robot, make_recording
from tests.rig.program import SampledProgram
from tests.support.robots import EXAMPLES, example

FRAME = BY_NAME["frame"]
COMPLIANCE = 1.0 / 3e6


def test_rope_and_frame_share_a_stretch_as_springs_in_series() -> None:
    cable = CableConstants(LINEAR, (0.0, 0.0, 10.0), 1e11, 1e-5, 0.0, 10.0, 500.0, (0.0, 0.0, 1.0), 9.81)
    effects = (ActiveEffect(FRAME, FRAME.values(compliance=COMPLIANCE)),)
    state = CableState(10.0, 0.0, ((),))
    line = span(REAL, cable, CableInputs((0.0, 0.0, -0.01), (0.0, 0.0, 0.0), 0.0), effects)
    shown = cable_outputs(REAL, cable, effects, state, cable_motion(REAL, cable, effects, state, line, 0.0))
    rope = 1e11 * 1e-5 / 10.01
    assert shown.tension - 500.0 == pytest.approx(0.01 / (1.0 / rope + COMPLIANCE), rel=1e-12)


def test_a_rope_that_relaxes_shares_by_its_long_term_modulus() -> None:
    cable = CableConstants(LINEAR, (0.0, 0.0, 10.0), 1e11, 1e-5, 0.0, 10.0, 500.0, (0.0, 0.0, 1.0), 9.81)
    relaxation = BY_NAME["relaxation"]
    added = {p.name: 5e10 if p.unit == "Pa" else 1.0 for p in relaxation.parameters}
    effects = (
        ActiveEffect(relaxation, relaxation.values(**added)),
        ActiveEffect(FRAME, FRAME.values(compliance=COMPLIANCE)),
    )
    start = start_state(cable, effects)
    line = span(REAL, cable, CableInputs((0.0, 0.0, -0.01), (0.0, 0.0, 0.0), 0.0), effects)
    motion = cable_motion(REAL, cable, effects, start, line, 0.0)
    share = 1.0 / (1.0 + COMPLIANCE * 1e11 * 1e-5 / 10.01)
    expected = 500.0 + (motion.elastic_tension - 500.0) * share
    assert cable_outputs(REAL, cable, effects, start, motion).tension == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("damping", [0.0, 2e8])
def test_a_rope_of_another_modulus_and_damping_shares_its_own_tension(damping: float) -> None:
    cable = CableConstants(LINEAR, (0.0, 0.0, 10.0), 1e11, 1e-5, 0.0, 10.0, 500.0, (0.0, 0.0, 1.0), 9.81)
    inputs = CableInputs((0.0, 0.0, -0.01), (0.0, 0.0, -0.05), 0.0)

    def tension(cable: CableConstants, **values: dict[str, float]) -> float:
        effects = tuple(ActiveEffect(BY_NAME[name], BY_NAME[name].values(**own)) for name, own in values.items())
        state = CableState(10.0, 0.0, ((),) * len(effects))
        line = span(REAL, cable, inputs, effects)
        return float(
            cable_outputs(REAL, cable, effects, state, cable_motion(REAL, cable, effects, state, line, 0.0)).tension
        )

    frame = {"compliance": COMPLIANCE}
    by_effects = tension(cable, modulus={"modulus": 1.5e11}, damping={"damping": damping}, frame=frame)
    declared = tension(cable._replace(modulus=1.5e11, damping=damping), frame=frame)
    assert by_effects == pytest.approx(declared, rel=1e-12)


def test_it_is_no_kind_of_the_list() -> None:
    assert FRAME in UNLISTED
    assert FRAME not in ALL


def test_a_robot_file_may_have_it(tmp_path: Path) -> None:
    robot = example("three").with_effect(EffectSetting("frame", {"compliance": COMPLIANCE}, (1, 3)))
    (tmp_path / "robot.toml").write_text(robot_text(robot), encoding="utf-8")
    assert read_robot(tmp_path / "robot.toml").effects == robot.effects


@pytest.mark.validate
def test_the_robot_follows_the_rigs_whose_exit_points_are_light_masses_on_springs() -> None:
    declared = load_robot(EXAMPLES / "three" / "robot.toml")
    times = np.arange(0.0, 4.01, 0.02)
    speeds = np.outer(np.sin(times) * np.minimum(times, 1.0), (0.2, -0.1, 0.15))
    effects = {"unlisted_frame": {"stiffness_constant": 3e6, "viscosity": 2e3, "mass": 2.0}}
    program = SampledProgram(times, speeds)
    frame = make_recording(declared, effects, program, duration=4.0, rate=50.0, seed=0, noise=False)
    robot = example("three").with_effect(EffectSetting("frame", {"compliance": COMPLIANCE}, (1, 2, 3)))
    run = integrate(robot, times, speeds)
    plain = integrate(example("three"), times, speeds)
    truth = frame[["x", "y", "z"]].to_numpy(dtype=float)
    assert np.max(np.abs(run.position - truth)) < 0.04 * np.max(np.abs(plain.position - truth))
