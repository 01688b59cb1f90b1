"""Co-simulation master: implicit coupling of FMI 2.0 and 3.0 FMUs, and of a robot's FMUs in particular."""

from .audit import PowerBond, RunStatistics
from .component import Component, ComponentError
from .coupling import Coupling
from .journal import CallJournal
from .simulation import InputSource, MemoryRecorder, PiecewiseLinearInput, Progress, Recorder, simulate
from .stepping import AdaptiveStep, FixedStep, StepSizeControl, StepSizeError
from .watch import CALL_TIMEOUT, CallAbortedError, RunAbortedError, simulate_isolated
from .watched import JournalledComponent
from .wiring import Connection, Port, WiringError

__all__ = [
    "CALL_TIMEOUT",
    "AdaptiveStep",
    "CallAbortedError",
    "CallJournal",
    "Component",
    "ComponentError",
    "Connection",
    "Coupling",
    "FixedStep",
    "InputSource",
    "JournalledComponent",
    "MemoryRecorder",
    "PiecewiseLinearInput",
    "Port",
    "PowerBond",
    "Progress",
    "Recorder",
    "RunAbortedError",
    "RunStatistics",
    "StepSizeControl",
    "StepSizeError",
    "WiringError",
    "simulate",
    "simulate_isolated",
]
