"""The linearised plant: a python-control state space with named signals, its modes and figures."""

from .along import ModesAlong, modes_along
from .black_box import BlackBoxPlant, linearise_fmus
from .channels import minimal, transfer_function
from .document import model_document
from .experiments import IdentificationError
from .figures import bode_figure, modes_along_figure, pole_figure
from .modes import Modes
from .plant import LinearPlant, linearise
from .rest import OperatingPointError
from .robot_fmus import linearise_robot_fmus

__all__ = [
    "BlackBoxPlant",
    "IdentificationError",
    "LinearPlant",
    "Modes",
    "ModesAlong",
    "OperatingPointError",
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
