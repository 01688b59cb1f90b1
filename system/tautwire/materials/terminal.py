"""A verdict on a rope on the terminal: tables that need neither colour nor more than 80 columns."""

from __future__ import annotations

from rich import box
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ..errors import one_line
from ..report.units import significant
from .verdict import Estimate, MaterialVerdict, Role
from .wording import TITLES, notes, p_text, sentence

GIGA = 1e9
SHOWN: tuple[Role, ...] = ("declared", "constant", "relaxation", "chosen")


def material_table(verdict: MaterialVerdict) -> RenderableType:
    """What a table of a dynamic test says, for a rich console."""
    points = [Padding(Text(f"- {one_line(note)}"), (0, 0, 0, 2)) for note in notes(verdict)]
    return Group(
        Text(f"{verdict.verdict}: {one_line(sentence(verdict))}\n", style="bold"),
        _models(verdict),
        _rows(verdict),
        _found(verdict),
        _readings(verdict),
        Text("Notes", style="bold"),
        *points,
    )


def _new_table(title: str, headings: tuple[str, ...], words: int = 1) -> Table:
    """A table whose first ``words`` columns hold text and the others numbers."""
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE, pad_edge=False)
    for place, heading in enumerate(headings):
        text = place < words
        table.add_column(heading, justify="left" if text else "right", overflow="fold", no_wrap=not text)
    return table


def _models(verdict: MaterialVerdict) -> Table:
    table = _new_table("Models beside the table", ("model", "chi-sq.", "free", "p", "BIC", "left out", "inside"))
    for model in verdict.models:
        left_out = model.leave_out
        table.add_row(
            f"{TITLES[model.role]}: {model.label}",
            significant(model.chi_squared, 4),
            str(model.freedom),
            p_text(model.p_value).removeprefix("p = ").removeprefix("p "),
            f"{model.bic:.1f}",
            significant(left_out.total if left_out else None),
            significant(left_out.total_inside if left_out else None),
        )
    table.caption = "left out: chi-squared of rows predicted from the others; inside: of those not extrapolated"
    table.caption_justify = "left"
    return table


def _rows(verdict: MaterialVerdict) -> Group:
    """Model less measured in standard deviations, of storage modulus and damping."""
    models = [model for model in verdict.models if model.role in SHOWN]
    seen = verdict.seen
    columns = (
        ("E'", "GPa", seen.storage, seen.storage_uncertainty, [model.storage_sigmas for model in models]),
        ("c", "GPa s", seen.damping, seen.damping_uncertainty, [model.damping_sigmas for model in models]),
    )
    tables = []
    for symbol, unit, measured, uncertainty, sigmas in columns:
        headings = ("Hz", f"{symbol} measured", *(TITLES[model.role].replace(" ", "\n", 1) for model in models))
        table = _new_table(f"{symbol}: measured, {unit}, and model less measured, in sigmas", headings, words=0)
        for row in range(seen.row_count):
            value, sigma = measured[row] / GIGA, uncertainty[row] / GIGA
            cells = [f"{each[row]:+.2f}" for each in sigmas]
            table.add_row(f"{seen.frequency[row]:g}", f"{significant(value, 4)} ± {significant(sigma, 2)}", *cells)
        tables.append(table)
    return Group(*tables)


def _found(verdict: MaterialVerdict) -> Table:
    table = _new_table("Parameters, with 95 % intervals", ("model", "parameter", "unit", "value", "from", "to"), 3)
    for role in ("chosen", "robot"):
        title = TITLES[role]
        for estimate in verdict.model(role).estimates:
            low = f"({significant(estimate.low)})" if estimate.low_is_open else significant(estimate.low)
            high = f"({significant(estimate.high)})" if estimate.high_is_open else significant(estimate.high)
            table.add_row(title, _name(estimate), estimate.unit, significant(estimate.value, 4), low, high)
            title = ""
    return table


def _name(estimate: Estimate) -> str:
    """``relaxation.time``, but ``modulus`` where effect and parameter are called alike."""
    return estimate.name if estimate.name == estimate.effect else f"{estimate.effect}.{estimate.name}"


def _readings(verdict: MaterialVerdict) -> Table:
    roles: tuple[Role, ...] = ("constant", "relaxation", "chosen")
    table = _new_table("Chi-squared (p) under other readings of the errors", ("reading", *(TITLES[r] for r in roles)))
    for assumption in verdict.assumptions:
        cells = [f"{assumption.outcomes[role][0]:.1f} ({assumption.outcomes[role][2]:.1g})" for role in roles]
        table.add_row(assumption.label, *cells)
    return table
