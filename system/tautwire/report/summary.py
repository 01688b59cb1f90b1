"""What both the terminal and the page say about a trace: errors side by side, shares, names."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from tautwire_fmu.laws.effects import BY_NAME

from ..runs.wiring import AXES
from ..tracer.verdict import Candidate, Comparison, Errors, Estimate, Trace
from .units import ABSENT, engineering, significant, together

ROLES = ("fit", "check")
VERDICTS = {
    "effects": "Effect found",
    "none": "Nothing is missing",
    "discovered": "New effect, formula found",
    "unexplained": "Not explained",
}
MILLIMETRES = 1e3
# Below this excess over the noise floor there is nothing that a model could explain.
JUST_NOISE = 1.05


@dataclass(frozen=True)
class Output:
    """What a row of an error table is about: ``scale`` turns SI into ``unit``; ``key`` finds it in Errors."""

    label: str
    unit: str
    scale: float
    key: tuple[str, int | None]

    def of(self, errors: Errors | None) -> float:
        """The error in ``unit``; NaN where nothing was measured."""
        if errors is None:
            return math.nan
        name, index = self.key
        field = getattr(errors, name)
        return self.scale * float(field if index is None else field[index])


POSITION = Output("position", "mm", MILLIMETRES, ("position_rms", None))
TENSION = Output("tension", "N", 1.0, ("tension_rms", None))


def axis_outputs() -> list[Output]:
    """One output for each axis."""
    return [Output(axis, "mm", MILLIMETRES, ("axes", place)) for place, axis in enumerate(AXES)]


def cable_outputs(cable_count: int) -> list[Output]:
    """One output for each cable."""
    return [Output(f"cable {place + 1}", "N", 1.0, ("cables", place)) for place in range(cable_count)]


def comparison_of(trace: Trace, role: str) -> Comparison | None:
    """The comparison in a role; None where that recording was not given."""
    return next((each for each in trace.comparisons if each.role == role), None)


def share_explained(before: float, after: float, floor: float) -> float | None:
    """How much of the mean square above the noise floor is gone; None where there was none."""
    if not math.isfinite(before) or not math.isfinite(after):
        return None
    noise = floor if math.isfinite(floor) else 0.0
    if before <= JUST_NOISE * noise or before == 0.0:
        return None
    return min(1.0, (before**2 - after**2) / (before**2 - noise**2))


def cables_text(cables: Sequence[int], cable_count: int) -> str:
    """Cables as a reader says them: "all cables", "cable 2", "cables 1, 3"; a dash for none."""
    if not cables:
        return "-"
    if len(cables) == cable_count:
        return "all cables"
    return f"cable{'s' if len(cables) > 1 else ''} {', '.join(str(cable) for cable in cables)}"


def unit_of(effect: str, parameter: str) -> str:
    """The unit of an effect's parameter; empty where the project does not know it."""
    known = BY_NAME.get(effect)
    units = {each.name: each.unit for each in known.parameters} if known else {}
    return units.get(parameter, "")


def values_text(effect: str, values: Mapping[str, float]) -> str:
    """An effect's values on one line, as in "damping 2.10 GPa s"."""
    return ", ".join(f"{name} {engineering(value, unit_of(effect, name))}" for name, value in values.items())


@dataclass(frozen=True)
class EstimateText:
    """A parameter in one handy unit, with as many decimals as its interval justifies."""

    value: str
    low: str
    high: str
    declared: str
    unit: str


def estimate_text(estimate: Estimate) -> EstimateText:
    """An estimate as text."""
    four = (estimate.value, estimate.low, estimate.high, estimate.declared)
    texts, unit = together(four, estimate.unit, (estimate.high - estimate.low) / 2.0)
    value, low, high, declared = texts
    return EstimateText(value, low, high, declared, unit)


def ranking(candidates: Sequence[Candidate]) -> list[tuple[int, list[Candidate]]]:
    """Rounds in order, each with its candidates, the one with most evidence first."""

    def place(candidate: Candidate) -> tuple[int, float, str, tuple[int, ...]]:
        evidence = candidate.evidence if math.isfinite(candidate.evidence) else -math.inf
        return (candidate.round, -evidence, candidate.name, candidate.cables)

    ordered = sorted(candidates, key=place)
    return [(number, list(group)) for number, group in groupby(ordered, key=lambda each: each.round)]


def noise_sentence(trace: Trace) -> str:
    """Whether noise is all that is left, before and after, in one sentence."""
    before, after = trace.noise_before, trace.noise_after
    if before and after:
        return "The declared model already leaves nothing but noise."
    if after:
        return "What the extended model leaves is noise; what the declared one leaves is not."
    if before:
        return "The declared model leaves noise, the final one more than that."
    return "More than noise is left."


def evidence_text(evidence: float) -> str:
    """Evidence in natural logarithms, to a tenth; to four digits where it is large."""
    if not math.isfinite(evidence):
        return ABSENT
    return significant(evidence, 4) if abs(evidence) >= 1000.0 else f"{evidence:.1f}"
