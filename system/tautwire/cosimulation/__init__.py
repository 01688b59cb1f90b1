"""Co-simulation master: implicit coupling of FMI 2.0 and 3.0 FMUs, and of a robot's FMUs in particular."""

from ..fmus.component import Component, ComponentError
from .call_journal import CallJournal, JournalledComponent
from .connections import Connection, Port, WiringError
from .coupling import Coupling
from .isolation import CALL_TIMEOUT, CallAbortedError, RunAbortedError, simulate_isolated
from .run_statistics import PowerBond, RunStatistics
from .step_size_control import AdaptiveStep, FixedStep, StepSizeControl, StepSizeError
from .time_loop import InputSource, MemoryRecorder, PiecewiseLinearInput, Progress, Recorder, simulate

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
