"""What the rows of a campaign say together: spreads, probabilities, and what the outputs depend on."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from scipy.stats import binomtest

from .errors import MissingExtraError
from .plan import Plan
from .rows import FAILURE, RowColumn
from .sampling import sobol_block, sobol_problem

Array = NDArray[np.float64]

SHARES = (0.025, 0.25, 0.5, 0.75, 0.975)
CONFIDENCE = 0.95
MOST_REASONS = 20
# Below these SALib's estimates say nothing: of given samples (RBD-FAST), and of base samples (Saltelli).
FEWEST_GIVEN, FEWEST_BASE = 64, 8


@dataclass(frozen=True)
class Spread:
    """An output over all runs of a path and a controller that have it; ``quantiles`` at :data:`SHARES`."""

    path: str
    controller: str
    name: str
    unit: str
    count: int
    mean: float
    standard_deviation: float
    quantiles: tuple[float, ...]
    least: float
    largest: float


@dataclass(frozen=True)
class Probability:
    """How often a flag holds: ``times`` of ``count`` runs, and the 95 % interval of its probability (Wilson)."""

    path: str
    controller: str
    name: str
    times: int
    count: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """The part of runs in which it holds."""
        return self.times / self.count


@dataclass(frozen=True)
class Dependence:
    """How much of an output's variance an input, or a group of correlated ones, makes, with 95 % half-widths.

    ``first`` is the Sobol index of first order; ``total`` that of all orders, None where the samples do not tell it.
    """

    path: str
    controller: str
    output: str
    input: str
    first: float
    first_width: float
    total: float | None = None
    total_width: float | None = None


@dataclass(frozen=True)
class Summary:
    """All of it; ``reasons`` are those of failed runs with how many had them; ``notes`` what could not be said."""

    count: int
    failed: int
    reasons: tuple[tuple[str, int], ...]
    spreads: tuple[Spread, ...]
    probabilities: tuple[Probability, ...]
    dependences: tuple[Dependence, ...]
    notes: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """It as what JSON knows; null where a number is not finite."""
        told = asdict(self)
        told["reasons"] = [{"reason": reason, "runs": count} for reason, count in self.reasons]
        for place, each in enumerate(self.probabilities):
            told["probabilities"][place]["probability"] = each.share
        for each in told["spreads"]:
            each["quantiles"] = {
                f"{100 * share:g} %": value for share, value in zip(SHARES, each["quantiles"], strict=True)
            }
        return dict(_plain(told))


def summary_of(plan: Plan, columns: tuple[RowColumn, ...], rows: pa.Table) -> Summary:
    """What all rows say, by ascending index, by path and controller."""
    spreads: list[Spread] = []
    probabilities: list[Probability] = []
    dependences: list[Dependence] = []
    why = _why_no_dependence(plan)
    for path, controller, part in parts_by_variant(plan, rows):
        for column in columns:
            if column.role != "output":
                continue
            if column.kind == "number":
                values = numbers_of(part, column.name)
                spreads += _spread(path, controller, column, values)
                if not why:
                    dependences += _dependences(plan, path, controller, column.name, values, part)
            elif column.kind == "flag":
                probabilities += _probability(path, controller, column.name, part)
    failures = Counter(each for each in rows[FAILURE].to_pylist() if each is not None)
    return Summary(
        count=rows.num_rows,
        failed=sum(failures.values()),
        reasons=tuple(failures.most_common(MOST_REASONS)),
        spreads=tuple(spreads),
        probabilities=tuple(probabilities),
        dependences=tuple(dependences),
        notes=(*plan.notes, *([why] if why else [])),
    )


def parts_by_variant(plan: Plan, rows: pa.Table) -> Iterator[tuple[str, str, pa.Table]]:
    """The rows of each path with each controller, by ascending sample."""
    if not plan.paths:
        yield "", "", rows
        return
    for place, controller in plan.variants:
        name = plan.paths[place].name
        yield (
            name,
            controller,
            rows.filter(pc.and_(pc.equal(rows["path"], name), pc.equal(rows["controller"], controller))),
        )


def numbers_of(rows: pa.Table, name: str) -> Array:
    """A column of numbers, NaN where a run has none."""
    return np.asarray(rows[name].cast(pa.float64()).to_numpy(), dtype=float)


def _spread(path: str, controller: str, column: RowColumn, values: Array) -> list[Spread]:
    known = values[np.isfinite(values)]
    if not known.size:
        return []
    found = Spread(
        path=path,
        controller=controller,
        name=column.name,
        unit=column.unit,
        count=int(known.size),
        mean=float(known.mean()),
        standard_deviation=float(known.std(ddof=1)) if known.size > 1 else 0.0,
        quantiles=tuple(np.quantile(known, SHARES).tolist()),
        least=float(known.min()),
        largest=float(known.max()),
    )
    return [found]


def _probability(path: str, controller: str, name: str, rows: pa.Table) -> list[Probability]:
    known = rows[name].drop_null()
    if not len(known):
        return []
    times = int(pc.sum(known).as_py())
    interval = binomtest(times, len(known)).proportion_ci(CONFIDENCE, method="wilson")
    return [Probability(path, controller, name, times, len(known), float(interval.low), float(interval.high))]


def _why_no_dependence(plan: Plan) -> str:
    """Why nothing can be said of what outputs depend on; empty where it can."""
    if plan.trace is not None or not plan.inputs:
        return ""
    if plan.method == "grid":
        return "no Sobol indices: a grid has no distribution of its inputs"
    if plan.method == "saltelli":
        return ""
    if plan.correlations:
        return 'no Sobol indices: inputs are correlated, which takes method = "saltelli"'
    if any(each.distribution.steps for each in plan.inputs):
        return 'no Sobol indices: inputs have steps, which takes method = "saltelli"'
    few = plan.count < FEWEST_GIVEN
    return f"no Sobol indices: {plan.count} samples, they take {FEWEST_GIVEN} or more" if few else ""


def _dependences(
    plan: Plan, path: str, controller: str, output: str, values: Array, rows: pa.Table
) -> list[Dependence]:
    """Sobol indices by SALib, of whole blocks of a Saltelli design or of whatever samples there are.

    A block in which a run failed is left out; none are given where what is left is too little, or does not vary.
    """
    if plan.method == "saltelli":
        block = sobol_block(plan)
        whole = np.isfinite(values).reshape(-1, block).all(axis=1)
        known = values.reshape(-1, block)[whole].ravel()
        if whole.sum() < FEWEST_BASE or _is_constant(known):
            return []
        found = _analysed("sobol", sobol_problem(plan), known, calc_second_order=False, seed=plan.seed)
        return [
            Dependence(path, controller, output, *each)
            for each in zip(
                found["names"], *(map(float, found[k]) for k in ("S1", "S1_conf", "ST", "ST_conf")), strict=True
            )
        ]
    known = np.isfinite(values)
    if known.sum() < FEWEST_GIVEN or _is_constant(values[known]):
        return []
    inputs = np.column_stack([numbers_of(rows, key) for key in plan.keys])[known]
    found = _analysed("rbd_fast", sobol_problem(plan), inputs, values[known], seed=plan.seed)
    pairs = zip(plan.keys, map(float, found["S1"]), map(float, found["S1_conf"]), strict=True)
    return [Dependence(path, controller, output, *each) for each in pairs]


def _is_constant(values: Array) -> bool:
    return bool(np.ptp(values) <= 1e-12 * np.max(np.abs(values), initial=0.0))


def _analysed(method: str, problem: dict[str, Any], *arguments: Array, **options: Any) -> Any:
    try:
        from SALib.analyze import rbd_fast, sobol
    except ImportError as error:
        raise MissingExtraError("SALib") from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = (sobol if method == "sobol" else rbd_fast).analyze(problem, *arguments, **options)
    found["names"] = list(dict.fromkeys(problem.get("groups", problem["names"])))
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
