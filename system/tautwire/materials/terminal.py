"""The verdict on a rope as terminal tables that need neither colour nor more than 80 columns."""

from __future__ import annotations

from rich import box
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ..errors import one_line
from ..report.units import format_significant
from .verdict import Estimate, MaterialVerdict, Role
from .wording import MODEL_TITLES, p_value_text, verdict_notes, verdict_sentence

GIGA = 1e9
TABULATED_ROLES: tuple[Role, ...] = ("declared", "constant", "relaxation", "chosen")


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
        cells = [f"{assumption.outcomes[role][0]:.1f} ({assumption.outcomes[role][2]:.1g})" for role in roles]
        table.add_row(assumption.label, *cells)
    return table
