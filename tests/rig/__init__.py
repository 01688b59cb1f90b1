"""An independent simulator of a point mass or a rigid body on cables; it shares no code with the project it checks."""

from tests.rig.drive import Drive
from tests.rig.effect import Effect
from tests.rig.mechanics import Rig
from tests.rig.pose_program import PoseProgram, pose_wander
from tests.rig.program import (
    PathProgram,
    Program,
    RampProgram,
    SampledProgram,
    StillProgram,
)
from tests.rig.record import Accuracy, make_recording, write_recording
from tests.rig.registry import EFFECTS
from tests.rig.robot import Noise, Robot, TensionLimits, load_robot, robot_from
from tests.rig.robots import crane, eight_robot, paper_robot, robot_of, swing, symmetric_robot, with_law
from tests.rig.solve import Run, simulate
from tests.rig.wander import wander

__all__ = [
    "EFFECTS",
    "Accuracy",
    "Drive",
    "Effect",
    "Noise",
    "PathProgram",
    "PoseProgram",
    "Program",
    "RampProgram",
    "Rig",
    "Robot",
    "Run",
    "SampledProgram",
    "StillProgram",
    "TensionLimits",
    "crane",
    "eight_robot",
    "load_robot",
    "make_recording",
    "paper_robot",
    "pose_wander",
    "robot_from",
    "robot_of",
    "simulate",
    "swing",
    "symmetric_robot",
    "wander",
    "with_law",
    "write_recording",
]
