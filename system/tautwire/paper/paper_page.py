"""The ledger of claims with its figures as one HTML page that needs no network."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from ..provenance import Provenance
from ..reports.page_rendering import Label, Number, PageHeader, Prose, Row, SectionLink, render_page
from .figure_style import BACKGROUND_COLOUR, TEXT_COLOUR, PaperFigure
from .open_claims import OpenClaim
from .paper_claims import ClaimNumber, ClaimVerdict, LedgerEntry
from .paper_extensions import ExtensionFigure

SECTION_TITLES = {
    "2.2": "2.2 The model's assumptions",
    "3.1": "3.1 Modulus of elasticity",
    "3.2": "3.2 Dynamic modulus",
    "4.1.1": "4.1.1 Three cables, both laws",
    "4.1.2": "4.1.2 CAROCA and FAST",
    "4.2": "4.2 Dynamic stiffening",
    "4.3": "4.3 Damping",
}
# Figures by section; the others are beyond the paper.
SECTION_FIGURES = {
    "3.1": ("fig_03",),
    "3.2": ("fig_04",),
    "4.1.1": ("fig_05a", "fig_05", "fig_06", "fig_07", "fig_08"),
    "4.1.2": ("fig_09", "fig_10", "fig_11"),
    "4.2": ("fig_12", "fig_12b", "fig_13", "fig_14", "fig_15", "fig_16"),
    "4.3": ("fig_17", "fig_18"),
}
VERDICT_NAMES: Mapping[ClaimVerdict, str] = {
    "reproduced": "reproduced",
    "reproduced after correction": "corrected",
    "not reproducible": "not",
}
# pt, width up to which a narrow screen shows a whole figure; wider ones scroll.
MAX_NARROW_WIDTH = 400.0
# Groups of claims listed separately from those of the text, by the prefix of their ids.
SEPARATE_CLAIMS = {"axis.": "Axes of the figures", "table_1.": "Table 1"}
SVG_ID_REFERENCE = re.compile(r'(?<=\bid=")|(?<=url\(#)|(?<=href="#)')


@dataclass(frozen=True)
class PageContent:
    """Content of the page; ``svg_texts`` are the figures' SVG texts by name."""

    entries: Sequence[LedgerEntry]
    figures: Sequence[PaperFigure]
    svg_texts: Mapping[str, str]
    open_claims: Sequence[OpenClaim]
    extensions: Sequence[ExtensionFigure]


@dataclass(frozen=True)
class DrawnFigure:
    """A figure of the page with its SVG; a narrow screen shows it whole where it is narrow."""

    name: str
    title: str
    description: str
    svg: str
    is_narrow: bool


@dataclass(frozen=True)
class FoldedClaims:
    """Claims that are folded away under their name, with the counts of their verdicts."""

    name: str
    counts: str
    rows: Sequence[Row]


@dataclass(frozen=True)
class PaperSection:
    """A section of the paper: its figures in groups of narrow or wide ones, and its claims."""

    number: str
    title: str
    figure_groups: Sequence[tuple[bool, Sequence[DrawnFigure]]]
    claims: Sequence[Row]
    folded_claims: Sequence[FoldedClaims]


def paper_page(content: PageContent, links: Mapping[str, str], provenance: Provenance | None = None) -> str:
    """The page as HTML; ``links`` maps labels to files beside it."""
    headline = f"{len(content.entries)} claims: {_verdict_counts(content.entries, VERDICT_NAMES)}"
    title = "the paper, claim by claim"
    figures = {each.name: _drawn_figure(each, content.svg_texts[each.name]) for each in content.figures}
    return render_page(
        "paper",
        PageHeader("Tautwire paper", title, headline, title.capitalize(), links=links, provenance=provenance),
        verdict_columns=["Section", *((verdict.capitalize(), "number") for verdict in VERDICT_NAMES)],
        overview=_overview_rows(content.entries),
        parts=[_paper_section(number, content.entries, figures) for number in SECTION_TITLES],
        open_claims=[_open_claim_view(each) for each in content.open_claims],
        extensions=[(figures[each.figure.name], each.paragraph) for each in content.extensions],
    )


def _verdict_counts(entries: Sequence[LedgerEntry], verdicts: Iterable[ClaimVerdict]) -> str:
    counts = Counter(entry.verdict for entry in entries)
    return ", ".join(f"{counts[verdict]} {verdict}" for verdict in verdicts)


def _overview_rows(entries: Sequence[LedgerEntry]) -> list[Row]:
    """Counts of the verdicts in each section."""
    rows: list[Row] = []
    for number, title in SECTION_TITLES.items():
        counts = Counter(entry.verdict for entry in entries if entry.claim.section == number)
        cells = (Number(str(counts[verdict])) for verdict in VERDICT_NAMES)
        rows.append([SectionLink(title, f"section-{number}"), *cells])
    return rows


def _paper_section(number: str, entries: Sequence[LedgerEntry], figures: Mapping[str, DrawnFigure]) -> PaperSection:
    """Claims of a section's text; those of its figures' axes and of Table 1 folded."""
    groups: dict[str, list[LedgerEntry]] = {"": []}
    for entry in entries:
        if entry.claim.section == number:
            kind = next((name for prefix, name in SEPARATE_CLAIMS.items() if entry.claim.id.startswith(prefix)), "")
            groups.setdefault(kind, []).append(entry)
    claims = [_entry_row(each) for each in groups.pop("")]
    section_figures = [figures[name] for name in SECTION_FIGURES.get(number, ())]
    figure_groups = [(is_narrow, list(group)) for is_narrow, group in groupby(section_figures, lambda f: f.is_narrow)]
    folded = [_folded_claims(name, group) for name, group in groups.items()]
    return PaperSection(number, SECTION_TITLES[number], figure_groups, claims, folded)


def _folded_claims(name: str, entries: Sequence[LedgerEntry]) -> FoldedClaims:
    verdicts = {entry.verdict for entry in entries}
    counts = _verdict_counts(entries, [verdict for verdict in VERDICT_NAMES if verdict in verdicts])
    return FoldedClaims(name, counts, [_entry_row(each) for each in entries])


def _entry_row(entry: LedgerEntry) -> Row:
    claim = entry.claim
    return [
        Prose(claim.quantity[0].upper() + claim.quantity[1:]),
        Number(_claimed_value(entry), None if claim.unit == "1" else claim.unit),
        Number(number_text(entry.printed)),
        Number(number_text(entry.corrected)),
        Label(entry.verdict, f"is is-{VERDICT_NAMES[entry.verdict]}"),
        Prose(entry.explanation),
    ]


def number_text(value: ClaimNumber | None) -> str:
    """A number of the ledger to four digits, a range as such, a dash for none."""
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return f"{_significant_digits(value[0])} to {_significant_digits(value[1])}"
    return _significant_digits(value)


def _significant_digits(value: float) -> str:
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.4g}" if abs(value) < 1e3 else f"{value:.1f}"


def _claimed_value(entry: LedgerEntry) -> str:
    signs = {"below": "< ", "above": "> "}
    return signs.get(entry.claim.rule, "") + (entry.claim.printed_digits or number_text(entry.claim.paper_value))


def _open_claim_view(open_claim: OpenClaim) -> dict[str, Any]:
    return {
        "title": open_claim.title,
        "lead": open_claim.lead,
        "columns": [open_claim.columns[0], *((title, "number") for title in open_claim.columns[1:])],
        "rows": [[Prose(label), *map(Number, cells)] for label, cells in open_claim.rows],
    }


def _drawn_figure(figure: PaperFigure, svg: str) -> DrawnFigure:
    text, width = inline_svg(svg, figure.name)
    return DrawnFigure(figure.name, figure.title, figure.description, text, width <= MAX_NARROW_WIDTH)


def inline_svg(svg: str, name: str) -> tuple[str, float]:
    """An SVG for embedding, without prologue, with unique ids and the page's colours; and its width in pt."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"\s*<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    # A style element inside would apply to the whole page.
    body = re.sub(r"\s*<defs>\s*<style[^>]*>.*?</style>\s*</defs>", "", body, count=1, flags=re.DOTALL)
    body = SVG_ID_REFERENCE.sub(f"{name}-", body)
    body = body.replace(TEXT_COLOUR, "currentColor").replace(f"fill: {BACKGROUND_COLOUR}", "fill: none")
    size = re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', body)
    if size is None:
        raise ValueError(f"{name} is no SVG with a size")
    width = float(size.group(1))
    attributes = f'aria-hidden="true" style="max-width: {1.6 * width:.0f}px; stroke-linejoin: round"'
    return body.replace(size.group(0), attributes, 1), width
