"""What a master does without where an FMU cannot do it, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .component import Component
from .seat import STAMP
from .units import unit_of
from .wiring import Connection, Port

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fallback:
    """``lacks`` are sentences; ``estimated`` are outputs whose rates are estimated, with the units of these rates."""

    lacks: tuple[str, ...] = ()
    estimated: tuple[tuple[Port, str], ...] = ()

    def notes(self, doubts: Array) -> tuple[str, ...]:
        """One line for each shortcoming; ``doubts`` (number of rates,) is what the estimated rates may err by."""
        worst: dict[tuple[str, str], float] = {}
        names: dict[tuple[str, str], dict[str, None]] = {}
        for (port, unit), doubt in zip(self.estimated, doubts, strict=True):
            whole = port.variable.partition(".")[0], unit
            worst[whole] = max(worst.get(whole, 0.0), float(doubt))
            names.setdefault(whole, {})[port.component] = None
        rates = (
            f"no rate of {name}, so it is worked out from the past, off by about {doubt:.2g} {unit}: "
            f"FMU {', '.join(names[name, unit])}"
            for (name, unit), doubt in worst.items()
        )
        return (*self.lacks, *rates)


def fallback(
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    drives: Sequence[Port],
    rates: Sequence[Connection],
) -> Fallback:
    """What these FMUs lack of what a step of full order takes."""
    fed = {wire.target.component for wire in (*connections, *rates)} | {port.component for port in drives}
    holding = [name for name in components if name in fed and STAMP not in components[name].variables]
    fixed = [name for name, component in components.items() if not component.can_restore]
    lacks = []
    if holding:
        lacks.append(f"no {STAMP}, so inputs are held over each step at their mean: FMU {', '.join(holding)}")
    if fixed:
        lacks.append(f"no saved states, so no step is redone or cut at a kink: FMU {', '.join(fixed)}")
    targets = {wire.source: components[wire.target.component].variables[wire.target.variable] for wire in rates}
    return Fallback(tuple(lacks), tuple((port, unit_of(target) or "") for port, target in targets.items()))
