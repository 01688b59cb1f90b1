"""The master: co-simulates any wired system of FMI 2.0 FMUs and keeps their coupling exact."""

from .component import Component, ComponentError
from .coupling import Coupling
from .simulation import Progress, Sampled, Source, simulate
from .wiring import Connection, Port, WiringError

__all__ = [
    "Component",
    "ComponentError",
    "Connection",
    "Coupling",
    "Port",
    "Progress",
    "Sampled",
    "Source",
    "WiringError",
    "simulate",
]
