"""The ledger with its figures as one page that needs no network."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from ..report.markup import Column, downloads, number, section, table, text
from ..report.shell import html_page
from .beyond_figures import Beyond
from .claims import Entry, Number, Verdict
from .parameters import DATA
from .style import INK, PAPER, Drawn
from .tried import Trials

SECTIONS = {
    "2.2": "2.2 The model's assumptions",
    "3.1": "3.1 Modulus of elasticity",
    "3.2": "3.2 Dynamic modulus",
    "4.1.1": "4.1.1 Three cables, both laws",
    "4.1.2": "4.1.2 CAROCA and FAST",
    "4.2": "4.2 Dynamic stiffening",
    "4.3": "4.3 Damping",
}
# Where each figure stands; the others are beyond the paper.
FIGURES = {
    "3.1": ("fig_03",),
    "3.2": ("fig_04",),
    "4.1.1": ("fig_05a", "fig_05", "fig_06", "fig_07", "fig_08"),
    "4.1.2": ("fig_09", "fig_10", "fig_11"),
    "4.2": ("fig_12", "fig_12b", "fig_13", "fig_14", "fig_15", "fig_16"),
    "4.3": ("fig_17", "fig_18"),
}
NAMES: Mapping[Verdict, str] = {
    "reproduced": "reproduced",
    "reproduced after correction": "corrected",
    "not reproducible": "not",
}
LEDGER = (
    Column("Claim"),
    Column("Paper", True),
    Column("As printed", True),
    Column("Corrected", True),
    Column("Verdict"),
    Column("Why", wide=True),
)
# Up to this width a narrow screen shows a figure whole; wider ones scroll.
NARROW = 400.0
# Claims that stand apart from those of the text, by the beginning of their ids.
APART = {"axis.": "Axes of the figures", "table_1.": "Table 1"}
RAISED, POWER_OF_TEN = re.compile(r"\^(-?\d+)"), re.compile(r"(?<=\d)e(\d+)\b")
IDENTITY = re.compile(r'(?<=\bid=")|(?<=url\(#)|(?<=href="#)')


@dataclass(frozen=True)
class Content:
    """What the page is made of; ``svgs`` are the figures' texts by name."""

    entries: Sequence[Entry]
    drawn: Sequence[Drawn]
    svgs: Mapping[str, str]
    trials: Sequence[Trials]
    beyond: Sequence[Beyond]


def paper_page(content: Content, links: Mapping[str, str]) -> str:
    """The page; ``links`` maps labels to files beside it."""
    css = (DATA / "page.css").read_text(encoding="utf-8")
    figures = {each.name: _figure(each, content.svgs[each.name]) for each in content.drawn}
    parts = [f"<style>{css}</style>", _masthead(content, links)]
    for number_, title in SECTIONS.items():
        shown = _figures(figures, FIGURES.get(number_, ()), content.svgs)
        parts.append(section(f"section-{number_}", title, shown + _ledger(content.entries, number_, title)))
    parts.append(section("tried", "What was tried", "".join(map(_trials, content.trials)), TRIED))
    beyond = "".join(
        f'<h3>{text(each.drawn.title)}</h3><p class="paragraph">{prose(each.paragraph)}</p>{figures[each.drawn.name]}'
        for each in content.beyond
    )
    parts.append(section("beyond", "Beyond the paper", beyond))
    return html_page("The paper, claim by claim", "\n".join(parts))


TRIED = (
    "Claims that the parameters above leave open, each with the readings that were tried. All numbers are of this run; "
    "the first row is the paper's."
)
LEAD = (
    "Baklouti, Courteille, Caro and Dkhil (2017), doi:10.1115/1.4038068. Every number that the text claims, Table 1 "
    "and the axes of its figures, beside what co-simulated FMUs give with the parameters as printed, and with those "
    "that give the printed figures. A number agrees that rounds, or is cut off, to the printed digits, or lies within "
    "a tolerance that the row names. With the printed parameters it only counts where the motion itself is the "
    "paper's. Settings of a run, such as its masses and speeds, are no claims: they are the parameters."
)


def _masthead(content: Content, links: Mapping[str, str]) -> str:
    counts = Counter(entry.verdict for entry in content.entries)
    said = ", ".join(f"{counts[verdict]} {verdict}" for verdict in NAMES)
    rows = []
    for number_, title in SECTIONS.items():
        here = Counter(entry.verdict for entry in content.entries if entry.claim.section == number_)
        cells = (number(str(here[verdict])) for verdict in NAMES)
        rows.append([f'<a href="#section-{number_}">{text(title)}</a>', *cells])
    columns = (Column("Section"), *(Column(verdict.capitalize(), True) for verdict in NAMES))
    return (
        '<header><p class="eyebrow"><strong>Tautwire paper</strong> <span>the paper, claim by claim</span></p>'
        f"<h1>{text(f'{len(content.entries)} claims: {said}')}</h1>"
        f'<p class="aside">{text(LEAD)}</p>{downloads(links)}</header>'
        + section("overview", "By section", table("Verdicts by section", columns, rows, "counts", quiet=True))
    )


def _ledger(entries: Sequence[Entry], number_: str, title: str) -> str:
    """The claims of a section's text; those of its figures' axes and of Table 1 on request."""
    here = [entry for entry in entries if entry.claim.section == number_]
    groups: dict[str, list[Entry]] = {"": []}
    for entry in here:
        kind = next((name for prefix, name in APART.items() if entry.claim.id.startswith(prefix)), "")
        groups.setdefault(kind, []).append(entry)
    shown = table(f"Claims of section {title}", LEDGER, [_row(each) for each in groups.pop("")], "ledger", quiet=True)
    for name, rows in groups.items():
        counts = Counter(entry.verdict for entry in rows)
        said = ", ".join(f"{counts[verdict]} {verdict}" for verdict in NAMES if counts[verdict])
        content = table(f"{name}, section {title}", LEDGER, [_row(each) for each in rows], "ledger", quiet=True)
        shown += f"<details><summary>{text(name)}: {text(said)}</summary>{content}</details>"
    return shown


def _row(entry: Entry) -> list[str]:
    claim = entry.claim
    unit = "" if claim.unit == "1" else f' <span class="unit">{text(claim.unit)}</span>'
    verdict = f'<span class="is is-{NAMES[entry.verdict]}">{text(entry.verdict)}</span>'
    shown = [number(written(each)) for each in (entry.printed, entry.corrected)]
    quantity = claim.quantity[0].upper() + claim.quantity[1:]
    return [prose(quantity), number(_asked(entry)) + unit, *shown, verdict, prose(entry.why)]


def prose(value: str) -> str:
    """A text as HTML with its powers raised."""
    scaled = POWER_OF_TEN.sub(r"&nbsp;&times;&nbsp;10<sup>\1</sup>", text(value))
    return RAISED.sub(r"<sup>\1</sup>", scaled).replace(" %", "&nbsp;%")


def written(value: Number | None) -> str:
    """A number of the ledger to four digits, a range as such, a dash for none."""
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return f"{_digits(value[0])} to {_digits(value[1])}"
    return _digits(value)


def _digits(value: float) -> str:
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.4g}" if abs(value) < 1e3 else f"{value:.1f}"


def _asked(entry: Entry) -> str:
    signs = {"below": "< ", "above": "> "}
    return signs.get(entry.claim.rule, "") + (entry.claim.digits or written(entry.claim.paper))


def _trials(trials: Trials) -> str:
    columns = (Column(trials.columns[0]), *(Column(title, True) for title in trials.columns[1:]))
    rows = [[prose(label), *map(number, cells)] for label, cells in trials.rows]
    lead = f'<p class="paragraph">{prose(trials.lead)}</p>'
    return f"<h3>{text(trials.title)}</h3>{lead}" + table(trials.title, columns, rows, "tried", quiet=True)


def _figures(figures: Mapping[str, str], names: Sequence[str], svgs: Mapping[str, str]) -> str:
    """Figures one after the other, narrow ones side by side."""
    shown = ""
    for narrow, group in groupby(names, key=lambda name: inline_svg(svgs[name], name)[1] <= NARROW):
        together = "".join(figures[name] for name in group)
        shown += f'<div class="pair">{together}</div>' if narrow else together
    return shown


def _figure(drawn: Drawn, svg: str) -> str:
    shown, width = inline_svg(svg, drawn.name)
    wide = ' class="wide" tabindex="0"' if width > NARROW else ""
    return (
        f'<figure class="drawn" id="{drawn.name}"><figcaption><strong>{text(drawn.title)}</strong></figcaption>'
        f'<div{wide} role="img" aria-label="{text(drawn.told)}">{shown}</div></figure>'
    )


def inline_svg(svg: str, name: str) -> tuple[str, float]:
    """An SVG as it may stand in a page: no prologue, ids of its own, ink and ground the page's; and its width in pt."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"\s*<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    # A style element inside would hold for the whole page.
    body = re.sub(r"\s*<defs>\s*<style[^>]*>.*?</style>\s*</defs>", "", body, count=1, flags=re.DOTALL)
    body = IDENTITY.sub(f"{name}-", body)
    body = body.replace(INK, "currentColor").replace(f"fill: {PAPER}", "fill: none")
    size = re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', body)
    if size is None:
        raise ValueError(f"{name} is no SVG with a size")
    width = float(size.group(1))
    joined = f'aria-hidden="true" style="max-width: {1.6 * width:.0f}px; stroke-linejoin: round"'
    return body.replace(size.group(0), joined, 1), width
