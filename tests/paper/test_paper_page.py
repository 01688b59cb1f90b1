"""The page of the ledger: whole, without a network, readable by those who do not see the figures."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from tautwire.paper.figure_style import PaperFigure, figure_style, figure_table, label_panel, write_figures
from tautwire.paper.open_claims import OpenClaim
from tautwire.paper.paper_claims import Claim, LedgerEntry
from tautwire.paper.paper_extensions import ExtensionFigure
from tautwire.paper.paper_page import SECTION_FIGURES, PageContent, inline_svg, number_text, paper_page
from tests.support.pages import MAX_PAGE_BYTES

CLAIM = Claim(
    "it", "4.1.1", "difference of r1 <27.5 s>", "mm", 2.4, 0.1, 0.05, explanation="at 9.8 m/s^2", printed_digits="2.40"
)
AXIS = replace(CLAIM, id="axis.07a", paper_value=(-0.5, 3.0), rule="axis", printed_digits="")


def _drawn(name: str) -> PaperFigure:
    figure = Figure(figsize=(3.0, 2.0))
    figure.add_subplot().plot([0.0, 1.0], [0.0, -1.0], label="a line")
    return PaperFigure(name, f"Title of {name}", f'What "{name}" shows', figure)


def _page(tmp_path) -> str:  # type: ignore[no-untyped-def]
    with figure_style():
        drawn = [_drawn(name) for names in SECTION_FIGURES.values() for name in names] + [_drawn("more")]
        svgs = write_figures(drawn, tmp_path)
    entries = [LedgerEntry(CLAIM, 0.4, 2.41), LedgerEntry(AXIS, (0.0, 1.0), (-0.5, 2.9))]
    trials = [OpenClaim("Open", "What came of it.", ("Try", "x, mm"), (("Paper", ("-10 to 25",)),))]
    content = PageContent(entries, drawn, svgs, trials, [ExtensionFigure(drawn[-1], "A paragraph of 2.81e6 N.")])
    return paper_page(content, {"claims.json": "claims.json"})


@pytest.mark.validate
def test_page_has_every_claim_figure_and_trial_and_asks_for_nothing(tmp_path) -> None:  # type: ignore[no-untyped-def]
    page = _page(tmp_path)
    assert len(page.encode()) < MAX_PAGE_BYTES
    assert "2 claims: 0 reproduced, 2 reproduced after correction, 0 not reproducible" in page
    assert "Difference of r1 &lt;27.5 s&gt;" in page and ">2.40 <" in page.replace("2.40<span", "2.40 <span")
    assert "Axes of the figures: 2 " not in page and "Axes of the figures: 1 reproduced after correction" in page
    assert page.count('role="img"') == sum(map(len, SECTION_FIGURES.values())) + 1
    assert 'aria-label="What &#34;fig_07&#34; shows"' in page
    assert "What came of it." in page and "2.81\u00a0\u00d7\u00a010⁶ N" in page
    links = re.findall(r'(?:src|href)="([^"]*)"', page)
    files = [link for link in links if not link.startswith("#")]
    names = [name for figures in SECTION_FIGURES.values() for name in figures]
    assert files == ["claims.json", *(f"{name}.csv" for name in names), "more.csv"]
    assert all((tmp_path / file).is_file() for file in files if file.endswith(".csv"))


@pytest.mark.validate
def test_names_inside_the_figures_are_used_once(tmp_path) -> None:  # type: ignore[no-untyped-def]
    ids = re.findall(r'\bid="([^"]+)"', _page(tmp_path))
    assert len(ids) == len(set(ids))


def test_figures_take_the_pages_ink_and_ground(tmp_path) -> None:  # type: ignore[no-untyped-def]
    with figure_style():
        (svg,) = write_figures([_drawn("one")], tmp_path).values()
    shown, width = inline_svg(svg, "one")
    assert shown.startswith("<svg") and "<metadata" not in shown and "<style" not in shown
    assert "currentColor" in shown and "#ffffff" not in shown and "#1c2328" not in shown
    assert width == 216.0 and 'width="216' not in shown


def test_numbers_are_written_short() -> None:
    assert [number_text(value) for value in (None, 1e-15, 1594.2667, 0.00144210, (-0.5, 2.9))] == [
        "-", "0", "1594.3", "0.001442", "-0.5 to 2.9"
    ]  # fmt: skip


def test_the_curves_of_a_figure_are_a_table_without_its_guides(tmp_path: Path) -> None:
    time, other_time = np.linspace(0.0, 2.0, 5), np.linspace(0.0, 1.0, 3)
    figure = Figure()
    upper, lower = (figure.add_subplot(2, 1, number) for number in (1, 2))
    upper.plot(time, np.sin(time), label="linear")
    upper.plot(time, np.cos(time), label="logarithmic")
    upper.axhline(0.5)
    label_panel(upper, "r (mm)", "(a)")
    lower.plot(time, time**2)
    lower.plot(other_time, 3.0 * other_time)
    write_figures([PaperFigure("one", "One", "Two panels", figure)], tmp_path)
    table = pd.read_csv(tmp_path / "one.csv")
    assert list(table.columns) == [
        *("(a): Time (s)", "(a): linear: r (mm)", "(a): logarithmic: r (mm)"),
        *("panel 2: x", "panel 2: curve 1: y", "panel 2: curve 2: x", "panel 2: curve 2: y"),
    ]
    assert table["(a): logarithmic: r (mm)"].to_numpy() == pytest.approx(np.cos(time), rel=1e-6)
    assert table["panel 2: curve 2: y"].dropna().to_numpy() == pytest.approx(3.0 * other_time)


def test_a_path_in_space_has_three_columns(tmp_path: Path) -> None:
    figure = Figure()
    axes = figure.add_subplot(projection="3d")
    axes.plot([0.0, 1.0], [2.0, 3.0], [4.0, 5.0])
    table = figure_table(figure)
    assert table.to_numpy().tolist() == [[0.0, 2.0, 4.0], [1.0, 3.0, 5.0]]
    assert list(table.columns) == ["x", "curve 1: y", "curve 1: z"]
