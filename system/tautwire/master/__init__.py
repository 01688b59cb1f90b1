"""The master: co-simulates any wired system of FMI 2.0 FMUs and keeps their coupling exact."""

from .audit import Account, Bond
from .component import Component, ComponentError
from .coupling import Coupling
from .simulation import Kept, Progress, Recorder, Sampled, Source, simulate
from .stepping import AdaptiveStep, FixedStep, StepError, Stepping
from .wiring import Connection, Port, WiringError

__all__ = [
    "Account",
    "AdaptiveStep",
    "Bond",
    "Component",
    "ComponentError",
    "Connection",
    "Coupling",
    "FixedStep",
    "Kept",
    "Port",
    "Progress",
    "Recorder",
    "Sampled",
    "Source",
    "StepError",
    "Stepping",
    "WiringError",
    "simulate",
]
