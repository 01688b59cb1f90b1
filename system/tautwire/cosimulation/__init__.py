"""Co-simulation master: implicit coupling of FMI 2.0 and 3.0 FMUs, and of a robot's FMUs in particular."""

from ..fmus.component import Component, ComponentError
from ..fmus.fmu_variables import Port
from .call_journal import CallJournal, JournalledComponent
from .connections import Connection, PowerBond, Wiring, WiringError
from .coupling_graph import CouplingGraph, build_coupling_graph
from .coupling_solver import CouplingSolver, SolverOptions
from .isolation import CALL_TIMEOUT, CallAbortedError, RunAbortedError, simulate_isolated
from .run_statistics import RunStatistics
from .step_size_control import AdaptiveStep, FixedStep, StepSizeControl, StepSizeError
from .time_loop import (
    Experiment,
    InputSource,
    InputSourceError,
    MemoryRecorder,
    PiecewiseCubicInput,
    PiecewiseLinearInput,
    Progress,
    Recorder,
    simulate,
)

__all__ = [
    "CALL_TIMEOUT",
    "AdaptiveStep",
    "CallAbortedError",
    "CallJournal",
    "Component",
    "ComponentError",
    "Connection",
    "CouplingGraph",
    "CouplingSolver",
    "Experiment",
    "FixedStep",
    "InputSource",
    "InputSourceError",
    "JournalledComponent",
    "MemoryRecorder",
    "PiecewiseCubicInput",
    "PiecewiseLinearInput",
    "Port",
    "PowerBond",
    "Progress",
    "Recorder",
    "RunAbortedError",
    "RunStatistics",
    "SolverOptions",
    "StepSizeControl",
    "StepSizeError",
    "Wiring",
    "WiringError",
    "build_coupling_graph",
    "simulate",
    "simulate_isolated",
]
