"""The inputs, outputs and parameters of any FMU, in the terms of FMI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ..robot.schema import AXES
from .fmi_binding import type_name
from .fmu_archive import read_model_description
from .variable_units import unit_of

LISTED_CAUSALITIES = ("input", "output", "parameter")


@dataclass(frozen=True)
class FmuPort:
    """Variable of an FMU in the terms of FMI; ``unit`` and ``start`` are None where none is stated."""

    name: str
    causality: str
    variability: str
    type: str
    unit: str | None
    start: str | None
    description: str


def fmu_ports(path: Path) -> tuple[FmuPort, ...]:
    """Inputs, outputs and parameters of a readable FMU, in its own order."""
    variables = read_model_description(path).modelVariables
    return tuple(
        FmuPort(
            name=variable.name,
            causality=variable.causality,
            variability=variable.variability or "",
            type=type_name(variable),
            unit=unit_of(variable),
            start=None if variable.start is None else str(variable.start),
            description=variable.description or "",
        )
        for variable in variables
        if variable.causality in LISTED_CAUSALITIES
    )


def group_vectors(ports: Sequence[FmuPort]) -> tuple[FmuPort, ...]:
    """Ports with the three axes of each vector merged into one, for display."""
    vectors: dict[str, list[FmuPort]] = {}
    for port in ports:
        stem, _, axis = port.name.rpartition(".")
        vectors.setdefault(stem if axis in AXES else port.name, []).append(port)
    return tuple(_vector_port(stem, parts) if len(parts) == len(AXES) else parts[0] for stem, parts in vectors.items())


def _vector_port(stem: str, parts: Sequence[FmuPort]) -> FmuPort:
    starts = [f"{float(part.start):g}" for part in parts if part.start is not None]
    return replace(
        parts[0],
        name=f"{stem}.x .y .z",
        start=", ".join(starts) if starts else None,
        description=parts[0].description.removesuffix(", x axis"),
    )
