"""What an answer is worth beside the truth, and sums of it over many cases."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal

import numpy as np
from scipy.stats import binomtest

from tautwire_fmu.laws.effects import ALL, BY_NAME

from .cases import Case
from .line import Line
from .motion import declared
from .sizes import strengths
from .truth import Interval, holds, in_one_way, law_values

Outcome = Literal["right", "little", "ambiguous", "place", "part", "abstained", "missed", "alarm", "wrong", "failed"]
MEANINGS: Mapping[Outcome, str] = {
    "right": "what is hidden, by name and place; nothing where nothing is; abstention where it is not on the list",
    "little": "with it, as larger than it is, something that is there though only in small",
    "ambiguous": "a name that the data cannot tell from the true one, declared so with the true one in the set",
    "place": "the right name on other cables",
    "part": "some of the names and no wrong one",
    "abstained": "unexplained or discovered, though it is on the list",
    "missed": "none, though something is hidden",
    "alarm": "unexplained or discovered where nothing is hidden",
    "wrong": "a name that is not hidden",
    "failed": "no answer",
}


# Kinds of cases in which a name is the answer.
NAMED = ("listed", "form", "pair")


@dataclass(frozen=True)
class Scored:
    """A case with its answer."""

    case: Case
    line: Line
    outcome: Outcome


@dataclass(frozen=True)
class Held:
    """Whether one interval holds its true value."""

    case: str
    name: str
    parameter: str
    truth: float
    estimate: Interval
    inside: bool


@dataclass(frozen=True)
class Rate:
    """A share with its exact 95 % interval (Clopper and Pearson)."""

    count: int
    of: int
    low: float
    high: float


def scored(cases: Iterable[Case], lines: Mapping[str, Line]) -> tuple[Scored, ...]:
    """The cases that have a line, in their order."""
    return tuple(Scored(c, lines[c.key], outcome(c, lines[c.key])) for c in cases if c.key in lines)


def outcome(case: Case, line: Line) -> Outcome:
    """See MEANINGS."""
    if line.failure:
        return "failed"
    if line.verdict == "effects":
        if case.kind == "empty" and line.effects:
            return "little" if {effect.name for effect in line.effects} <= _minor(line) else "wrong"
        return _of_names(case, line) if case.kind in NAMED else "wrong"
    if line.verdict == "none":
        return "right" if case.kind == "empty" else "missed"
    if case.kind == "unlisted":
        return "right" if {effect.name for effect in line.effects} <= _minor(line) else "wrong"
    return "alarm" if case.kind == "empty" else "abstained"


def _of_names(case: Case, line: Line) -> Outcome:
    if line.names == case.names:
        return "right" if line.truth or _places(case) == _named_places(line) else "place"
    if line.names < case.names:
        return "part" if line.names else "missed"
    if line.names - case.names <= _minor(line) and case.names <= line.names:
        return "little"
    return "ambiguous" if _excused(case.names, line) else "wrong"


def _minor(line: Line) -> frozenset[str]:
    """What else is there in small, by name."""
    return frozenset(line.truth.get("minor", ()))


def _excused(truth: frozenset[str], line: Line) -> bool:
    """Whether each wrong name stands in a declared set with a true one that is not named; or a set is the truth."""
    sets = [frozenset(names) for names in line.also_possible]
    absent = truth - line.names
    return truth in sets or all(any(wrong in s and s & absent for s in sets) for wrong in line.names - truth)


def _places(case: Case) -> dict[str, frozenset[int]]:
    """The cables on which each hidden effect acts; none where cables do not matter."""
    starts = {part.form.key: part.form.start for part in case.parts}
    return _places_of(case.effects(starts), declared(case.robot).count)


def _places_of(effects: Mapping[str, Any], count: int) -> dict[str, frozenset[int]]:
    results = {}
    for name, values in effects.items():
        of_position = values.get("outputs") == "position" or "place" in values
        anywhere = of_position or BY_NAME[name].component == "platform"
        results[name] = frozenset() if anywhere else frozenset(values.get("cables", range(1, count + 1)))
    return results


def _named_places(line: Line) -> dict[str, frozenset[int]]:
    results: dict[str, frozenset[int]] = {}
    for effect in line.effects:
        on_platform = BY_NAME[effect.name].component == "platform" or _of_position(effect.parameters)
        places = frozenset() if on_platform else frozenset(effect.cables)
        results[effect.name] = results.get(effect.name, frozenset()) | places
    return results


def _of_position(parameters: Mapping[str, tuple[float, float, float]]) -> bool:
    """Whether only what is fitted of the measured position counts."""
    fitted = {name for name, (_, low, high) in parameters.items() if high > low}
    return bool(fitted) and all(name.startswith("position_") for name in fitted)


def held(answers: Iterable[Scored]) -> tuple[Held, ...]:
    """Every fitted interval of a rightly named effect, against the truth."""
    results: list[Held] = []
    for answer in answers:
        if answer.line.verdict != "effects" or answer.case.kind not in NAMED:
            continue
        truth = answer.line.truth
        hidden = truth["parameters"] if truth else answer.case.effects(strengths(answer.case))
        rig = {name: hidden[name] for name in answer.case.exact_names & answer.line.names}
        places = _places_of(rig, truth["cables"] if truth else declared(answer.case.robot).count)
        for effect in answer.line.effects:
            here = frozenset(effect.cables)
            if effect.name not in rig or (places[effect.name] and not here <= places[effect.name]):
                continue
            values = law_values(effect.name, rig[effect.name])
            neutral = {p.name: p.neutral for p in BY_NAME[effect.name].parameters}
            estimates = {name: Interval(*ends) for name, ends in effect.parameters.items()}
            for name, estimate in in_one_way(effect.name, estimates).items():
                true = values.get(name, neutral.get(name))
                if true is not None and _is_fitted(estimate):
                    inside = holds(effect.name, name, true, estimate)
                    results.append(Held(answer.case.key, effect.name, name, true, estimate, inside))
    return tuple(results)


def _is_fitted(estimate: Interval) -> bool:
    return all(isfinite(end) for end in estimate) and estimate.high > estimate.low


@dataclass(frozen=True)
class Named:
    """In how many cases an effect hides, is named, is not named; and in how many others its name is given."""

    name: str
    hidden: int
    named: int
    missed: int
    wrong: int


def named(answers: Iterable[Scored]) -> tuple[Named, ...]:
    """For each name that is hidden or given, in the order of the list."""
    answered = [(answer.case.names, answer.line.names) for answer in answers if not answer.line.failure]
    results = []
    for name in (effect.name for effect in ALL):
        hidden = [said for truth, said in answered if name in truth]
        wrong = sum(name in said and name not in truth for truth, said in answered)
        count = sum(name in said for said in hidden)
        if hidden or wrong:
            results.append(Named(name, len(hidden), count, len(hidden) - count, wrong))
    return tuple(results)


def rate(count: int, of: int) -> Rate:
    """A share of some."""
    if of == 0:
        return Rate(0, 0, 0.0, 1.0)
    ends = binomtest(count, of).proportion_ci(method="exact")
    return Rate(count, of, float(ends.low), float(ends.high))


def confusion(answers: Sequence[Scored]) -> tuple[list[str], list[str], np.ndarray]:
    """Rows (what is hidden), columns (what was named or said), and counts; a pair counts in each name's column."""
    names = [*(effect.name for effect in ALL), "none", "unexplained", "discovered", "failed"]
    rows = list(dict.fromkeys(answer.case.label for answer in answers))
    counts = np.zeros((len(rows), len(names)), dtype=int)
    for answer in answers:
        line = answer.line
        said = line.names if line.verdict == "effects" else {"failed" if line.failure else line.verdict}
        for name in said:
            counts[rows.index(answer.case.label), names.index(name)] += 1
    used = [index for index in range(len(names)) if counts[:, index].any()]
    return rows, [names[index] for index in used], counts[:, used]
