"""A verdict on a rope in words: one sentence, and what a reader must know beside it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from scipy.stats import chi2, spearmanr

from .consistency import disagreements, understated
from .table import MaterialTable
from .verdict import MaterialVerdict, Model, Role

SMALLEST_P = 1e-300
# From this rank correlation on, two columns of a table rise or fall together.
TOGETHER = 0.9
NEW_TERMS = ("relaxation", "hysteresis")
TITLES: dict[Role, str] = {
    "declared": "declared pair",
    "constant": "best constant pair",
    "relaxation": "relaxation alone",
    "chosen": "chosen",
    "rival": "as good",
    "robot": "for robot files",
}


def sentence(verdict: MaterialVerdict) -> str:
    """The verdict in one or two sentences."""
    constant = verdict.model("constant")
    refuted = constant.p_value < verdict.options.alpha
    judged = f"A constant pair of modulus and damping is {'refuted' if refuted else 'enough'}: the best one leaves"
    text = f"{judged} {left_text(constant)}"
    if verdict.before.role == "declared":
        text += f", the declared one {left_text(verdict.before)}"
    if verdict.verdict == "unexplained":
        return f"{text}. No model here leaves only noise: {verdict.after.label} leaves {left_text(verdict.after)}."
    new = sorted((effect.name for effect in verdict.effects if effect.name in NEW_TERMS), reverse=True)
    if new:
        return f"{text}. Found: {' and '.join(new)}, with which {left_text(verdict.after)} is left."
    if verdict.effects:
        changed = " and ".join(effect.name for effect in verdict.effects)
        return f"{text}. Found: another {changed}."
    return f"{text}."


def notes(verdict: MaterialVerdict) -> tuple[str, ...]:
    """What limits the verdict: how errors were read, what the table cannot tell, which rows it hangs on."""
    return (
        *_reading(verdict),
        *_consistency(verdict),
        *_amplitude(verdict.table),
        *_floor(verdict),
        *_left_out(verdict),
        *_rivals(verdict),
        *_robot(verdict),
    )


def left_text(model: Model) -> str:
    """``chi-squared 59.9 of 10 (p = 3.9e-09)``: of so many degrees of freedom."""
    return f"chi-squared {model.chi_squared:.4g} of {model.freedom} ({p_text(model.p_value)})"


def p_text(p_value: float) -> str:
    """A p value; one below what a float holds as a bound."""
    return f"p < {SMALLEST_P:g}" if p_value < SMALLEST_P else f"p = {p_value:.2g}"


def _reading(verdict: MaterialVerdict) -> Iterator[str]:
    options = verdict.options
    many = "one standard deviation" if options.coverage == 1.0 else f"{options.coverage:g} standard deviations"
    common = f", {options.shared:.0%} of each variance common to all rows" if options.shared else ", rows independent"
    yield f"fitted: {verdict.pair[0]} and {verdict.pair[1]}, uncertainties read as {many}{common}"


def _consistency(verdict: MaterialVerdict) -> Iterator[str]:
    for check in disagreements(verdict.checks):
        yield (
            f"{check.frequency:g} Hz: {check.column} is written {check.written:.4g}, "
            f"{check.formula} gives {check.recomputed:.4g} ({check.agreement})"
        )
    columns = dict.fromkeys(check.column for check in understated(verdict.checks))
    for column in columns:
        of_column = [check for check in understated(verdict.checks) if check.column == column]
        rows = ", ".join(dict.fromkeys(f"{check.frequency:g}" for check in of_column))
        yield f"the uncertainty of {column} is written smaller than its inputs' give, at {rows} Hz"


def _amplitude(table: MaterialTable) -> Iterator[str]:
    if not all("strain_amplitude" in row.quantities for row in table.rows):
        return
    amplitude = np.array([row.quantities["strain_amplitude"].value for row in table.rows])
    frequency = [row.frequency for row in table.rows]
    if np.ptp(amplitude) > 0.0 and np.ptp(frequency) > 0.0:
        rank = float(spearmanr(frequency, amplitude).statistic)
        if abs(rank) >= TOGETHER:
            way = "rises" if rank > 0.0 else "falls"
            yield (
                f"the strain amplitude {way} with frequency, {amplitude.min():.2g} to {amplitude.max():.2g}: "
                "what amplitude does looks here like what frequency does"
            )


def _floor(verdict: MaterialVerdict) -> Iterator[str]:
    """Even with no branch counted as a free parameter."""
    freedom = verdict.seen.number_count - 2
    p_value = float(chi2.sf(verdict.floor, freedom))
    if p_value < verdict.options.alpha:
        yield (
            f"damping with any number of branches leaves at least chi-squared {verdict.floor:.4g} of {freedom} "
            f"({p_text(p_value)}): no passive linear solid gives these rows within their uncertainties"
        )


def _left_out(verdict: MaterialVerdict) -> Iterator[str]:
    constant, chosen = verdict.model("constant").leave_out, verdict.after.leave_out
    if constant is None or chosen is None:
        return
    most = max(fit.p_value for fit in constant.rest)
    if verdict.model("constant").p_value < verdict.options.alpha:
        which = "whichever row is left out" if most < verdict.options.alpha else "only with all rows"
        yield f"a constant pair is refuted {which}: at most {p_text(most)} without one"
    outside = [row for row in range(len(chosen.inside)) if not chosen.inside[row]]
    worst = [row for row in outside if chosen.chi_squared[row] > float(chi2.isf(verdict.options.alpha, 2))]
    if worst:
        rows = _listed(f"{verdict.seen.frequency[row]:g}" for row in worst)
        yield f"the rows at {rows} Hz are not predicted by the others: do not extrapolate beyond the table"


def _rivals(verdict: MaterialVerdict) -> Iterator[str]:
    for model in verdict.models:
        if model.role != "rival":
            continue
        delay = [estimate for estimate in model.estimates if estimate.effect == "sensor_delay"]
        reason = ""
        if delay:
            reason = f": a delay of {1e3 * delay[0].value:.3g} ms between the test's channels would pass for damping"
        elif model.material.friction:
            reason = f": dry friction of {model.material.friction / 1e6:.3g} MPa at all amplitudes does as well"
        yield f"as good: {model.label}, {left_text(model)}{reason}"


def _robot(verdict: MaterialVerdict) -> Iterator[str]:
    robot = verdict.model("robot")
    static = ", static rows included" if verdict.table.static else ""
    yield f"robot files hold {robot.label}{static}: {left_text(robot)}"
    for check in verdict.static_checks:
        if check.role == "relaxation":
            low, high = check.predicted.low / 1e9, check.predicted.high / 1e9
            yield (
                f"static test, not fitted: {check.measured / 1e9:.4g} +- {check.uncertainty / 1e9:.2g} GPa; relaxation "
                f"alone expects {check.predicted.value / 1e9:.4g} GPa ({low:.3g} to {high:.3g})"
            )


def _listed(words: Iterable[str]) -> str:
    known: Sequence[str] = tuple(words)
    return known[0] if len(known) == 1 else f"{', '.join(known[:-1])} and {known[-1]}"
