"""The linearised plant: a python-control state space with named signals, its modes and figures."""

from .black_box import BlackBoxPlant, PlantSignals, linearise_fmus, linearise_robot_fmus
from .linear_plant import LinearPlant, linearise, minimal, model_document, transfer_function
from .modes import Modes
from .modes_along_path import ModesAlong, modes_along
from .operating_point import OperatingPointError
from .plant_figures import bode_figure, modes_along_figure, pole_figure
from .pulse_experiments import IdentificationError

__all__ = [
    "BlackBoxPlant",
    "IdentificationError",
    "LinearPlant",
    "Modes",
    "ModesAlong",
    "OperatingPointError",
    "PlantSignals",
    "bode_figure",
    "linearise",
    "linearise_fmus",
    "linearise_robot_fmus",
    "minimal",
    "model_document",
    "modes_along",
    "modes_along_figure",
    "pole_figure",
    "transfer_function",
]
