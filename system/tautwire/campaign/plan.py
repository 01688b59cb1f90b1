"""The plan of a campaign: inputs and their distributions, paths, controllers, and what is computed of each run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from .. import __version__
from ..robots.robot import Point
from .distributions import Distribution

Method = Literal["sobol", "latin hypercube", "random", "saltelli", "grid"]
METHODS: tuple[Method, ...] = ("sobol", "latin hypercube", "random", "saltelli", "grid")
OPEN_LOOP = "none"
CONTROLLERS = (OPEN_LOOP, "feedforward", "lqg", "scheduled", "robust")
BELIEFS = ("declared", "varied")


@dataclass(frozen=True)
class Input:
    """An input of the campaign: a number of the robot file, by its key path, and its distribution over the runs."""

    key: str
    distribution: Distribution


@dataclass(frozen=True)
class Correlation:
    """Correlation of two inputs, by index, as that of the normal variables of a Gaussian copula."""

    first: int
    second: int
    value: float


@dataclass(frozen=True)
class PathPlan:
    """A path: ``kind`` is "line", "helix" or "recording"; ``numbers`` are those of its kind in SI units.

    ``start`` is where a line starts, None for the robot's start; ``recording`` is a file of winch speeds, and
    ``digest`` is that of its content.
    """

    name: str
    kind: Literal["line", "helix", "recording"]
    numbers: Mapping[str, float] = field(default_factory=dict)
    start: Point | None = None
    end: Point | None = None
    recording: str = ""
    digest: str = ""


@dataclass(frozen=True)
class Compute:
    """Outputs that are computed of each run, and settings of its co-simulation.

    ``step`` is the longest macro step (s), ``settle`` how long runs continue after a path (s), ``series`` how many
    points of each motion are stored; ``noise`` adds sensor noise to what controllers measure.
    """

    statics: bool = True
    modes: bool = True
    step: float = 0.01
    settle: float = 1.0
    series: int = 100
    noise: bool = False


@dataclass(frozen=True)
class TracePlan:
    """Recordings to trace, in the order of their names, with the ``digests`` of their contents."""

    recordings: tuple[str, ...]
    digests: tuple[str, ...]
    alpha: float = 0.01


@dataclass(frozen=True)
class Plan:
    """A campaign plan: ``content`` of the robot file ``file``; each of ``count`` samples has values of all inputs.

    With a ``trace`` each recording is a run, and nothing varies.
    """

    file: str
    content: Mapping[str, Any]
    seed: int = 0
    method: Method = "sobol"
    count: int = 1
    inputs: tuple[Input, ...] = ()
    correlations: tuple[Correlation, ...] = ()
    paths: tuple[PathPlan, ...] = ()
    controllers: tuple[str, ...] = (OPEN_LOOP,)
    belief: str = "declared"
    compute: Compute = Compute()
    trace: TracePlan | None = None
    notes: tuple[str, ...] = ()

    @property
    def variants(self) -> tuple[tuple[int, str], ...]:
        """Each path, by index, with each controller; a single one with index -1 where there are no paths."""
        if not self.paths:
            return ((-1, ""),)
        return tuple((place, name) for place in range(len(self.paths)) for name in self.controllers)

    @property
    def keys(self) -> tuple[str, ...]:
        """The inputs' keys."""
        return tuple(each.key for each in self.inputs)

    def digest(self) -> str:
        """Digest that differs between plans with different rows; contents of files count, their locations do not."""
        fields = asdict(self)
        for name in ("file", "notes"):
            del fields[name]
        for path in fields["paths"]:
            del path["recording"]
        if self.trace is not None:
            fields["trace"]["recordings"] = [Path(each).name for each in self.trace.recordings]
        return hashlib.sha256(json.dumps([fields, __version__], sort_keys=True, default=str).encode()).hexdigest()[:12]
