"""Statistics over the runs of a campaign: quantiles, probabilities with Wilson intervals, and Sobol indices."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from scipy.stats import binomtest

from ..json_document import json_value
from .campaign_plan import MissingExtraError, Plan
from .dataset_schema import FAILURE_COLUMN, RowColumn
from .input_sampling import salib_problem, saltelli_block_size
from .polynomial_chaos import first_order_indices, min_sample_count

Array = NDArray[np.float64]

SPREAD_QUANTILE_LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)
CONFIDENCE_LEVEL = 0.95
MAX_REASONS = 20
# Fewer samples or blocks of a Saltelli design give meaningless estimates.
MIN_SAMPLES, MIN_SALTELLI_BLOCKS = 64, 8


@dataclass(frozen=True)
class Spread:
    """Statistics of an output over the runs of a path and a controller; quantiles at :data:`SPREAD_QUANTILE_LEVELS`."""

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
class FlagProbability:
    """Probability of a flag: true in ``times`` of ``count`` runs, with its 95 % interval (Wilson)."""

    path: str
    controller: str
    name: str
    times: int
    count: int
    low: float
    high: float

    @property
    def relative_frequency(self) -> float:
        """Relative frequency of the flag over the runs."""
        return self.times / self.count


@dataclass(frozen=True)
class SobolIndices:
    """Sobol indices of an output with respect to an input or a group of correlated ones, with 95 % half-widths.

    ``first`` is the first-order index; ``total`` the total-order one, None where the design does not give it.
    """

    path: str
    controller: str
    output: str
    input: str
    first: float
    first_width: float
    total: float | None = None
    total_width: float | None = None

    @property
    def is_significant(self) -> bool:
        """Whether the interval of an index excludes 0."""
        return self.is_first_significant or self.is_total_significant

    @property
    def is_first_significant(self) -> bool:
        """Whether the interval of the first-order index excludes 0."""
        return self.first > self.first_width

    @property
    def is_total_significant(self) -> bool:
        """Whether there is a total-order index, and its interval excludes 0."""
        return self.total is not None and self.total > (self.total_width or 0.0)


@dataclass(frozen=True)
class Summary:
    """Summary of a campaign; ``reasons`` are those of failed runs with counts; ``notes`` what could not be computed."""

    count: int
    failed: int
    reasons: tuple[tuple[str, int], ...]
    spreads: tuple[Spread, ...]
    probabilities: tuple[FlagProbability, ...]
    dependences: tuple[SobolIndices, ...]
    notes: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """The summary as JSON-serialisable data; null where a number is not finite."""
        fields = asdict(self)
        fields["reasons"] = [{"reason": reason, "runs": count} for reason, count in self.reasons]
        for index, each in enumerate(self.probabilities):
            fields["probabilities"][index]["probability"] = each.relative_frequency
        for each in fields["spreads"]:
            each["quantiles"] = {
                f"{100 * share:g} %": value
                for share, value in zip(SPREAD_QUANTILE_LEVELS, each["quantiles"], strict=True)
            }
        return dict(json_value(fields))


def summarise_runs(plan: Plan, columns: Sequence[RowColumn], rows: pa.Table) -> Summary:
    """Summarise all rows, sorted by index, by path and controller."""
    spreads: list[Spread] = []
    probabilities: list[FlagProbability] = []
    dependences: list[SobolIndices] = []
    unavailable_reason = _sobol_unavailable_reason(plan)
    for path, controller, variant_rows in rows_by_variant(plan, rows):
        for column in columns:
            if column.role != "output":
                continue
            if column.kind == "number":
                values = column_values(variant_rows, column.name)
                spreads += _output_spread(path, controller, column, values)
                if not unavailable_reason:
                    dependences += _sobol_indices(plan, path, controller, column.name, values, variant_rows)
            elif column.kind == "flag":
                probabilities += _flag_probability(path, controller, column.name, variant_rows)
    failures = Counter(each for each in rows[FAILURE_COLUMN].to_pylist() if each is not None)
    return Summary(
        count=rows.num_rows,
        failed=sum(failures.values()),
        reasons=tuple(failures.most_common(MAX_REASONS)),
        spreads=tuple(spreads),
        probabilities=tuple(probabilities),
        dependences=tuple(dependences),
        notes=(*plan.notes, *([unavailable_reason] if unavailable_reason else [])),
    )


def rows_by_variant(plan: Plan, rows: pa.Table) -> Iterator[tuple[str, str, pa.Table]]:
    """The rows of each path with each controller, in ascending order of samples."""
    if not plan.paths:
        yield "", "", rows
        return
    for path_index, controller in plan.variants:
        name = plan.paths[path_index].name
        yield (
            name,
            controller,
            rows.filter(pc.and_(pc.equal(rows["path"], name), pc.equal(rows["controller"], controller))),
        )


def column_values(rows: pa.Table, name: str) -> Array:
    """A numeric column, NaN where a run has no value."""
    return np.asarray(rows[name].cast(pa.float64()).to_numpy(), dtype=float)


def _output_spread(path: str, controller: str, column: RowColumn, values: Array) -> list[Spread]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return []
    spread = Spread(
        path=path,
        controller=controller,
        name=column.name,
        unit=column.unit,
        count=int(finite.size),
        mean=float(finite.mean()),
        standard_deviation=float(finite.std(ddof=1)) if finite.size > 1 else 0.0,
        quantiles=tuple(np.quantile(finite, SPREAD_QUANTILE_LEVELS).tolist()),
        least=float(finite.min()),
        largest=float(finite.max()),
    )
    return [spread]


def _flag_probability(path: str, controller: str, name: str, rows: pa.Table) -> list[FlagProbability]:
    flags = rows[name].drop_null()
    if not len(flags):
        return []
    true_count = int(pc.sum(flags).as_py())
    interval = binomtest(true_count, len(flags)).proportion_ci(CONFIDENCE_LEVEL, method="wilson")
    return [FlagProbability(path, controller, name, true_count, len(flags), float(interval.low), float(interval.high))]


def _sobol_unavailable_reason(plan: Plan) -> str:
    """Reason why Sobol indices cannot be computed; empty where they can."""
    if plan.trace is not None or not plan.inputs:
        return ""
    if plan.method == "grid":
        return "no Sobol indices: a grid has no distribution of its inputs"
    if plan.method == "saltelli":
        return ""
    if plan.correlations:
        return 'no Sobol indices: inputs are correlated, which requires method = "saltelli"'
    if any(each.distribution.discrete_values for each in plan.inputs):
        return 'no Sobol indices: inputs are discrete, which requires method = "saltelli"'
    required = _min_samples(plan)
    return f"no Sobol indices: {plan.count} samples, {required} or more are required" if plan.count < required else ""


def _min_samples(plan: Plan) -> int:
    return max(MIN_SAMPLES, min_sample_count(len(plan.inputs)))


def _sobol_indices(
    plan: Plan, path: str, controller: str, output: str, values: Array, rows: pa.Table
) -> list[SobolIndices]:
    """Sobol indices by SALib, from complete blocks of a Saltelli design, or by polynomial chaos from any other samples.

    Blocks with a failed run are omitted; the list is empty where too few remain, or the output is constant.
    """
    if plan.method == "saltelli":
        block_size = saltelli_block_size(plan)
        is_complete = np.isfinite(values).reshape(-1, block_size).all(axis=1)
        usable = values.reshape(-1, block_size)[is_complete].ravel()
        if is_complete.sum() < MIN_SALTELLI_BLOCKS or _is_constant(usable):
            return []
        analysis = _saltelli_analysis(plan, usable)
        return [
            SobolIndices(path, controller, output, *each)
            for each in zip(
                analysis["names"], *(map(float, analysis[k]) for k in ("S1", "S1_conf", "ST", "ST_conf")), strict=True
            )
        ]
    usable = np.isfinite(values)
    if usable.sum() < _min_samples(plan) or _is_constant(values[usable]):
        return []
    inputs = np.column_stack([column_values(rows, key) for key in plan.keys])[usable]
    result = first_order_indices([each.distribution for each in plan.inputs], inputs, values[usable], CONFIDENCE_LEVEL)
    triples = zip(plan.keys, result.indices.tolist(), result.half_widths.tolist(), strict=True)
    return [SobolIndices(path, controller, output, *each) for each in triples]


def _is_constant(values: Array) -> bool:
    return bool(np.ptp(values) <= 1e-12 * np.max(np.abs(values), initial=0.0))


def _saltelli_analysis(plan: Plan, values: Array) -> Any:
    try:
        from SALib.analyze import sobol
    except ImportError as error:
        raise MissingExtraError("SALib") from error
    problem = salib_problem(plan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        analysis = sobol.analyze(problem, values, calc_second_order=False, seed=plan.seed)
    analysis["names"] = list(dict.fromkeys(problem.get("groups", problem["names"])))
    return analysis
