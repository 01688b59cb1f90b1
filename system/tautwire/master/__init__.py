"""The master: co-simulates any wired system of FMI 2.0 and 3.0 FMUs and keeps their coupling exact."""

from .audit import Account, Bond
from .component import Component, ComponentError
from .coupling import Coupling
from .journal import Journal
from .simulation import Kept, Progress, Recorder, Sampled, Source, simulate
from .stepping import AdaptiveStep, FixedStep, StepError, Stepping
from .watch import PATIENCE, LostError, RunLostError, simulate_watched
from .watched import WatchedComponent
from .wiring import Connection, Port, WiringError

__all__ = [
    "PATIENCE",
    "Account",
    "AdaptiveStep",
    "Bond",
    "Component",
    "ComponentError",
    "Connection",
    "Coupling",
    "FixedStep",
    "Journal",
    "Kept",
    "LostError",
    "Port",
    "Progress",
    "Recorder",
    "RunLostError",
    "Sampled",
    "Source",
    "StepError",
    "Stepping",
    "WatchedComponent",
    "WiringError",
    "simulate",
    "simulate_watched",
]
