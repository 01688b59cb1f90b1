"""Every slave, imported together.

FMUs of one build share this package within a process; one that came later could not import its module from the
folder of the first, which may be gone by then.
"""

from .cable import Cable
from .controller import Controller
from .point_mass import PointMass
from .winch import Winch

__all__ = ["Cable", "Controller", "PointMass", "Winch"]
