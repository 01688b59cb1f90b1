"""The verdict on a rope as text: one sentence, notes, and tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from rich import box
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text
from scipy.stats import chi2, spearmanr

from ..errors import one_line
from ..number_format import format_significant
from .material_table import MaterialTable
from .material_verdict import Estimate, EvaluatedModel, MaterialVerdict, Role
from .table_consistency import disagreements, understated_uncertainties

MIN_PRINTED_P_VALUE = 1e-300
# Rank correlation from which on two columns of a table count as collinear.
COLLINEAR_RANK_CORRELATION = 0.9
ADDED_EFFECTS = ("relaxation", "hysteresis")
MODEL_TITLES: dict[Role, str] = {
    "declared": "declared",
    "constant": "best constant pair",
    "relaxation": "relaxation alone",
    "chosen": "chosen",
    "rival": "as good",
    "robot": "for robot files",
}

GIGA = 1e9
TABULATED_ROLES: tuple[Role, ...] = ("declared", "constant", "relaxation", "chosen")


def verdict_sentence(verdict: MaterialVerdict) -> str:
    """The verdict in one or two sentences."""
    constant = verdict.model("constant")
    refuted = constant.p_value < verdict.options.significance_level
    opening = f"A constant pair of modulus and damping is {'rejected' if refuted else 'adequate'}: the best one has"
    text = f"{opening} {chi_squared_text(constant)}"
    if verdict.reference_model.role == "declared":
        text += f", the declared rope {chi_squared_text(verdict.reference_model)}"
    if verdict.verdict == "unexplained":
        return (
            f"{text}. No model here is adequate: {verdict.chosen_model.label} has "
            f"{chi_squared_text(verdict.chosen_model)}."
        )
    added_effects = sorted((effect.name for effect in verdict.effects if effect.name in ADDED_EFFECTS), reverse=True)
    if added_effects:
        return f"{text}. Identified: {' and '.join(added_effects)}, with {chi_squared_text(verdict.chosen_model)}."
    if verdict.effects:
        changed = " and ".join(effect.name for effect in verdict.effects)
        return f"{text}. Identified: another {changed}."
    return f"{text}."


def verdict_notes(verdict: MaterialVerdict) -> tuple[str, ...]:
    """Notes on what limits the verdict: how errors were read, what the table cannot tell, which rows it depends on."""
    return (
        *_uncertainty_notes(verdict),
        *_consistency_notes(verdict),
        *_amplitude_notes(verdict.table),
        *_relaxation_floor_notes(verdict),
        *_cross_validation_notes(verdict),
        *_confusable_model_notes(verdict),
        *_robot_model_notes(verdict),
    )


def chi_squared_text(model: EvaluatedModel) -> str:
    """Chi-squared of a model with its degrees of freedom: ``chi-squared 59.9 of 10 (p = 3.9e-09)``."""
    return f"chi-squared {model.chi_squared:.4g} of {model.degrees_of_freedom} ({p_value_text(model.p_value)})"


def p_value_text(p_value: float) -> str:
    """A p value as text; one below what a float holds as a bound."""
    return f"p < {MIN_PRINTED_P_VALUE:g}" if p_value < MIN_PRINTED_P_VALUE else f"p = {p_value:.2g}"


def _uncertainty_notes(verdict: MaterialVerdict) -> Iterator[str]:
    options = verdict.options
    coverage_text = (
        "one standard deviation"
        if options.coverage_factor == 1.0
        else f"{options.coverage_factor:g} standard deviations"
    )
    shared_text = (
        f", {options.shared_variance:.0%} of each variance common to all rows"
        if options.shared_variance
        else ", rows independent"
    )
    yield f"fitted: {verdict.pair[0]} and {verdict.pair[1]}, uncertainties read as {coverage_text}{shared_text}"


def _consistency_notes(verdict: MaterialVerdict) -> Iterator[str]:
    for check in disagreements(verdict.consistency_checks):
        yield (
            f"{check.frequency:g} Hz: {check.column} is written {check.written:.4g}, "
            f"{check.formula} gives {check.recomputed:.4g} ({check.agreement})"
        )
    columns = dict.fromkeys(check.column for check in understated_uncertainties(verdict.consistency_checks))
    for column in columns:
        of_column = [check for check in understated_uncertainties(verdict.consistency_checks) if check.column == column]
        rows = ", ".join(dict.fromkeys(f"{check.frequency:g}" for check in of_column))
        yield f"the uncertainty of {column} is smaller than the uncertainties of its inputs imply, at {rows} Hz"


def _amplitude_notes(table: MaterialTable) -> Iterator[str]:
    if not all("strain_amplitude" in row.quantities for row in table.rows):
        return
    amplitude = np.array([row.quantities["strain_amplitude"].value for row in table.rows])
    frequency = [row.frequency for row in table.rows]
    if np.ptp(amplitude) > 0.0 and np.ptp(frequency) > 0.0:
        rank_correlation = float(spearmanr(frequency, amplitude).statistic)
        if abs(rank_correlation) >= COLLINEAR_RANK_CORRELATION:
            direction = "rises" if rank_correlation > 0.0 else "falls"
            yield (
                f"the strain amplitude {direction} with frequency, {amplitude.min():.2g} to {amplitude.max():.2g}: "
                "effects of amplitude and frequency cannot be separated"
            )


def _relaxation_floor_notes(verdict: MaterialVerdict) -> Iterator[str]:
    """Note that relaxation is rejected, even with no branch counted as a free parameter."""
    degrees_of_freedom = verdict.observations.measurement_count - 2
    p_value = float(chi2.sf(verdict.relaxation_floor, degrees_of_freedom))
    if p_value < verdict.options.significance_level:
        yield (
            f"damping with any number of branches has at least chi-squared {verdict.relaxation_floor:.4g} of "
            f"{degrees_of_freedom} "
            f"({p_value_text(p_value)}): no passive linear solid gives these rows within their uncertainties"
        )


def _cross_validation_notes(verdict: MaterialVerdict) -> Iterator[str]:
    constant, chosen = verdict.model("constant").cross_validation, verdict.chosen_model.cross_validation
    if constant is None or chosen is None:
        return
    max_p_value = max(fit.p_value for fit in constant.fits)
    if verdict.model("constant").p_value < verdict.options.significance_level:
        condition = (
            "whichever row is left out" if max_p_value < verdict.options.significance_level else "only with all rows"
        )
        yield f"a constant pair is rejected {condition}: at most {p_value_text(max_p_value)} without one"
    extrapolated = [row for row in range(len(chosen.is_interpolated)) if not chosen.is_interpolated[row]]
    unpredicted = [
        row for row in extrapolated if chosen.chi_squared[row] > float(chi2.isf(verdict.options.significance_level, 2))
    ]
    if unpredicted:
        rows = _joined(f"{verdict.observations.frequency[row]:g}" for row in unpredicted)
        yield f"the rows at {rows} Hz are not predicted by the others: do not extrapolate beyond the table"


def _confusable_model_notes(verdict: MaterialVerdict) -> Iterator[str]:
    for model in verdict.models:
        if model.role != "rival":
            continue
        delay = [estimate for estimate in model.estimates if estimate.effect == "sensor_delay"]
        reason = ""
        if delay:
            reason = f": a delay of {1e3 * delay[0].value:.3g} ms between the test's channels would look like damping"
        elif model.material.friction_stress:
            reason = f": dry friction of {model.material.friction_stress / 1e6:.3g} MPa at all amplitudes does as well"
        yield f"as good: {model.label}, {chi_squared_text(model)}{reason}"


def _robot_model_notes(verdict: MaterialVerdict) -> Iterator[str]:
    robot = verdict.model("robot")
    static = ", static rows included" if verdict.table.static_rows else ""
    yield f"robot files hold {robot.label}{static}: {chi_squared_text(robot)}"
    for check in verdict.static_checks:
        if check.role == "relaxation":
            low, high = check.predicted.low / 1e9, check.predicted.high / 1e9
            yield (
                f"static test, not fitted: {check.measured / 1e9:.4g} +- {check.uncertainty / 1e9:.2g} GPa; relaxation "
                f"alone expects {check.predicted.value / 1e9:.4g} GPa ({low:.3g} to {high:.3g})"
            )


def _joined(words: Iterable[str]) -> str:
    items: Sequence[str] = tuple(words)
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def material_verdict_table(verdict: MaterialVerdict) -> RenderableType:
    """The verdict of a dynamic test, for a rich console."""
    points = [Padding(Text(f"- {one_line(note)}"), (0, 0, 0, 2)) for note in verdict_notes(verdict)]
    return Group(
        Text(f"{verdict.verdict}: {one_line(verdict_sentence(verdict))}\n", style="bold"),
        _model_table(verdict),
        _residual_tables(verdict),
        _parameter_table(verdict),
        _assumption_table(verdict),
        Text("Notes", style="bold"),
        *points,
    )


def _new_table(title: str, headings: tuple[str, ...], text_columns: int = 1) -> Table:
    """A table whose first ``text_columns`` columns hold text and the others numbers."""
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE, pad_edge=False)
    for index, heading in enumerate(headings):
        is_text = index < text_columns
        table.add_column(heading, justify="left" if is_text else "right", overflow="fold", no_wrap=not is_text)
    return table


def _model_table(verdict: MaterialVerdict) -> Table:
    table = _new_table("Models beside the table", ("model", "chi-sq.", "free", "p", "BIC", "left out", "inside"))
    for model in verdict.models:
        cross_validation = model.cross_validation
        table.add_row(
            f"{MODEL_TITLES[model.role]}: {model.label}",
            format_significant(model.chi_squared, 4),
            str(model.degrees_of_freedom),
            p_value_text(model.p_value).removeprefix("p = ").removeprefix("p "),
            f"{model.bic:.1f}",
            format_significant(cross_validation.total_chi_squared if cross_validation else None),
            format_significant(cross_validation.interpolated_chi_squared if cross_validation else None),
        )
    table.caption = "left out: chi-squared of rows predicted from the others; inside: of those not extrapolated"
    table.caption_justify = "left"
    return table


def _residual_tables(verdict: MaterialVerdict) -> Group:
    """Model less measured in standard deviations, of storage modulus and damping."""
    models = [model for model in verdict.models if model.role in TABULATED_ROLES]
    observations = verdict.observations
    columns = (
        (
            "E'",
            "GPa",
            observations.storage,
            observations.storage_uncertainty,
            [model.storage_residuals for model in models],
        ),
        (
            "c",
            "GPa s",
            observations.damping,
            observations.damping_uncertainty,
            [model.damping_residuals for model in models],
        ),
    )
    tables = []
    for symbol, unit, measured, uncertainty, residuals in columns:
        headings = ("Hz", f"{symbol} measured", *(MODEL_TITLES[model.role].replace(" ", "\n", 1) for model in models))
        table = _new_table(f"{symbol}: measured, {unit}, and model less measured, in sigmas", headings, text_columns=0)
        for row in range(observations.row_count):
            value, sigma = measured[row] / GIGA, uncertainty[row] / GIGA
            cells = [f"{each[row]:+.2f}" for each in residuals]
            table.add_row(
                f"{observations.frequency[row]:g}",
                f"{format_significant(value, 4)} ± {format_significant(sigma, 2)}",
                *cells,
            )
        tables.append(table)
    return Group(*tables)


def _parameter_table(verdict: MaterialVerdict) -> Table:
    table = _new_table("Parameters, with 95 % intervals", ("model", "parameter", "unit", "value", "from", "to"), 3)
    for role in ("chosen", "robot"):
        title = MODEL_TITLES[role]
        for estimate in verdict.model(role).estimates:
            low = f"({format_significant(estimate.low)})" if estimate.low_is_open else format_significant(estimate.low)
            high = (
                f"({format_significant(estimate.high)})" if estimate.high_is_open else format_significant(estimate.high)
            )
            table.add_row(
                title, _parameter_name(estimate), estimate.unit, format_significant(estimate.value, 4), low, high
            )
            title = ""
    return table


def _parameter_name(estimate: Estimate) -> str:
    """Name of a parameter: ``relaxation.time``, but ``modulus`` where effect and parameter have the same name."""
    return estimate.name if estimate.name == estimate.effect else f"{estimate.effect}.{estimate.name}"


def _assumption_table(verdict: MaterialVerdict) -> Table:
    roles: tuple[Role, ...] = ("constant", "relaxation", "chosen")
    table = _new_table(
        "Chi-squared (p) under other readings of the errors", ("reading", *(MODEL_TITLES[r] for r in roles))
    )
    for assumption in verdict.error_assumptions:
        outcomes = [assumption.outcomes[role] for role in roles]
        cells = [f"{each.chi_squared:.1f} ({each.p_value:.1g})" for each in outcomes]
        table.add_row(assumption.label, *cells)
    return table
