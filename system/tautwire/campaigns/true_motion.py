"""Motion of a run as it truly was, without what sensor effects make of its measurements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.mathematics import REAL

from ..cosimulation.robot_cosimulation import CosimulationResult
from ..fmus.packaging import RobotFmus
from ..robot.active_effects import cable_effects
from ..robot.measured_start import true_position
from ..robot.schema import Robot


def without_sensor_effects(robot: Robot) -> Robot:
    """The robot with sensors that show what is: where nothing is fed back it moves the same."""
    return replace(robot, effects=tuple(s for s in robot.effects if BY_NAME[s.name].component != "sensor"))


def without_gains_and_offsets(robot: Robot, fmus: RobotFmus, motion: CosimulationResult) -> CosimulationResult:
    """A motion with gains and offsets of its sensors undone; what they show late stays late.

    User FMUs have no sensor effects, so that theirs is true already.
    """
    tension = motion.tension.copy()
    for cable in robot.cable_numbers:
        if f"cable_{cable}" not in fmus.user_start_values:
            effects = cable_effects(robot, cable)
            gain, offset = (stage(REAL, effects)[0] for stage in (stages.sensor_gains, stages.sensor_offsets))
            tension[:, cable - 1] = (tension[:, cable - 1] - offset) / gain
    position = motion.position
    if fmus.has_position_sensor:
        position = np.column_stack(true_position(robot, tuple(position.T)))
    return replace(motion, position=position, tension=tension)
