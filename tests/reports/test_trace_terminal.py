"""The table on the terminal: complete at 80 columns and clear without colours; and how numbers are written."""

from __future__ import annotations

import io
import math
from dataclasses import replace

import pytest
from rich.console import Console

from tautwire.estimation.disturbance import NEUTRAL, OrnsteinUhlenbeck
from tautwire.estimation.trace_result import Candidate, Estimate, FoundEffect, Trace
from tautwire.number_format import (
    choose_unit,
    format_engineering,
    format_in_common_unit,
    format_percent,
    format_significant,
)
from tautwire.reports import trace_page, trace_table
from tautwire.reports.trace_texts import ROLES, comparison_by_role, explained_share, format_evidence, values_text
from tautwire.robot.schema import EffectSetting
from tests.support.pages import Page
from tests.support.traces import HOSTILE, made_trace, nothing_found, without_positions


def rendered(trace: Trace, width: int = 80) -> str:
    """The table as text without colours."""
    console = Console(file=io.StringIO(), width=width, color_system=None, legacy_windows=False)
    console.print(trace_table(trace))
    file = console.file
    assert isinstance(file, io.StringIO)
    return file.getvalue()


def test_verdict_comes_first() -> None:
    text = rendered(made_trace())
    assert text.startswith("Effect found: The cables damp 5.3 times")
    assert "extended model is white noise" in " ".join(text.split())


def test_headline_tells_the_values_of_the_largest_effect_with_their_intervals() -> None:
    trace = made_trace()
    told = "Fitted damping (all cables): damping 2.103 GPa s (95 % interval 2.050 to 2.160)."
    assert " ".join(rendered(trace).split()).startswith(f"Effect found: {trace.sentence} {told}")
    page = Page(trace_page(trace, {})).text.replace("\N{NO-BREAK SPACE}", " ")
    assert f"{trace.sentence} {told}" in page
    ratio = Estimate(0.94, "1", 0.937, 0.943, None)
    drum = FoundEffect("drum", "winch", (2,), {"radius_ratio": ratio}, 40.0, share=0.9)
    damping = replace(trace.effects[0], share=0.05)
    told = "Fitted drum (cable 2): radius_ratio 0.9400 (95 % interval 0.9370 to 0.9430)."
    assert told in " ".join(rendered(replace(trace, effects=(damping, drum))).split())
    opened = replace(drum, parameters={"radius_ratio": replace(ratio, low=-math.inf)})
    told = "radius_ratio 0.9400 (95 % interval up to 0.9430)."
    assert told in " ".join(rendered(replace(trace, effects=(opened,))).split())
    assert "Fitted" not in rendered(nothing_found(trace)) + rendered(replace(trace, verdict="unexplained"))


@pytest.mark.parametrize("eight", [False, True])
def test_fits_80_columns_and_cuts_nothing(eight: bool) -> None:
    text = rendered(made_trace(eight=eight))
    assert max(len(line) for line in text.splitlines()) <= 80
    assert "…" not in text


def test_breaks_no_word_of_long_parameters() -> None:
    trace = made_trace()
    found = trace.effects[0]
    (estimate,) = (replace(each, value=0.01916, low=0.01818, high=0.02012) for each in found.parameters.values())
    effects = [
        replace(found, name=name, parameters=dict.fromkeys(names, estimate))
        for name, names in (("friction", ("coefficient", "smoothing")), ("hysteresis", ("force", "yield_strain")))
    ]
    text = rendered(replace(trace, effects=tuple(effects)))
    for word in ("coefficient", "smoothing", "hysteresis", "yield_strain"):
        assert word in text


@pytest.mark.parametrize("eight", [False, True])
def test_every_error_is_there(eight: bool) -> None:
    trace = made_trace(eight=eight)
    rows = {line.strip().split("  ")[0]: line.split() for line in rendered(trace).splitlines()}
    for role in ROLES:
        comparison = comparison_by_role(trace, role)
        assert comparison
        for errors in (comparison.errors_before, comparison.errors_after):
            assert format_significant(1e3 * errors.position_rms) in rows["position"]
            assert format_significant(errors.tension_rms) in rows["tension"]
            for axis, value in zip("xyz", errors.axes, strict=True):
                assert format_significant(1e3 * value) in rows[axis]
            for cable, value in enumerate(errors.cables, start=1):
                assert format_significant(value) in rows[f"cable {cable}"]


def test_large_numbers_are_not_cut() -> None:
    trace = made_trace(eight=True)
    errors = replace(trace.comparisons[0].errors_before, position_rms=123.456789, tension_rms=98765.4)
    comparisons = tuple(replace(each, errors_before=errors, errors_after=errors) for each in trace.comparisons)
    text = rendered(replace(trace, comparisons=comparisons))
    assert text.count("123500") == 4 and text.count("98770") == 4


def test_effects_with_intervals_and_ranking_are_there() -> None:
    text = rendered(made_trace())
    row = next(line.split() for line in text.splitlines() if line.strip().startswith("damping"))
    assert row == ["damping", "all", "damping", "2.103", "2.050", "2.160", "0.400", "GPa", "s"]
    assert "creep + thermal" in text
    assert "taken" in text and "812.4" in text
    assert "drum effects" in text and "temperature" in text


def test_long_parameter_lists_are_all_shown() -> None:
    trace = made_trace(eight=True)
    names = ("stiffness_of_branch", "relaxation_time", "radius", "gain")
    parameters = {name: Estimate(1.23456e9, "Pa s", 1.2e9, 1.3e9, None) for name in names}
    text = rendered(replace(trace, effects=(replace(trace.effects[0], parameters=parameters, cables=(1, 2, 5, 7)),)))
    assert max(len(line) for line in text.splitlines()) <= 80
    table = text.partition("Found, with")[2]
    assert table.count("1.235") == 4 and table.count("GPa s") >= 4
    assert "and 2 more." in text.partition("Found, with")[0]
    assert "…" not in text


def test_without_check_or_positions_there_are_dashes() -> None:
    text = rendered(without_positions(made_trace(check=False)))
    position = next(line.split() for line in text.splitlines() if line.strip().startswith("position"))
    assert position == ["position", "mm", "-", "-", "-", "-"]
    assert "check" not in text


def test_nothing_found_needs_no_table_of_effects() -> None:
    text = rendered(nothing_found(made_trace()))
    assert text.startswith("Nothing is visible:")
    assert "95 %" not in text


def test_nothing_visible_says_what_would_have_been() -> None:
    text = rendered(nothing_found(made_trace()))
    visible = text[text.index("Visible would have been") :]
    assert "payload: mass 0.0195 kg" in visible and "relaxation: modulus " in visible
    assert "slack" not in visible[: visible.index("Never")] and "slack" in visible[visible.index("Never") :]
    assert "Visible would have been" not in rendered(made_trace())


def test_what_is_confusable_comes_with_the_motion_that_would_tell() -> None:
    text = rendered(replace(made_trace(), also_possible=(("damping", "relaxation"), ("creep", "thermal"))))
    assert "relaxation in place of damping" in text and "creep + thermal" in text
    joined = " ".join(text.split())
    assert "tautwire excite robot.toml --effects damping,relaxation --out" in joined
    assert "--effects damping,creep,thermal --out" in joined


def test_a_listed_effect_is_possible_in_place_of_an_unlisted_one() -> None:
    robot = made_trace().robot_before.with_effect(EffectSetting("hanging_load", {"weight": 321.0}, ()))
    pair = ("hanging_load", "sensor_offset")
    unlisted = replace(made_trace(), effects=(), robot_after=robot, also_possible=(pair,), verdict="discovered")
    assert "sensor_offset in place of hanging_load" in rendered(unlisted)


def test_markup_and_control_characters_in_texts_do_nothing() -> None:
    text = rendered(replace(made_trace(), sentence=f"[red]\x1b[31m{HOSTILE}", notes=("[bold]x[/bold]\x07",)))
    assert "\x1b" not in text and "\x07" not in text
    assert "[red]" in text and "[bold]x[/bold]" in text


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2.1034e9, "Pa s", "2.10 GPa s"),
        (1.022e11, "Pa", "102 GPa"),
        (0.0321, "m", "32.1 mm"),
        (4.5e-5, "m", "45.0 µm"),
        (-3.2e-4, "m/s", "-320 µm/s"),
        (1.25664e-5, "m^2", "12.6 mm²"),
        (2.5, "m^2", "2.50 m²"),
        (0.31, "kg", "0.310 kg"),
        (1596.0, "N", "1.60 kN"),
        (0.4, "", "0.400"),
        (0.0, "Pa", "0 Pa"),
        (math.nan, "Pa", "-"),
        (None, "Pa", "-"),
    ],
)
def test_units_are_those_of_an_engineer(value: float | None, unit: str, text: str) -> None:
    assert format_engineering(value, unit) == text


@pytest.mark.parametrize(
    ("effect", "values", "text"),
    [
        ("drum", {"radius_ratio": 1.00398213}, "radius_ratio 1.00398"),
        ("drum", {"radius_ratio": 0.936}, "radius_ratio 0.9360"),
        ("drum", {"radius_ratio": 1.0}, "radius_ratio 1.00"),
        ("damping", {"damping": 2.1034e9}, "damping 2.10 GPa s"),
    ],
)
def test_a_ratio_near_one_shows_by_how_much_it_differs(effect: str, values: dict[str, float], text: str) -> None:
    assert values_text(effect, values) == text


def test_unknown_units_are_left_alone() -> None:
    assert choose_unit(1.2e7, "1/K") == ("1/K", 1.0)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0999, "0.0999"),
        (9.996, "10.0"),
        (999.6, "1000"),
        (1846.4, "1846"),
        (12345.6, "12350"),
        (1.5e-7, "1.50e-07"),
        (-2.0, "-2.00"),
    ],
)
def test_numbers_have_three_significant_digits_and_four_where_whole(value: float, text: str) -> None:
    assert format_significant(value) == text


@pytest.mark.parametrize(("evidence", "text"), [(812.43, "812.4"), (163595.4, "163600"), (math.nan, "-")])
def test_evidence_has_four_digits_at_most(evidence: float, text: str) -> None:
    assert format_evidence(evidence) == text


def test_decimals_follow_the_interval() -> None:
    assert format_in_common_unit((2.1034e9, 2.1e9, 2.2e9, None), "Pa s", 5e6) == (
        ["2.1034", "2.1000", "2.2000", "-"],
        "GPa s",
    )
    assert format_in_common_unit((0.0, -0.1, 0.1, 0.0), "kg", 0.1)[0] == ["0.00", "-0.10", "0.10", "0.00"]


def test_share_explained_counts_from_the_noise_floor() -> None:
    assert explained_share(5.0, 3.0, 3.0) == 1.0
    assert explained_share(5.0, 5.0, 3.0) == 0.0
    assert explained_share(3.0, 3.0, 3.0) is None
    assert explained_share(math.nan, 1.0, 1.0) is None
    assert (format_percent(0.99991), format_percent(1.0), format_percent(None)) == ("> 99.9 %", "100 %", "-")


def test_columns_that_were_not_read_are_noted_once_for_each_recording() -> None:
    trace = made_trace(samples=200)
    for text in (rendered(trace), Page(trace_page(trace, {})).text):
        assert text.count("temperature") == len(trace.comparisons) == 2
        assert "data/fit.csv: not read: temperature" in " ".join(text.split())


def test_each_candidate_tells_why_it_was_not_taken() -> None:
    trace = made_trace()
    by_evidence = {"damping": 800.0, "relaxation": 790.0, "creep": 804.0, "drag": 12.0}
    tried = tuple(
        Candidate(1, name, (), {}, evidence, 1.0, name == "damping", (), 40.0) for name, evidence in by_evidence.items()
    )
    table = rendered(replace(trace, candidates=tried)).partition("What was tried")[2]
    rows = [line.split() for line in table.splitlines()]
    status = {name: next(row for row in rows if name in row) for name in by_evidence}
    assert status["damping"][-1] == "taken" and status["relaxation"][-1] == "weaker"
    assert status["creep"][-2:] == ["less", "simple"] and status["drag"][-2:] == ["needs", "40"]


def test_beside_a_disturbance_it_is_told_in_place_of_what_is_no_white_noise() -> None:
    disturbance = replace(NEUTRAL, force=OrnsteinUhlenbeck(2.9, 2.4))
    text = " ".join(rendered(replace(made_trace(), noise_after=False, disturbance=disturbance)).split())
    assert "Beside white noise a random force of 2.9 N on the platform is assumed" in text
    assert "leave more than white noise" not in text
