"""Sampled controllers for path tracking, with limits, anti-windup and one sample of computing delay."""

from .closed_loop import (
    ClosedLoopOptions,
    RunOptions,
    build_controller_fmu,
    build_native_controller_fmu,
    controller_wires,
    cosimulate_closed_loop,
    cosimulate_with_controller,
    sample_times,
)
from .controller_fmu import ControllerFmuError
from .design import (
    POSITION_NOISE,
    TENSION_NOISE,
    ControlAim,
    Design,
    Feedforward,
    Knot,
    MarginError,
    StretchError,
    measurement_noise,
)
from .external_controller import ControllerError, fmu_controller, function_controller, state_space_controller
from .feedforward import Reference, elastic_reference, rigid_reference
from .gain_scheduling import ScheduledController, schedule_controller
from .hinf_loop_shaping import RobustAim, RobustController, design_robust, schedule_robust
from .input_shaping import ShapedTrajectory, Shaper, shape_along, shaped, shaper, shaper_for_modes
from .lqg import Controller, design_controller
from .path_controller import PathController
from .path_dynamics import path_tensions
from .sampled_plant import ramp_plant, sampled_plant
from .stability_margins import Margins, Range, margins_of, margins_over, robot_with, speed_controller

__all__ = [
    "POSITION_NOISE",
    "TENSION_NOISE",
    "ClosedLoopOptions",
    "ControlAim",
    "Controller",
    "ControllerError",
    "ControllerFmuError",
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
    "RunOptions",
    "ScheduledController",
    "ShapedTrajectory",
    "Shaper",
    "StretchError",
    "build_controller_fmu",
    "build_native_controller_fmu",
    "controller_wires",
    "cosimulate_closed_loop",
    "cosimulate_with_controller",
    "design_controller",
    "design_robust",
    "elastic_reference",
    "fmu_controller",
    "function_controller",
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
    "state_space_controller",
]
