"""Imports every slave together.

FMUs of one build share this package within a process. A later FMU could not import a further module from the folder of
the first, which may be deleted by then.
"""

from .cable_slave import Cable
from .controller_slave import Controller
from .point_mass_slave import PointMass
from .rigid_body_slave import RigidBody
from .winch_slave import Winch

__all__ = ["Cable", "Controller", "PointMass", "RigidBody", "Winch"]
