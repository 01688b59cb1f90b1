"""The plan of a campaign: inputs with their distributions, paths, controllers and outputs; errors of campaigns."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from .. import __version__
from ..errors import InputError, TautwireError
from ..robot.schema import Point, Quaternion

NORMAL, UNIFORM, TRIANGULAR, LOGNORMAL = "normal", "uniform", "triangular", "lognormal"
LIST, LINSPACE = "list", "linspace"
# Names of each distribution's parameters; a list has any number of values.
PARAMETER_NAMES: Mapping[str, tuple[str, ...]] = {
    NORMAL: ("mean", "standard deviation"),
    UNIFORM: ("least", "largest"),
    TRIANGULAR: ("least", "most probable", "largest"),
    LOGNORMAL: ("median", "standard deviation of the logarithm"),
    LINSPACE: ("first", "last", "count"),
}
DISTRIBUTION_KINDS = (*PARAMETER_NAMES, LIST)
Method = Literal["sobol", "latin hypercube", "random", "saltelli", "grid"]
METHODS: tuple[Method, ...] = ("sobol", "latin hypercube", "random", "saltelli", "grid")
OPEN_LOOP = "none"
CONTROLLERS = (OPEN_LOOP, "feedforward", "lqg", "scheduled", "robust")
BELIEFS = ("declared", "varied")


class PlanError(InputError):
    """A plan that cannot be read, or asks for something impossible."""


class PlanMismatchError(InputError):
    """The folder contains rows of another plan; ``stored_digest`` and ``plan_digest`` are the digests of both."""

    def __init__(self, folder: str, stored_digest: str, plan_digest: str) -> None:
        hint = "choose another --out, or restore the plan and the robot file"
        super().__init__(folder, f"contains rows of another plan ({stored_digest}, this one is {plan_digest})", hint)
        self.stored_digest = stored_digest
        self.plan_digest = plan_digest


class MissingExtraError(InputError):
    """A library that only campaigns need is not installed; ``library`` is its name."""

    def __init__(self, library: str) -> None:
        hint = 'run pip install "dask[distributed]" SALib'
        super().__init__("campaign", f"needs {library}, which is not installed", hint)
        self.library = library


class UnfinishedError(TautwireError):
    """A campaign that ended early: ``written_count`` of ``count`` rows are written, and the same command resumes."""

    def __init__(self, reason: str, written_count: int, count: int) -> None:
        super().__init__(f"{reason} after {written_count} of {count} runs; the same command resumes it")
        self.reason = reason
        self.written_count = written_count
        self.count = count


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Distribution:
    """A probability distribution: its ``kind``, one of :data:`DISTRIBUTION_KINDS`, and its parameters ``numbers``.

    They are in the order of :data:`PARAMETER_NAMES`; those of a list of ``texts`` are indices, from zero.
    """

    kind: str
    numbers: tuple[float, ...]
    texts: tuple[str, ...] = ()

    @property
    def discrete_values(self) -> tuple[float, ...]:
        """The values of a discrete distribution, a list or a linspace; empty for others."""
        if self.kind == LINSPACE:
            first, last, count = self.numbers
            return tuple(np.linspace(first, last, int(count)).tolist())
        return self.numbers if self.kind == LIST else ()

    @property
    def ends(self) -> tuple[float, ...]:
        """The least and the largest value of a bounded distribution; empty for others, and for texts."""
        values = () if self.texts else self.discrete_values
        if self.kind in (UNIFORM, TRIANGULAR):
            values = (self.numbers[0], self.numbers[-1])
        return (min(values), max(values)) if values else ()

    def value(self, number: float) -> float | str:
        """The value that a number encodes: the text of that index in a list of texts, else the number."""
        return self.texts[int(number)] if self.texts else number

    def quantile(self, probability: Array) -> Array:
        """Quantile function at probabilities (N,); discrete values are equally probable."""
        values = self.discrete_values
        if values:
            return np.array(values)[np.minimum((probability * len(values)).astype(int), len(values) - 1)]
        return np.asarray(_QUANTILE_FUNCTIONS[self.kind](probability, *self.numbers), dtype=float)


def _triangular_quantile(probability: Array, minimum: float, mode: float, maximum: float) -> Array:
    return np.asarray(stats.triang.ppf(probability, (mode - minimum) / (maximum - minimum), minimum, maximum - minimum))


_QUANTILE_FUNCTIONS: Mapping[str, Callable[..., Array]] = {
    NORMAL: lambda share, mean, deviation: np.asarray(stats.norm.ppf(share, mean, deviation)),
    UNIFORM: lambda share, least, largest: least + share * (largest - least),
    TRIANGULAR: _triangular_quantile,
    LOGNORMAL: lambda share, median, deviation: median * np.exp(stats.norm.ppf(share, 0.0, deviation)),
}


def parameter_problem(kind: str, numbers: Sequence[float]) -> str | None:
    """Problem that makes these parameters invalid for a distribution of this kind; None where they are valid."""
    names = PARAMETER_NAMES.get(kind)
    if names is not None and len(numbers) != len(names):
        return f"has {len(numbers)} numbers, {kind} takes {len(names)}: {', '.join(names)}"
    if kind == LIST:
        return None if numbers else "is empty, a list has one value or more"
    if kind == LINSPACE:
        return None if numbers[2] >= 1 and numbers[2] == int(numbers[2]) else f"has a count of {numbers[2]:g}"
    if kind in (NORMAL, LOGNORMAL) and not numbers[1] > 0.0:
        return f"has a standard deviation of {numbers[1]:g}, must be above 0"
    if kind == LOGNORMAL and not numbers[0] > 0.0:
        return f"has a median of {numbers[0]:g}, must be above 0"
    if kind in (UNIFORM, TRIANGULAR) and not numbers[0] < numbers[-1]:
        return f"goes from {numbers[0]:g} to {numbers[-1]:g}, must rise"
    if kind == TRIANGULAR and not numbers[0] <= numbers[1] <= numbers[2]:
        return f"has its most probable value {numbers[1]:g} outside {numbers[0]:g} to {numbers[2]:g}"
    return None


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

    ``start`` is where a line or a recording starts, None for the robot's start; so are the unit quaternions
    ``start_orientation`` and ``end_orientation``, None where the path does not turn. ``recording`` is a file of winch
    speeds, and ``digest`` is that of its content.
    """

    name: str
    kind: Literal["line", "helix", "recording"]
    numbers: Mapping[str, float] = field(default_factory=dict)
    start: Point | None = None
    end: Point | None = None
    recording: str = ""
    digest: str = ""
    start_orientation: Quaternion | None = None
    end_orientation: Quaternion | None = None


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
    """Recordings to trace, each in at most ``time_limit`` (s), in the order of their names.

    ``digests`` are those of their contents; ``alpha`` is the false-alarm rate.
    """

    recordings: tuple[str, ...]
    digests: tuple[str, ...]
    alpha: float = 0.01
    time_limit: float = 600.0


@dataclass(frozen=True)
class Plan:
    """A campaign plan: ``content`` of the robot file ``file``; each of ``count`` samples has values of all inputs.

    With a ``trace`` each recording is a run, and nothing varies. ``fmu_digests`` are those of the robot's user FMUs.
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
    fmu_digests: tuple[str, ...] = ()

    @property
    def variants(self) -> tuple[tuple[int, str], ...]:
        """Each path, by index, with each controller; a single one with index -1 where there are no paths."""
        if not self.paths:
            return ((-1, ""),)
        return tuple((path_index, name) for path_index in range(len(self.paths)) for name in self.controllers)

    @property
    def keys(self) -> tuple[str, ...]:
        """The inputs' keys."""
        return tuple(each.key for each in self.inputs)

    @property
    def is_rigid(self) -> bool:
        """Whether the platform turns."""
        return "inertia" in self.content.get("platform", {})

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
