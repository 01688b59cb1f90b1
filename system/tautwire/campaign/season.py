"""Summary of the traces of many recordings."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any

import pyarrow as pa

from .rows import FAILURE_COLUMN


@dataclass(frozen=True)
class IdentifiedParameter:
    """A parameter identified from one recording, with its 95 % interval; None where a bound does not exist."""

    recording: str
    effect: str
    cables: tuple[int, ...]
    parameter: str
    unit: str
    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class TraceSummary:
    """Summary of all traces: counts of each verdict, and each parameter of each effect over the recordings."""

    count: int
    failed: int
    verdicts: tuple[tuple[str, int], ...]
    findings: tuple[IdentifiedParameter, ...]

    def document(self) -> dict[str, Any]:
        """The summary as JSON-serialisable data."""
        fields = asdict(self)
        fields["verdicts"] = dict(self.verdicts)
        return fields


def summarise_traces(rows: pa.Table) -> TraceSummary:
    """Summary of the rows of a campaign of traces, sorted by index."""
    findings = [
        IdentifiedParameter(
            recording=recording,
            effect=effect["name"],
            cables=tuple(effect["cables"]),
            parameter=name,
            unit=estimate["unit"],
            value=estimate["value"],
            low=estimate["low"],
            high=estimate["high"],
        )
        for recording, report in zip(rows["recording"].to_pylist(), rows["report"].to_pylist(), strict=True)
        for effect in (json.loads(report)["effects"] if report else ())
        for name, estimate in effect["parameters"].items()
    ]
    findings.sort(key=lambda each: (each.effect, each.cables, each.parameter))
    verdicts = Counter(each for each in rows["verdict"].to_pylist() if each is not None)
    failed = sum(each is not None for each in rows[FAILURE_COLUMN].to_pylist())
    return TraceSummary(rows.num_rows, failed, tuple(verdicts.most_common()), tuple(findings))
