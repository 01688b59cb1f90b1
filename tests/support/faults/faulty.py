"""A winch that hangs, or takes its process down, where the environment says so; made by plain pythonfmu."""

import ctypes
import faulthandler
import os
import subprocess
import sys

from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Status

# pythonfmu 0.7.0 gives up a reference to these globals that it does not own, at every instantiation.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))


def hang():
    """Blocks in C with the interpreter's lock held, so that no other Python thread runs."""
    ctypes.PyDLL(None).sleep(3600)


def spin():
    while True:
        pass


def crash():
    faulthandler.disable()
    ctypes.string_at(0)


def abort():
    faulthandler.disable()
    os.abort()


def leave():
    os._exit(3)


def hang_beside_a_tool():
    tell(subprocess.Popen([sys.executable, "-c", "import time; time.sleep(3600)"]).pid)
    hang()


def tell(number):
    place = os.environ.get("TAUTWIRE_TEST_NUMBERS")
    if place:
        with open(place, "a") as file:
            file.write(f"{number}\n")


class Faulty(Fmi2Slave):
    """The rope follows the speed asked for at once."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.speed_command, self.speed_command_rate = 0.0, 0.0
        self.register_variable(Real("speed_command", causality=Fmi2Causality.input))
        self.register_variable(Real("speed_command_rate", causality=Fmi2Causality.input))
        shown = Real("winch_speed", causality=Fmi2Causality.output, getter=lambda: self.speed_command)
        self.register_variable(shown)
        tell(os.getpid())
        self.meet("instantiate")

    def meet(self, where, time=0.0):
        name, place, how, begin = os.environ.get("TAUTWIRE_TEST_FAULT", "nobody:nowhere:hang:0").split(":")
        if name == self.instance_name and place == where and time > float(begin) - 1e-9:
            globals()[how]()

    def setup_experiment(self, *times):
        self.meet("setup")

    def enter_initialization_mode(self):
        self.meet("enter")

    def exit_initialization_mode(self):
        self.meet("exit")

    def do_step(self, current_time, step_size):
        if current_time < 0.01:
            self.log("it may get worse", Fmi2Status.warning)
        self.meet("step", current_time)
        return True
