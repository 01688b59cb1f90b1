"""Variables of FMUs by name, and the inputs that tell an FMU the times of its other inputs."""

from __future__ import annotations

from dataclasses import dataclass

INPUT_TIME = "input_time"
MIDDLE_TIME = "middle_time"
MIDDLE_PREFIX = "middle_"


@dataclass(frozen=True, order=True)
class Port:
    """A variable of a component, both by name."""

    component: str
    variable: str

    def __str__(self) -> str:
        return f"{self.component}.{self.variable}"
