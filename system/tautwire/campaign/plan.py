"""What a plan asks for: which numbers vary and how, which paths and controllers, what is computed of each run."""

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
    """A number of the robot file, by the path of its key, that differs from run to run."""

    key: str
    distribution: Distribution


@dataclass(frozen=True)
class Correlation:
    """Two inputs, by their places, and the correlation of the normal variables that they are made of."""

    first: int
    second: int
    value: float


@dataclass(frozen=True)
class PathPlan:
    """A path: ``kind`` is "line", "helix" or "recording"; ``numbers`` are those of its kind in SI units.

    ``start`` is where a line starts, None for the robot's start; ``recording`` is a file of winch speeds, and
    ``digest`` tells what is in it.
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
    """What is computed of each run beside its motion.

    ``step`` is the longest macro step (s), ``settle`` how long runs go on after a path (s), ``series`` how many points
    of each motion are kept; ``noise`` lets controllers see through noisy sensors.
    """

    statics: bool = True
    modes: bool = True
    step: float = 0.01
    settle: float = 1.0
    series: int = 100
    noise: bool = False


@dataclass(frozen=True)
class TracePlan:
    """Recordings to be traced, in the order of their names; ``digests`` tell what is in them."""

    recordings: tuple[str, ...]
    digests: tuple[str, ...]
    alpha: float = 0.01


@dataclass(frozen=True)
class Plan:
    """A campaign: ``content`` is the robot file's, ``file`` where it stands; each of ``count`` samples has all inputs.

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
        """Each path, by its place, with each controller; one without a path where there are none."""
        if not self.paths:
            return ((-1, ""),)
        return tuple((place, name) for place in range(len(self.paths)) for name in self.controllers)

    @property
    def keys(self) -> tuple[str, ...]:
        """The inputs' keys."""
        return tuple(each.key for each in self.inputs)

    def digest(self) -> str:
        """What tells plans apart that make other rows; where files stand does not count, what is in them does."""
        told = asdict(self)
        for name in ("file", "notes"):
            del told[name]
        for path in told["paths"]:
            del path["recording"]
        if self.trace is not None:
            told["trace"]["recordings"] = [Path(each).name for each in self.trace.recordings]
        return hashlib.sha256(json.dumps([told, __version__], sort_keys=True, default=str).encode()).hexdigest()[:12]
