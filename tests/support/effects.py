"""Robots with effects, and what the rig says of them."""

from __future__ import annotations

import numpy as np

from tautwire.robot.schema import Robot
from tests.rig import Rig, SampledProgram
from tests.rig.record import Accuracy, outputs
from tests.support.effect_cases import Case
from tests.support.rig_robots import rig_of

EXACT = Accuracy("DOP853", 1e-11, 1e-12)


def with_effects(robot: Robot, *cases: Case) -> Robot:
    for case in cases:
        robot = robot.with_effect(case.setting(robot))
    return robot


def by_the_rig(robot: Robot, time: np.ndarray, speed: np.ndarray, *cases: Case) -> tuple[np.ndarray, np.ndarray]:
    """Tensions and positions as the sensors show them."""
    effects = {case.name: case.for_rig() for case in cases}
    return outputs(Rig(rig_of(robot), effects, SampledProgram(time, speed)), time, EXACT)
