"""The line that a traced case leaves: all that scoring needs, as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from tautwire.estimation import Trace
from tautwire.estimation.trace_result import Errors

MOST_RIVALS = 6
# Below it, the name of a little thing that a lifelike robot has is no wrong name.
MINOR_SHARE = 0.05


@dataclass(frozen=True)
class NamedEffect:
    """An effect that the tracer named; of each parameter (value, low, high), and its share of what was missed."""

    name: str
    cables: tuple[int, ...]
    parameters: dict[str, tuple[float, float, float]]
    share: float | None = None


@dataclass(frozen=True)
class Rival:
    """A hypothesis that the tracer fitted: evidence in nats, and what it leaves as mean square on CHECK."""

    round: int
    name: str
    cables: tuple[int, ...]
    evidence: float
    mean_square: float
    accepted: bool


@dataclass(frozen=True)
class Used:
    """Processor time in s and peak memory in MB that a trace took."""

    processor: float
    memory: float


@dataclass(frozen=True)
class Line:
    """What the tracer said of one case, or how it failed.

    Errors are (position in m, tension in N) on CHECK, root mean squares; ``fingerprint`` is of the recordings, ``code``
    of the tracer. ``left`` is the mean square of what is left of each output, ``rivals`` are each round's best
    hypotheses. ``small`` are names that were listed apart, ``left_share`` what no effect explains; ``truth`` is what
    the rig says of a lifelike case. ``seconds`` is wall time, ``processor`` that of the cores, which other work does
    not lengthen; ``memory`` is the peak in MB.
    """

    key: str
    fingerprint: str
    code: str
    verdict: str = ""
    sentence: str = ""
    effects: tuple[NamedEffect, ...] = ()
    also_possible: tuple[tuple[str, ...], ...] = ()
    before: tuple[float, float] = (0.0, 0.0)
    after: tuple[float, float] = (0.0, 0.0)
    floor: tuple[float, float] = (0.0, 0.0)
    seconds: float = 0.0
    processor: float = 0.0
    memory: float = 0.0
    left: tuple[float, ...] = ()
    rivals: tuple[Rival, ...] = ()
    small: tuple[str, ...] = ()
    left_share: float | None = None
    truth: dict[str, Any] = field(default_factory=dict)
    failure: str = ""

    @property
    def names(self) -> frozenset[str]:
        """The effects that it named, but for what is there in small and was said to be small."""
        minor = self.truth.get("minor", ())
        return frozenset(
            e.name for e in self.effects if e.name not in minor or e.share is None or e.share >= MINOR_SHARE
        )

    def text(self) -> str:
        """As one line of JSON."""
        return json.dumps(asdict(self))


def line_from(text: str) -> Line:
    """The line that :meth:`Line.text` wrote."""
    content: dict[str, Any] = json.loads(text)
    for key in ("before", "after", "floor", "left", "small"):
        content[key] = tuple(content.get(key, ()))
    content["rivals"] = tuple(Rival(**{**rival, "cables": tuple(rival["cables"])}) for rival in content["rivals"])
    content["also_possible"] = tuple(tuple(names) for names in content["also_possible"])
    content["effects"] = tuple(
        NamedEffect(
            effect["name"],
            tuple(effect["cables"]),
            {key: (v[0], v[1], v[2]) for key, v in effect["parameters"].items()},
            effect.get("share"),
        )
        for effect in content["effects"]
    )
    return Line(**content)


def line_of(key: str, fingerprint: str, code: str, trace: Trace, used: Used) -> Line:
    """What a trace says of a case."""
    check = trace.comparisons[-1]
    return Line(
        key=key,
        fingerprint=fingerprint,
        code=code,
        verdict=trace.verdict,
        sentence=trace.sentence,
        effects=tuple(
            NamedEffect(e.name, e.cables, {k: (p.value, p.low, p.high) for k, p in e.parameters.items()}, e.share)
            for e in trace.effects
        ),
        also_possible=trace.also_possible,
        before=_both(check.errors_before),
        after=_both(check.errors_after),
        floor=_both(trace.noise_floor),
        seconds=trace.seconds,
        processor=used.processor,
        memory=used.memory,
        left=tuple(float(square) for square in trace.normalised_innovation_variance),
        rivals=_best(trace),
        small=tuple(effect.name for effect in trace.small_effects),
        left_share=trace.left_share,
    )


def read_lines(path: Path) -> tuple[Line, ...]:
    """All whole lines of a file, none where there is no file; a line that a stop cut short is left out."""
    if not path.exists():
        return ()
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    return tuple(line_from(line) for line in lines if line.endswith("\n"))


def keep(path: Path, lines: Sequence[Line]) -> tuple[Line, ...]:
    """The newest line of each case, those of a file and others after them; written to it by name.

    Without rivals, and of a failure only its message: a traceback has the machine's paths.
    """
    newest = {
        line.key: replace(line, rivals=(), failure=line.failure.strip().rpartition("\n")[2])
        for line in (*read_lines(path), *lines)
    }
    kept = tuple(newest[key] for key in sorted(newest))
    path.write_text("".join(f"{line.text()}\n" for line in kept), encoding="utf-8")
    return kept


def _best(trace: Trace) -> tuple[Rival, ...]:
    """The best of each round, best first."""
    results: list[Rival] = []
    for number in dict.fromkeys(candidate.round for candidate in trace.candidates):
        fitted = [c for c in trace.candidates if c.round == number and isfinite(c.mean_square)]
        ranked = sorted(fitted, key=lambda candidate: -candidate.evidence)[:MOST_RIVALS]
        results += [Rival(c.round, c.name, c.cables, c.evidence, c.mean_square, c.accepted) for c in ranked]
    return tuple(results)


def _both(errors: Errors) -> tuple[float, float]:
    return (errors.position_rms, errors.tension_rms)
