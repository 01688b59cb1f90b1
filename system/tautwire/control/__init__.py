"""Sampled controllers for path tracking, with limits, anti-windup and one sample of computing delay."""

from .aim import POSITION_NOISE, TENSION_NOISE, ControlAim, measurement_noise
from .closed_loop import (
    build_controller_fmu,
    controller_wires,
    cosimulate_closed_loop,
    cosimulate_with_controller,
    sample_times,
)
from .design import Design, Feedforward, Knot
from .errors import MarginError, StretchError
from .feedforward import elastic_reference
from .lqg import Controller, design_controller
from .margins import Margins, Range, margins_of, margins_over, robot_with, speed_controller
from .path import Reference, path_tensions, rigid_reference
from .plant import ramp_plant, sampled_plant
from .robust import RobustAim, RobustController, design_robust, schedule_robust
from .schedule import ScheduledController, schedule_controller
from .shaping import ShapedTrajectory, Shaper, shape_along, shaped, shaper, shaper_for_modes
from .source import PathController

__all__ = [
    "POSITION_NOISE",
    "TENSION_NOISE",
    "ControlAim",
    "Controller",
    "Design",
    "Feedforward",
    "Knot",
    "MarginError",
    "Margins",
    "PathController",
    "Range",
    "Reference",
    "RobustAim",
    "RobustController",
    "ScheduledController",
    "ShapedTrajectory",
    "Shaper",
    "StretchError",
    "build_controller_fmu",
    "controller_wires",
    "cosimulate_closed_loop",
    "cosimulate_with_controller",
    "design_controller",
    "design_robust",
    "elastic_reference",
    "margins_of",
    "margins_over",
    "measurement_noise",
    "path_tensions",
    "ramp_plant",
    "rigid_reference",
    "robot_with",
    "sample_times",
    "sampled_plant",
    "schedule_controller",
    "schedule_robust",
    "shape_along",
    "shaped",
    "shaper",
    "shaper_for_modes",
    "speed_controller",
]
