"""What the traces of many recordings say together."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any

import pyarrow as pa

from .rows import FAILURE


@dataclass(frozen=True)
class Finding:
    """A parameter that one recording's trace found, with its 95 % interval; None where there is no end."""

    recording: str
    effect: str
    cables: tuple[int, ...]
    parameter: str
    unit: str
    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Season:
    """All recordings: how many had each verdict, and each parameter of each effect over the recordings."""

    count: int
    failed: int
    verdicts: tuple[tuple[str, int], ...]
    findings: tuple[Finding, ...]

    def document(self) -> dict[str, Any]:
        """It as what JSON knows."""
        told = asdict(self)
        told["verdicts"] = dict(self.verdicts)
        return told


def season_of(rows: pa.Table) -> Season:
    """What the rows of a campaign of traces say, by ascending index."""
    findings = [
        Finding(
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
    failed = sum(each is not None for each in rows[FAILURE].to_pylist())
    return Season(rows.num_rows, failed, tuple(verdicts.most_common()), tuple(findings))
