"""Rendering of all HTML pages from the templates, which escape every text: header, table cells, typeset numbers."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, TypeAlias
from urllib.parse import quote

from markupsafe import Markup, escape

from .. import __version__
from ..errors import one_line
from ..provenance import Provenance
from .inline_charts import Chart

if TYPE_CHECKING:
    from jinja2 import Environment

# Sign and digits of the exponent in a number such as 1.5e-08, and the exponent of a unit such as mm^2.
EXPONENT_PATTERN = re.compile(r"(?<=\d)e([+-]?)0*(\d+)\b")
UNIT_EXPONENT_PATTERN = re.compile(r"\^(-?\d+)")
# A dash that stands alone is an absent number; any other is a minus sign.
LONE_DASH_PATTERN = re.compile(r"(?<!\S)-(?=[\s,]|$)")
PLOTLY = "plotly-gl3d-4.1.1.min.js.gz"
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+")


@dataclass(frozen=True)
class PageHeader:
    """Header of a page: what made it about what ``subject``, a ``verdict`` in a CSS class, and the ``headline``.

    ``links`` maps labels to files beside the page, such as "robot.toml"; the footer tells the ``provenance``.
    """

    product: str
    subject: str
    headline: str
    title: str
    verdict: str = ""
    verdict_class: str = "none"
    links: Mapping[str, str] = field(default_factory=dict)
    provenance: Provenance | None = None


@dataclass(frozen=True)
class Number:
    """A table cell with a formatted number, its unit in a column of its own width, and emphasis where it is strong."""

    text: str
    unit: str | None = None
    strong: bool = False
    kind: str = field(default="number", init=False)


@dataclass(frozen=True)
class Label:
    """A table cell with a word in the colour of a CSS class."""

    text: str
    css_class: str
    kind: str = field(default="label", init=False)


@dataclass(frozen=True)
class Prose:
    """A table cell with a sentence in which powers are typeset."""

    text: str
    kind: str = field(default="prose", init=False)


@dataclass(frozen=True)
class HeatCell:
    """A cell of a heat map: a formatted number on a ground of ``level`` 0 (none) to 5 (strongest)."""

    text: str
    level: int
    kind: str = field(default="heat", init=False)


@dataclass(frozen=True)
class SectionLink:
    """A table cell that links to a section of the page by its id."""

    text: str
    section: str
    kind: str = field(default="link", init=False)


Cell: TypeAlias = str | Number | Label | Prose | HeatCell | SectionLink | Chart
Row: TypeAlias = Sequence[Cell]


def render_page(template: str, header: PageHeader, figures: Any = None, **view: Any) -> str:
    """Renders a template; ``figures`` is any JSON value that the scripts draw, None where they draw nothing."""
    page = _environment().get_template(f"{template}.html.jinja")
    return page.render(header=header, figures=figures, contents=[], **view)


def typeset_number(text: str) -> Markup:
    """A formatted number with true minus signs, powers of ten, and a dash for an absent one."""
    typeset = LONE_DASH_PATTERN.sub("\N{EN DASH}", EXPONENT_PATTERN.sub(_typeset_power, one_line(text)))
    return escape(typeset.replace("-", "\N{MINUS SIGN}").replace(" %", "\N{NO-BREAK SPACE}%"))


def typeset_prose(text: str) -> Markup:
    """A sentence with powers of ten and exponents of units as superscripts."""
    typeset = EXPONENT_PATTERN.sub(_typeset_power, one_line(text))
    typeset = UNIT_EXPONENT_PATTERN.sub(lambda match: match[1].translate(SUPERSCRIPTS), typeset)
    return escape(typeset.replace(" %", "\N{NO-BREAK SPACE}%"))


def relative_url(target: str) -> str:
    """A relative path as a URL; whatever it contains, it stays relative to the page."""
    return quote(one_line(target), safe="/._-~")


def asset(name: str) -> Markup:
    """The text of a file in ``assets``, to be included as it is."""
    return Markup((files(__package__) / "assets" / name).read_text(encoding="utf-8"))


def _typeset_power(match: re.Match[str]) -> str:
    return (
        f"\N{NO-BREAK SPACE}\N{MULTIPLICATION SIGN}\N{NO-BREAK SPACE}10{(match[1] + match[2]).translate(SUPERSCRIPTS)}"
    )


def _packed_plotly() -> Markup:
    """The vendored plotly.js as base64 of gzip, which a page inflates with ``assets/start.js``."""
    packed = (files(__package__) / "vendor" / PLOTLY).read_bytes()
    return Markup(b64encode(packed).decode("ascii"))


@cache
def _environment() -> Environment:
    """The templates' environment: every text is escaped, and made one line of printable characters before."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(__package__),
        autoescape=True,
        finalize=lambda value: one_line(value) if type(value) is str else value,
        undefined=StrictUndefined,
        extensions=["jinja2.ext.do"],
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    environment.filters.update(number=typeset_number, prose=typeset_prose, relative_url=relative_url)
    environment.globals.update(asset=asset, packed_plotly=_packed_plotly, version=__version__)
    return environment
