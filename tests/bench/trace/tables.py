"""The benchmark's results as Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from .cases import Part
from .line import Line
from .score import MEANINGS, Rate, Scored, confusion, held, named, rate
from .sizes import stored


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def outcomes(answers: Sequence[Scored]) -> str:
    """How many answers of each kind of case had each outcome."""
    kinds = list(dict.fromkeys(answer.case.kind for answer in answers))
    results = [answer.outcome for answer in answers]
    used = [outcome for outcome in MEANINGS if outcome in results]
    rows = [
        [kind, len(mine := [a.outcome for a in answers if a.case.kind == kind]), *(mine.count(o) for o in used)]
        for kind in kinds
    ]
    return table(["hidden", "cases", *used], [*rows, ["all", len(results), *(results.count(o) for o in used)]])


def meanings(answers: Sequence[Scored]) -> str:
    """What the outcomes that occurred mean."""
    used = {answer.outcome for answer in answers}
    return "\n".join(f"- {outcome}: {meaning}." for outcome, meaning in MEANINGS.items() if outcome in used)


def confusions(answers: Sequence[Scored]) -> str:
    """Truth by rows, answer by columns."""
    rows, columns, counts = confusion(answers)
    body = [[row, *(str(n) if n else "" for n in line)] for row, line in zip(rows, counts.tolist(), strict=True)]
    return table(["hidden \\ said", *columns], body)


def names(answers: Sequence[Scored]) -> str:
    """Each effect of the list: how often it hides, is named, is missed, and is named where it does not hide."""
    rows = [[one.name, one.hidden, one.named, one.missed, one.wrong] for one in named(answers)]
    sums = [sum(int(row[place]) for row in rows) for place in range(1, 5)]
    return table(["effect", "hidden in", "named", "missed", "named elsewhere"], [*rows, ["all", *sums]])


def coverage(answers: Sequence[Scored]) -> str:
    """How many of the 95 % intervals hold the true value, by effect and in all."""
    result = held(answers)
    rows = []
    for name in dict.fromkeys(one.name for one in result):
        mine = [one for one in result if one.name == name]
        parameters = ", ".join(dict.fromkeys(one.parameter for one in mine))
        outside = ", ".join(f"{one.case} ({one.parameter})" for one in mine if not one.inside)
        rows.append([name, parameters, f"{sum(one.inside for one in mine)} of {len(mine)}", outside])
    whole = rate(sum(one.inside for one in result), len(result))
    return table(["effect", "parameters", "held", "not held in"], [*rows, ["all", "", shown_rate(whole), ""]])


def errors(answers: Sequence[Scored]) -> str:
    """Each case: what was said, and errors on CHECK over the noise floor, before and after."""
    rows = []
    for answer in answers:
        line, case = answer.line, answer.case
        said = " + ".join(sorted(line.names)) or line.verdict or "failed"
        sizes = _beside_little(line.truth) if line.truth else ", ".join(_size(case.key, part) for part in case.parts)
        ratios = [_over(line.before, line.floor), _over(line.after, line.floor)]
        rows.append([case.key, sizes, said, answer.outcome, *ratios, f"{line.processor:.0f} s"])
    return table(["case", "size", "said", "outcome", "before", "after", "time"], rows)


def times(answers: Sequence[Scored]) -> str:
    """Time that a trace takes and peak memory, by robot."""
    rows = []
    for robot in dict.fromkeys(answer.case.robot for answer in answers):
        mine = [a.line for a in answers if a.case.robot == robot and not a.line.failure]
        if mine:
            wall, processor = [line.seconds for line in mine], [line.processor for line in mine]
            peak = max(line.memory for line in mine)
            spans = [f"{np.median(spans):.0f} s, {max(spans):.0f} s" for spans in (wall, processor)]
            rows.append([robot, len(mine), *spans, f"{peak:.0f} MB"])
    return table(["robot", "traces", "wall: median, longest", "processor: median, longest", "most memory"], rows)


def reached(answers: Sequence[Scored]) -> Rate:
    """How many of the rightly named ones err on CHECK by at most 1.2 times the noise floor."""
    right = [a.line for a in answers if a.outcome == "right" and a.line.verdict == "effects"]
    return rate(sum(_worst(line) <= 1.2 for line in right), len(right))


def shown_rate(found: Rate) -> str:
    """A share with its interval."""
    if not found.of:
        return "none"
    share = 100.0 * found.count / found.of
    return f"{found.count} of {found.of} ({share:.1f} %, 95 %: {100 * found.low:.1f} to {100 * found.high:.1f} %)"


def _size(case: str, part: Part) -> str:
    size = stored()[case][part.form.key]
    return f"{part.form.key} {size.strength:.3g} ({size.nats:.2g} nats)"


def _beside_little(truth: Mapping[str, Any]) -> str:
    """How much more than the little things, if there are any, the hidden one changes CHECK: positions, tensions."""
    sizes = (truth[f"size_of_{which}_rms"]["check"] for which in ("hidden", "little"))
    return ", ".join(f"{hidden / little:.2g}" if little else "-" for hidden, little in zip(*sizes, strict=True))


def _worst(line: Line) -> float:
    return max(_ratios(line.after, line.floor), default=float("nan"))


def _ratios(error: tuple[float, float], floor: tuple[float, float]) -> list[float]:
    pairs = zip(error, floor, strict=True)
    return [e / f for e, f in pairs if isfinite(e) and isfinite(f) and f > 0.0]


def _over(error: tuple[float, float], floor: tuple[float, float]) -> str:
    return ", ".join(f"{ratio:.2f}" if ratio < 10.0 else f"{ratio:.0f}" for ratio in _ratios(error, floor)) or "-"
