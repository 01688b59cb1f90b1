"""Imports every slave together.

FMUs of one build share this package within a process. A later FMU could not import a further module from the folder of
the first, which may be deleted by then.
"""

from .cable import Cable
from .controller import Controller
from .point_mass import PointMass
from .winch import Winch

__all__ = ["Cable", "Controller", "PointMass", "Winch"]
