"""What rows say together: spreads, probabilities and Sobol indices of made-up rows, of which all is known; pages."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from scipy.stats import norm

from tautwire.campaigns.campaign_dataset import PartWriter, open_dataset, read_rows
from tautwire.campaigns.campaign_figures import (
    MAX_CURVE_NUMBERS,
    QuantileBands,
    _band_data,
    _curve_points,
    quantile_bands,
)
from tautwire.campaigns.campaign_heat_map import sobol_heat_maps
from tautwire.campaigns.campaign_page import _sobol_rows
from tautwire.campaigns.campaign_plan import Plan
from tautwire.campaigns.campaign_run import RunResult
from tautwire.campaigns.campaign_runner import write_summary
from tautwire.campaigns.campaign_summary import SobolIndices, Summary, summarise_runs
from tautwire.campaigns.dataset_schema import RowColumn, row_columns
from tautwire.campaigns.input_sampling import draw_samples
from tautwire.campaigns.trace_summary import summarise_traces
from tautwire.errors import InputError
from tautwire.number_format import format_on_page
from tautwire.reports import inline_charts as charts
from tautwire.reports.downsampling import unpack_float32
from tautwire.reports.page_rendering import HeatCell, Number
from tests.support.campaigns import AT_REST, moving, read
from tests.support.pages import FETCHING, MAX_PAGE_BYTES, Page
from tests.support.traces import HOSTILE

GRID = (
    AT_REST.replace('"sobol"\ncount = 8', '"grid"')
    .replace("normal = [1.022e11, 2.2e9]", "list = [1e11, 1.1e11]")
    .replace("uniform = [280.0, 320.0]", "linspace = [280.0, 320.0, 4]")
)
LAWS = GRID.replace("cable.modulus = {list = [1e11, 1.1e11]}", 'cable.law = {list = ["linear", "logarithmic"]}')
COLUMNS = (
    RowColumn("index", "whole", role="run"),
    RowColumn("cable.modulus", "number", role="input"),
    RowColumn("platform.mass", "number", role="input"),
    RowColumn("out", "number", "Hz"),
    RowColumn("still", "number"),
    RowColumn("slack", "flag"),
    RowColumn("failure", "text", role="run"),
)


def made_up(plan: Plan, weights: tuple[float, float] = (3.0, 4.0), values: np.ndarray | None = None) -> pa.Table:
    """Rows whose output is a weighted sum of the inputs, each scaled to a variance of one."""
    values = draw_samples(plan) if values is None else values
    scaled = (values - [1.022e11, 300.0]) / [2.2e9, 40.0 / np.sqrt(12.0)]
    out = scaled @ np.array(weights)
    return pa.table(
        {
            "index": np.arange(len(values)),
            "cable.modulus": values[:, 0],
            "platform.mass": values[:, 1],
            "out": out,
            "still": np.ones(len(values)),
            "slack": out > 5.0,
            "failure": pa.array([None] * len(values), pa.string()),
        }
    )


def summed(tmp_path: Path, method: str, count: int, **changed: Any) -> tuple[Plan, Summary]:
    text = AT_REST.replace('"sobol"', f'"{method}"').replace("count = 8", f"count = {count}")
    plan = replace(read(tmp_path, text), **changed)
    return plan, summarise_runs(plan, COLUMNS, made_up(plan))


@pytest.mark.parametrize(("method", "count", "precision"), [("saltelli", 512, 0.02), ("latin hypercube", 2000, 0.06)])
def test_sobol_indices_are_the_shares_of_the_variance(
    method: str, count: int, precision: float, tmp_path: Path
) -> None:
    _, summary = summed(tmp_path, method, count)
    results = {each.input: each for each in summary.dependences if each.output == "out"}
    assert results["cable.modulus"].first == pytest.approx(9.0 / 25.0, abs=precision)
    assert results["platform.mass"].first == pytest.approx(16.0 / 25.0, abs=precision)
    totals = [results[key].total for key in ("cable.modulus", "platform.mass")]
    assert totals == (
        [pytest.approx(0.36, abs=0.02), pytest.approx(0.64, abs=0.02)] if method == "saltelli" else [None] * 2
    )
    assert "still" not in {each.output for each in summary.dependences}


def test_correlated_inputs_share_one_index(tmp_path: Path) -> None:
    more = 'gravity = {uniform = [9.7, 9.9]}\n[[correlation]]\nbetween = ["cable.modulus", "gravity"]\nvalue = 0.5'
    plan = read(tmp_path, AT_REST.replace('"sobol"', '"saltelli"').replace("count = 8", "count = 512") + more)
    values = draw_samples(plan)
    rows = made_up(replace(plan, inputs=plan.inputs[:2], correlations=()), values=values[:, :2])
    rows = rows.append_column("gravity", pa.array(values[:, 2]))
    results = {
        each.input: each.first for each in summarise_runs(plan, COLUMNS, rows).dependences if each.output == "out"
    }
    assert results["cable.modulus and gravity"] == pytest.approx(9.0 / 25.0, abs=0.02)
    assert results["platform.mass"] == pytest.approx(16.0 / 25.0, abs=0.02)


def test_inputs_that_would_all_share_one_index_are_refused(tmp_path: Path) -> None:
    more = '[[correlation]]\nbetween = ["cable.modulus", "platform.mass"]\nvalue = 0.5'
    with pytest.raises(InputError, match="they share one index"):
        read(tmp_path, AT_REST.replace('"sobol"', '"saltelli"') + more)


def test_blocks_with_a_failed_run_are_left_out(tmp_path: Path) -> None:
    plan, whole = summed(tmp_path, "saltelli", 512)
    rows = made_up(plan)
    out = rows["out"].to_numpy().copy()
    out[::37] = np.nan
    holed = summarise_runs(plan, COLUMNS, rows.set_column(3, "out", pa.array(out, from_pandas=True)))
    pairs = zip(holed.dependences, whole.dependences, strict=True)
    assert all(mine.first == pytest.approx(other.first, abs=0.1) for mine, other in pairs)


@pytest.mark.parametrize(
    ("changed", "said"),
    [({"method": "grid"}, "a grid has no distribution"), ({"count": 32}, "32 samples, 64 or more are required")],
)
def test_the_reason_for_missing_sobol_indices_is_reported(changed: dict[str, Any], said: str, tmp_path: Path) -> None:
    plan = replace(read(tmp_path, AT_REST), **changed)
    rows = made_up(read(tmp_path, AT_REST))
    summary = summarise_runs(plan, COLUMNS, rows)
    assert not summary.dependences and said in summary.notes[-1]


def test_spreads_and_probabilities_are_those_of_the_distribution(tmp_path: Path) -> None:
    _, summary = summed(
        tmp_path,
        "sobol",
        4096,
        inputs=read(tmp_path, AT_REST.replace("uniform = [280.0, 320.0]", f"normal = [300.0, {40 / 12**0.5}]")).inputs,
    )
    spread = next(each for each in summary.spreads if each.name == "out")
    assert spread.count == 4096 and spread.unit == "Hz"
    assert (spread.mean, spread.standard_deviation) == (pytest.approx(0.0, abs=0.01), pytest.approx(5.0, rel=0.01))
    assert spread.quantiles[0] == pytest.approx(-1.96 * 5.0, rel=0.02)
    (slack,) = summary.probabilities
    assert slack.relative_frequency == pytest.approx(norm.sf(1.0), abs=0.005) and slack.low < norm.sf(1.0) < slack.high


def test_probability_of_what_never_happened_is_not_zero_for_sure(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST)
    never = pa.array([False] * 7 + [None])
    rows = made_up(plan).set_column(5, "slack", never)
    (slack,) = summarise_runs(plan, COLUMNS, rows).probabilities
    assert (slack.times, slack.count, slack.low) == (0, 7, 0.0) and slack.high == pytest.approx(0.354, abs=0.002)


def written(tmp_path: Path, text: str, failure: str = "UnreachableError: a cable cannot push") -> tuple[Plan, Path]:
    """A folder with made-up rows of a plan, one of which failed; outputs depend on the first input."""
    plan, out = read(tmp_path, text), tmp_path / "out"
    values, variants = draw_samples(plan), plan.variants
    generator = np.random.default_rng(1)
    with open_dataset(out, plan), PartWriter(out, row_columns(plan, 3)) as parts:
        for index in range(len(values) * len(variants)):
            sample, variant = divmod(index, len(variants))
            path, controller = variants[variant]
            row: dict[str, Any] = {
                "index": index,
                "sample": sample,
                **{each.key: each.distribution.value(v) for each, v in zip(plan.inputs, values[sample], strict=True)},
            }
            series = {}
            if path >= 0:
                row |= {"path": plan.paths[path].name, "controller": controller}
                drawn = generator.normal(variant, 1.0, 5)
                series = {"time": np.linspace(0.0, 0.15, 5)} | dict.fromkeys(("x", "y", "z"), drawn)
                series |= {f"tension_{cable}": 100.0 + drawn for cable in (1, 2, 3)}
            outputs = [column.name for column in row_columns(plan, 3) if column.role == "output"]
            numbers = {name: float(values[sample, 0] / 1e9 + 0.05 * generator.normal()) for name in outputs}
            flags = {c.name: False for c in row_columns(plan, 3) if c.kind == "flag"}
            parts.add(
                [RunResult({**row, "failure": failure})]
                if index == 3
                else [RunResult({**numbers, **row, **flags}, series)]
            )
    return plan, out


def test_bands_are_quantiles_of_each_path_with_each_controller(tmp_path: Path) -> None:
    plan, out = written(tmp_path, moving(64))
    rows = read_rows(out, ["z"], "series")
    for variant in (0, 1):
        bands = quantile_bands(plan, out, variant, ("z",))
        mine = rows["z"].to_numpy()[rows["index"].to_numpy() % 2 == variant].reshape(-1, 5)
        assert bands.run_count == len(mine) == 64 - variant
        assert np.array_equal(bands.quantiles["z"], np.quantile(mine, (0.025, 0.5, 0.975), axis=0))
    assert bands.time.tolist() == pytest.approx(np.linspace(0.0, 0.15, 5).tolist())


def test_bands_of_positions_are_drawn_in_mm_about_their_median(tmp_path: Path) -> None:
    plan, out = written(tmp_path, moving(64))
    write_summary(plan, out)
    low, middle, high = quantile_bands(plan, out, 0, ("z",)).quantiles["z"]
    drawn = Page((out / "index.html").read_text(encoding="utf-8")).data()["variants"][0]["bands"][2]
    assert (drawn["label"], drawn["unit"]) == ("z", "mm")
    for name, expected in (("low", low - middle), ("middle", middle), ("high", high - middle)):
        assert unpack_float32(drawn[name]) == pytest.approx(1e3 * expected, rel=1e-5)


@pytest.mark.parametrize("count", [0, 9, 3000])
def test_bands_of_long_paths_are_drawn_at_few_points_with_both_ends_and_their_full_width(count: int) -> None:
    time, spread = np.linspace(0.0, 9.0, count), np.zeros(count)
    spread[count // 2 :: 1 + count] = 1.0
    bands = QuantileBands(time, {"tension_1": np.stack([-spread, 0.0 * time, spread])} if count else {}, 64)
    drawn = _band_data(bands, ["tension_1"], 100)
    times, (band,) = unpack_float32(drawn["time"]), drawn["bands"]
    assert len(times) == min(count, 100)
    if count:
        assert (times[0], times[-1], band["width"]) == (0.0, 9.0, "2.00")
        assert all(len(unpack_float32(band[name])) == len(times) for name in ("low", "middle", "high"))


def test_all_bands_and_all_outputs_over_a_grid_stay_within_their_budget(tmp_path: Path) -> None:
    plan = read(tmp_path, moving(64))
    band_points, grid_points = _curve_points(plan, 19, 51)
    assert 2 * band_points * (1 + 3 * 19) <= MAX_CURVE_NUMBERS and 2 * grid_points * 53 <= MAX_CURVE_NUMBERS
    assert _curve_points(plan, 1, 1)[1] == 2000


def test_the_heat_map_has_outputs_over_inputs_and_takes_the_total_where_it_is_known() -> None:
    def index(output: str, name: str, first: float, total: float | None = None) -> SobolIndices:
        return SobolIndices("up", "none", output, name, first, 0.1, total, None if total is None else 0.1)

    known = [index("a_1", "cable.area", 0.1, 0.85), index("a_1", "gravity", 0.5, 0.05)]
    (heat,) = sobol_heat_maps(known)
    assert heat.caption == "Sobol indices, total, up, none" and heat.inputs == ["cable area", "gravity"]
    assert heat.rows == [["a 1", HeatCell("0.85", 5), HeatCell("-", 0)]]
    (first_order,) = sobol_heat_maps([index("a_1", "gravity", 0.5)])
    assert "first order" in first_order.caption and first_order.rows[0][1] == HeatCell("0.50", 3)


@pytest.mark.parametrize("text", [moving(64), AT_REST, GRID, LAWS])
def test_pages_are_whole_and_ask_nothing_of_the_network(text: str, tmp_path: Path) -> None:
    plan, out = written(tmp_path, text)
    document = write_summary(plan, out)
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert page.open == [] and len(page.scripts) == 3
    assert (out / "index.html").stat().st_size < MAX_PAGE_BYTES
    assert document["failed"] == 1 and "1 of " in page.text and "UnreachableError: a cable cannot push" in page.text
    assert json.loads((out / "summary.json").read_text(encoding="utf-8")) == json.loads(json.dumps(document))
    for tag, attributes in page.elements:
        assert not FETCHING & set(attributes), tag
    variants = page.data()["variants"]
    assert len(variants) == len(plan.variants)
    panels = [each for each in page.all("figure") if each.get("data-kind") == "band"]
    assert len(panels) == (6 if plan.paths else 0)


def test_the_headline_counts_the_runs_of_each_controller_and_compares_them(tmp_path: Path) -> None:
    plan, out = written(tmp_path, moving(64))
    document = write_summary(plan, out)
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    low, high = (
        [each["quantiles"][level] for each in document["spreads"] if each["name"] == "path_error_largest"]
        for level in ("2.5 %", "97.5 %")
    )
    spans = [
        format_on_page(one, "m") + " to " + format_on_page(other, "m") for one, other in zip(low, high, strict=True)
    ]
    assert all(span.endswith(" mm") for span in spans)
    expected = f"64 runs with each of 2 controllers: in 95 % of them the largest path error is {spans[0]} (none), "
    assert f"{expected}{spans[1]} (feedforward)." in page.text.replace("\N{NO-BREAK SPACE}", " ")


def test_texts_of_a_grid_stand_on_an_axis_by_their_places(tmp_path: Path) -> None:
    plan, out = written(tmp_path, LAWS)
    write_summary(plan, out)
    assert read_rows(out, ["cable.law"])["cable.law"].to_pylist() == ["linear"] * 4 + ["logarithmic"] * 4
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert [each["label"] for each in page.data()["inputs"]] == ["cable.law (0 linear, 1 logarithmic)", "platform.mass"]
    assert "linear, logarithmic" in page.text


def test_the_page_names_the_inputs_that_make_much_of_an_output(tmp_path: Path) -> None:
    plan, out = written(tmp_path, AT_REST.replace('"sobol"\ncount = 8', '"saltelli"\ncount = 64'))
    result = write_summary(plan, out)["dependences"]
    shown = [each for each in result if max(each["first"], each["total"]) >= 0.05]
    assert 0 < len(shown) < len(result)
    page = (out / "index.html").read_text(encoding="utf-8")
    section = page[page.index('id="dependences"') :].split("</section>")[0].split("<details>")[1]
    assert section.count("<tr") - 1 == len(shown)
    for each in shown:
        assert each["output"].replace("_", " ") in section and f"{each['total']:.2f} \N{PLUS-MINUS SIGN}" in section


def test_the_table_of_indices_has_a_dash_for_one_whose_interval_contains_0() -> None:
    by_interactions = SobolIndices("", "", "out", "gravity", 0.01, 0.1, 0.6, 0.1)
    by_itself = SobolIndices("", "", "out", "cable.area", 0.3, 0.1, 0.2, 0.3)
    unsure = SobolIndices("", "", "out", "platform.mass", 0.4, 0.5, 0.04, 0.01)
    rows = _sobol_rows([by_itself, by_interactions, unsure])["at rest"]
    plus_minus = "\N{PLUS-MINUS SIGN}"
    assert rows == [
        ["out", "gravity", Number("-"), "", Number(f"0.60 {plus_minus} 0.10")],
        ["out", "cable.area", Number(f"0.30 {plus_minus} 0.10"), charts.bar(0.3, 1.0), Number("-")],
    ]


def test_an_output_that_depends_on_no_input_says_so(tmp_path: Path) -> None:
    plan = read(tmp_path, AT_REST.replace("count = 8", "count = 64"))
    noise = np.random.default_rng(2).normal(size=64)
    rows = made_up(plan).set_column(3, "out", pa.array(noise))
    dependences = summarise_runs(plan, COLUMNS, rows).dependences
    assert not any(each.is_significant for each in dependences)
    assert [row[:2] for row in _sobol_rows(dependences)["at rest"]] == [["out", "none that can be told from 0"]]


def test_hostile_reasons_do_nothing(tmp_path: Path) -> None:
    plan, out = written(tmp_path, moving(64).replace('"up"', json.dumps(HOSTILE)), HOSTILE)
    write_summary(plan, out)
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert "img" not in [tag for tag, _ in page.elements] and len(page.scripts) == 3


def test_a_season_lists_what_each_recording_showed(tmp_path: Path) -> None:
    def report(value: float) -> str:
        parameters = {"damping": {"value": value, "unit": "Pa s", "low": 0.9 * value, "high": 1.1 * value}}
        return json.dumps({"effects": [{"name": "damping", "cables": [1, 2, 3], "parameters": parameters}]})

    rows = pa.table(
        {
            "recording": ["may.csv", "june.csv", "july.csv"],
            "verdict": ["effects", "effects", None],
            "report": [report(2e9), report(2.2e9), None],
            "failure": [None, None, "RecordingError: no"],
        }
    )
    season = summarise_traces(rows)
    assert (season.count, season.failed, season.verdicts) == (3, 1, (("effects", 2),))
    assert [(each.recording, each.value, each.low) for each in season.findings] == [
        ("may.csv", 2e9, 0.9 * 2e9),
        ("june.csv", 2.2e9, 0.9 * 2.2e9),
    ]
