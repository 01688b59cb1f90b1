"""A driver FMU: the ramps and their rates as outputs, for importers that cannot set inputs over time."""

import ctypes

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real
from ramps import winches

# pythonfmu 0.7.0 gives up a reference to a script's globals that it does not own.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))


class Driver(Fmi2Slave):
    """Shows the ramps at its time; ``lead`` (s) shifts them, for importers that pass values on early or late."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = 0.0
        self.lead = 0.0
        self.register_variable(Real("lead", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in winches(0.0):
            shown = Real(name, causality=Fmi2Causality.output, getter=lambda name=name: self.shown(name))
            self.register_variable(shown)

    def shown(self, name):
        """An output at the present time."""
        return winches(max(0.0, self.time + self.lead))[name]

    def do_step(self, current_time, step_size):
        self.time = current_time + step_size
        return True
