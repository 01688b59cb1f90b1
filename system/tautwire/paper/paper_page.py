"""The ledger of claims with its figures as one HTML page that needs no network."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from ..reports.html_markup import TableColumn, download_links, escape_text, html_page, number_html, section, table
from .figure_style import BACKGROUND_COLOUR, TEXT_COLOUR, PaperFigure
from .open_claims import OpenClaim
from .paper_claims import ClaimNumber, ClaimVerdict, LedgerEntry
from .paper_extensions import ExtensionFigure
from .paper_parameters import DATA_FOLDER

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
LEDGER_COLUMNS = (
    TableColumn("Claim"),
    TableColumn("Paper", True),
    TableColumn("As printed", True),
    TableColumn("Corrected", True),
    TableColumn("Verdict"),
    TableColumn("Why", wide=True),
)
# pt, width up to which a narrow screen shows a whole figure; wider ones scroll.
MAX_NARROW_WIDTH = 400.0
# Groups of claims listed separately from those of the text, by the prefix of their ids.
SEPARATE_CLAIMS = {"axis.": "Axes of the figures", "table_1.": "Table 1"}
EXPONENT, POWER_OF_TEN = re.compile(r"\^(-?\d+)"), re.compile(r"(?<=\d)e(\d+)\b")
SVG_ID_REFERENCE = re.compile(r'(?<=\bid=")|(?<=url\(#)|(?<=href="#)')


@dataclass(frozen=True)
class PageContent:
    """Content of the page; ``svg_texts`` are the figures' SVG texts by name."""

    entries: Sequence[LedgerEntry]
    figures: Sequence[PaperFigure]
    svg_texts: Mapping[str, str]
    open_claims: Sequence[OpenClaim]
    extensions: Sequence[ExtensionFigure]


def paper_page(content: PageContent, links: Mapping[str, str]) -> str:
    """The page as HTML; ``links`` maps labels to files beside it."""
    css = (DATA_FOLDER / "page.css").read_text(encoding="utf-8")
    figures = {each.name: _figure_html(each, content.svg_texts[each.name]) for each in content.figures}
    parts = [f"<style>{css}</style>", _masthead_html(content, links)]
    for section_number, title in SECTION_TITLES.items():
        section_figures = _figures_html(figures, SECTION_FIGURES.get(section_number, ()), content.svg_texts)
        parts.append(
            section(
                f"section-{section_number}",
                title,
                section_figures + _ledger_html(content.entries, section_number, title),
            )
        )
    parts.append(
        section("tried", "What was tried", "".join(map(_open_claim_html, content.open_claims)), OPEN_CLAIMS_LEAD)
    )
    extensions = "".join(
        f"<h3>{escape_text(each.figure.title)}</h3><p "
        f'class="paragraph">{prose_html(each.paragraph)}</p>{figures[each.figure.name]}'
        for each in content.extensions
    )
    parts.append(section("beyond", "Beyond the paper", extensions))
    return html_page("The paper, claim by claim", "\n".join(parts))


OPEN_CLAIMS_LEAD = (
    "Claims that the parameters above leave open, each with the readings that were tried. All numbers are of this run; "
    "the first row is the paper's."
)
PAGE_LEAD = (
    "Baklouti, Courteille, Caro and Dkhil (2017), doi:10.1115/1.4038068. Every number that the text claims, Table 1 "
    "and the axes of its figures, beside what co-simulated FMUs give with the parameters as printed, and with those "
    "that give the printed figures. A number agrees that rounds, or is cut off, to the printed digits, or lies within "
    "a tolerance that the row names. With the printed parameters it only counts where the motion itself is the "
    "paper's. Settings of a run, such as its masses and speeds, are no claims: they are the parameters."
)


def _masthead_html(content: PageContent, links: Mapping[str, str]) -> str:
    counts = Counter(entry.verdict for entry in content.entries)
    counts_text = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICT_NAMES)
    rows = []
    for section_number, title in SECTION_TITLES.items():
        section_counts = Counter(entry.verdict for entry in content.entries if entry.claim.section == section_number)
        cells = (number_html(str(section_counts[verdict])) for verdict in VERDICT_NAMES)
        rows.append([f'<a href="#section-{section_number}">{escape_text(title)}</a>', *cells])
    columns = (TableColumn("Section"), *(TableColumn(verdict.capitalize(), True) for verdict in VERDICT_NAMES))
    return (
        '<header><p class="eyebrow"><strong>Tautwire paper</strong> <span>the paper, claim by claim</span></p>'
        f"<h1>{escape_text(f'{len(content.entries)} claims: {counts_text}')}</h1>"
        f'<p class="aside">{escape_text(PAGE_LEAD)}</p>{download_links(links)}</header>'
        + section("overview", "By section", table("Verdicts by section", columns, rows, "counts", caption_hidden=True))
    )


def _ledger_html(entries: Sequence[LedgerEntry], section_number: str, title: str) -> str:
    """Claims of a section's text; those of its figures' axes and of Table 1 folded."""
    section_entries = [entry for entry in entries if entry.claim.section == section_number]
    groups: dict[str, list[LedgerEntry]] = {"": []}
    for entry in section_entries:
        kind = next((name for prefix, name in SEPARATE_CLAIMS.items() if entry.claim.id.startswith(prefix)), "")
        groups.setdefault(kind, []).append(entry)
    html = table(
        f"Claims of section {title}",
        LEDGER_COLUMNS,
        [_entry_row(each) for each in groups.pop("")],
        "ledger",
        caption_hidden=True,
    )
    for name, rows in groups.items():
        counts = Counter(entry.verdict for entry in rows)
        counts_text = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICT_NAMES if counts[verdict])
        content = table(
            f"{name}, section {title}",
            LEDGER_COLUMNS,
            [_entry_row(each) for each in rows],
            "ledger",
            caption_hidden=True,
        )
        html += f"<details><summary>{escape_text(name)}: {escape_text(counts_text)}</summary>{content}</details>"
    return html


def _entry_row(entry: LedgerEntry) -> list[str]:
    claim = entry.claim
    unit = "" if claim.unit == "1" else f' <span class="unit">{escape_text(claim.unit)}</span>'
    verdict = f'<span class="is is-{VERDICT_NAMES[entry.verdict]}">{escape_text(entry.verdict)}</span>'
    numbers = [number_html(number_text(each)) for each in (entry.printed, entry.corrected)]
    quantity = claim.quantity[0].upper() + claim.quantity[1:]
    return [
        prose_html(quantity),
        number_html(_claimed_value(entry)) + unit,
        *numbers,
        verdict,
        prose_html(entry.explanation),
    ]


def prose_html(value: str) -> str:
    """A text as HTML with superscript exponents."""
    scaled = POWER_OF_TEN.sub(r"&nbsp;&times;&nbsp;10<sup>\1</sup>", escape_text(value))
    return EXPONENT.sub(r"<sup>\1</sup>", scaled).replace(" %", "&nbsp;%")


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


def _open_claim_html(open_claim: OpenClaim) -> str:
    columns = (TableColumn(open_claim.columns[0]), *(TableColumn(title, True) for title in open_claim.columns[1:]))
    rows = [[prose_html(label), *map(number_html, cells)] for label, cells in open_claim.rows]
    lead = f'<p class="paragraph">{prose_html(open_claim.lead)}</p>'
    return f"<h3>{escape_text(open_claim.title)}</h3>{lead}" + table(
        open_claim.title, columns, rows, "tried", caption_hidden=True
    )


def _figures_html(figures: Mapping[str, str], names: Sequence[str], svg_texts: Mapping[str, str]) -> str:
    """Figures one after the other, narrow ones side by side."""
    html = ""
    for is_narrow, group in groupby(names, key=lambda name: inline_svg(svg_texts[name], name)[1] <= MAX_NARROW_WIDTH):
        group_html = "".join(figures[name] for name in group)
        html += f'<div class="pair">{group_html}</div>' if is_narrow else group_html
    return html


def _figure_html(paper_figure: PaperFigure, svg: str) -> str:
    svg_html, width = inline_svg(svg, paper_figure.name)
    scroll_attributes = ' class="wide" tabindex="0"' if width > MAX_NARROW_WIDTH else ""
    return (
        '<figure class="drawn" '
        f'id="{paper_figure.name}"><figcaption><strong>{escape_text(paper_figure.title)}</strong></figcaption>'
        f'<div{scroll_attributes} role="img" '
        f'aria-label="{escape_text(paper_figure.description)}">{svg_html}</div></figure>'
    )


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
