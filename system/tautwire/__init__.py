"""Cable-driven parallel robots as FMI components, and a tracer that identifies what their model lacks.

These names are all that most programs need; each module is imported on first use. Arguments are validated: wrong ones
raise ``tautwire.errors.ArgumentError``; every exception raised on purpose is a ``TautwireError``.

========================== ========================================================================================
``read_robot``             reads the robot that a TOML file declares
``build_fmus``             builds its FMUs, for other tools and for our co-simulation master
``build_whole_fmu``        builds the whole robot as one FMU of machine code
``cosimulate``             co-simulates the FMUs over winch speeds; results as arrays or a pandas frame
``Line``                   a straight rest-to-rest trajectory
``ideal_winch_speeds``     inverse kinematics: the winch speeds of a trajectory for inelastic cables
``linearise``              linearises the robot to a python-control state space, with its modes
``bode_figure``            Bode diagram of one channel, as a matplotlib figure
``modes_along_figure``     the modes along a path as a figure; ``modes_along`` gives the numbers
``design_controller``      designs an LQG controller with integral action on the linear plant
``cosimulate_closed_loop`` co-simulates the FMUs in closed loop with a controller
``read_recording``         reads winch speeds and sensor measurements from CSV, Parquet, MDF, MATLAB or ROS
``recording_from_frame``   the same from a pandas frame
``trace``                  identifies what the model lacks, from recordings
``write_report``           writes the report, the extended robot file and its FMUs into a folder
========================== ========================================================================================
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .control import cosimulate_closed_loop, design_controller
    from .cosimulation.robot_cosimulation import cosimulate
    from .estimation import trace
    from .fmus.packaging import build_fmus, build_whole_fmu
    from .linear import bode_figure, linearise, modes_along, modes_along_figure
    from .recordings.recording import read_recording, recording_from_frame
    from .reports import write_report
    from .robot.robot_file_reader import read_robot
    from .robot.trajectory import Line
    from .robot.winch_speeds import ideal_winch_speeds
else:

    def __getattr__(name: str) -> Any:
        # Hidden from type checkers, to which any name would be one of ours.
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(_MODULES[name], __name__), name)


__version__ = "0.1.0"

__all__ = [
    "Line",
    "bode_figure",
    "build_fmus",
    "build_whole_fmu",
    "cosimulate",
    "cosimulate_closed_loop",
    "design_controller",
    "ideal_winch_speeds",
    "linearise",
    "modes_along",
    "modes_along_figure",
    "read_recording",
    "read_robot",
    "recording_from_frame",
    "trace",
    "write_report",
]

# CasADi and python-control take a second to import; reading a robot file needs none of them.
_MODULES = {
    "Line": ".robot.trajectory",
    "bode_figure": ".linear",
    "build_fmus": ".fmus.packaging",
    "build_whole_fmu": ".fmus.packaging",
    "cosimulate": ".cosimulation.robot_cosimulation",
    "cosimulate_closed_loop": ".control",
    "design_controller": ".control",
    "ideal_winch_speeds": ".robot.winch_speeds",
    "linearise": ".linear",
    "modes_along": ".linear",
    "modes_along_figure": ".linear",
    "read_recording": ".recordings.recording",
    "read_robot": ".robot.robot_file_reader",
    "recording_from_frame": ".recordings.recording",
    "trace": ".estimation",
    "write_report": ".reports",
}


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
