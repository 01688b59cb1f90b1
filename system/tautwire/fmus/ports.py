"""What an FMU shows: its variables with causality, unit and description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ..master.archive import description_of
from ..master.standard import kind_of
from ..master.units import unit_of

AXES = ("x", "y", "z")
SHOWN = ("input", "output", "parameter")


@dataclass(frozen=True)
class FmuPort:
    """A variable of an FMU in the words of FMI; ``unit`` and ``start`` are None where none is stated."""

    name: str
    causality: str
    variability: str
    type: str
    unit: str | None
    start: str | None
    description: str


def fmu_ports(path: Path) -> tuple[FmuPort, ...]:
    """The inputs, outputs and parameters of an FMU that can be read, in its own order."""
    variables = description_of(path).modelVariables
    return tuple(
        FmuPort(
            name=variable.name,
            causality=variable.causality,
            variability=variable.variability or "",
            type=kind_of(variable),
            unit=unit_of(variable),
            start=None if variable.start is None else str(variable.start),
            description=variable.description or "",
        )
        for variable in variables
        if variable.causality in SHOWN
    )


def vectors_together(ports: Sequence[FmuPort]) -> tuple[FmuPort, ...]:
    """The ports with those that are the axes of one vector as one, for people to read."""
    vectors: dict[str, list[FmuPort]] = {}
    for port in ports:
        stem, _, axis = port.name.rpartition(".")
        vectors.setdefault(stem if axis in AXES else port.name, []).append(port)
    return tuple(_vector(stem, parts) if len(parts) == len(AXES) else parts[0] for stem, parts in vectors.items())


def _vector(stem: str, parts: Sequence[FmuPort]) -> FmuPort:
    starts = [f"{float(part.start):g}" for part in parts if part.start is not None]
    return replace(
        parts[0],
        name=f"{stem}.x .y .z",
        start=", ".join(starts) if starts else None,
        description=parts[0].description.removesuffix(", x axis"),
    )
