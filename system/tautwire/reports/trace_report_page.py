"""A trace as one HTML page that needs no network, with the sections on localisation and on candidates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..cosimulation.robot_wiring import PLATFORM
from ..estimation.localisation.component_residuals import ComponentResidual
from ..estimation.trace_result import Candidate, Trace
from ..number_format import ABSENT_TEXT, format_significant
from . import inline_charts as charts
from . import trace_sections as sections
from .html_markup import TableColumn, bullet_list, escape_text, html_page, number_html, panel_groups, section, table
from .robot_scene import choice_buttons, figures_container, legend_key, scene_section
from .trace_figures import measured_outputs, noise_deviation, trace_page_data
from .trace_texts import cables_text, candidates_by_round, format_evidence, values_text

MAX_ROWS_SHOWN = 8
FITTED_COLUMNS = (
    TableColumn("Effect"),
    TableColumn("Where"),
    TableColumn("Evidence", True),
    TableColumn("On unseen data"),
    TableColumn("Left", True),
    TableColumn("Values", wide=True),
    TableColumn("Status"),
)
UNFITTED_COLUMNS = (TableColumn("Effect"), TableColumn("Where"), TableColumn("Values", wide=True))


def candidates_section(trace: Trace) -> str:
    """The candidates of each round of the search, the best first."""
    lead = (
        "One effect at a time, fitted on one part of the data and judged on another, by its evidence there. Left is "
        "what its predictions still miss there, as a mean square in times of what noise makes it: 1 is noise."
    )
    max_evidence = max((each.evidence for each in trace.candidates if math.isfinite(each.evidence)), default=0.0)
    content = "".join(
        _round_section(trace, round_number, group, max_evidence)
        for round_number, group in candidates_by_round(trace.candidates)
    )
    return section("candidates", "What was tried", content or "<p>Nothing was tried.</p>", lead)


def _round_section(trace: Trace, round_number: int, group: Sequence[Candidate], max_evidence: float) -> str:
    """One round: the fitted candidates as a table, the others folded away; ``max_evidence`` scales the bars."""
    fitted = [_fitted_row(trace, each, max_evidence) for each in group if math.isfinite(each.mean_square)]
    others = [_unfitted_row(trace, each) for each in group if not math.isfinite(each.mean_square)]
    content = ""
    if fitted:
        content += table(f"Round {round_number}", FITTED_COLUMNS, fitted[:MAX_ROWS_SHOWN], "candidates")
    else:
        content += f"<h3>Round {round_number}</h3><p>Nothing promised enough to be fitted.</p>"
    if hidden_rows := fitted[MAX_ROWS_SHOWN:]:
        folded = table(f"Round {round_number}, the others", FITTED_COLUMNS, hidden_rows, "candidates", True)
        content += f"<details><summary>{len(hidden_rows)} more with less evidence</summary>{folded}</details>"
    if others:
        folded = table(f"Round {round_number}, not fitted", UNFITTED_COLUMNS, others, "others", True)
        reason = "it promised" if len(others) == 1 else "they promised"
        content += f"<details><summary>{len(others)} not fitted, {reason} too little</summary>{folded}</details>"
    return content


def _fitted_row(trace: Trace, candidate: Candidate, max_evidence: float) -> list[str]:
    css_class = "after" if candidate.accepted else "before"
    return [
        escape_text(candidate.name),
        escape_text(_candidate_location(trace, candidate)),
        number_html(format_evidence(candidate.evidence)),
        charts.bar(candidate.evidence, max_evidence, css_class=css_class),
        number_html(format_significant(candidate.mean_square)),
        number_html(values_text(candidate.name, candidate.values)),
        '<span class="taken">taken</span>' if candidate.accepted else "",
    ]


def _unfitted_row(trace: Trace, candidate: Candidate) -> list[str]:
    return [
        escape_text(candidate.name),
        escape_text(_candidate_location(trace, candidate)),
        number_html(values_text(candidate.name, candidate.values)),
    ]


def _candidate_location(trace: Trace, candidate: Candidate) -> str:
    return cables_text(candidate.cables, trace.robot_before.cable_count) if candidate.cables else PLATFORM


LOCALISATION_COLUMNS = (
    TableColumn("Component"),
    TableColumn("Quantity"),
    TableColumn("Residual", True),
    TableColumn("Expected", True),
    TableColumn("Times", True),
    TableColumn("Times expected, logarithmic"),
    TableColumn("Moves with", wide=True),
)
MIN_RATIO_SPAN = (0.5, 4.0)


def localisation_section(trace: Trace) -> str:
    """Residuals of each FMU alone against their expected noise, the largest ratio first."""
    components = trace.components
    lead = (
        "Before any effect is fitted, each FMU runs alone along the fit recording: a cable on the measured path with "
        "the recorded winch speed, against its load cell; the platform under the measured tensions, against its path. "
        "Expected is what noise alone would leave; once that, the line, is noise. “Moves with” names what the residual "
        "(measured minus computed) follows best, with the correlation: 100 % where it does so exactly, negative where "
        "it runs against it."
    )
    ratios = [part.ratio for part in components.residuals if math.isfinite(part.ratio) and part.ratio > 0.0]
    low = min([MIN_RATIO_SPAN[0], *(0.8 * ratio for ratio in ratios)])
    high = max([MIN_RATIO_SPAN[1], *(1.25 * ratio for ratio in ratios)])
    rows = [_component_row(part, low, high) for part in components.ranking]
    content = f"<p><strong>{escape_text(components.sentence)}</strong></p>"
    if rows:
        content += table("What each FMU alone leaves", LOCALISATION_COLUMNS, rows, "where", True)
    if components.limitations:
        content += bullet_list(components.limitations)
    return section("where", "Where it comes from", content, lead)


def _component_row(part: ComponentResidual, low: float, high: float) -> list[str]:
    unit = f'<span class="unit">{escape_text(part.unit)}</span>'
    association = part.correlated_signal
    association_text = f"{association.name} ({100.0 * association.correlation:.0f} %)" if association else ABSENT_TEXT
    if part.resonance_frequency is not None and part.is_significant:
        association_text = f"rings at {part.resonance_frequency:.2f} Hz"
    return [
        escape_text(part.component),
        escape_text(part.quantity),
        f"{number_html(format_significant(part.rms))} {unit}",
        f"{number_html(format_significant(part.expected_rms))} {unit}",
        number_html(format_significant(part.ratio)),
        charts.log_bar(part.ratio, low, high, tick=1.0, css_class="before" if part.is_significant else "after"),
        number_html(association_text),
    ]


DETAIL_SECTIONS = (
    localisation_section,
    candidates_section,
    sections.residual_analysis,
    sections.detection_limits,
    sections.notes_section,
)


def trace_page(trace: Trace, links: Mapping[str, str]) -> str:
    """The report page; ``links`` maps labels to paths beside the page, such as "robot.toml"."""
    data = trace_page_data(trace)
    choices = choice_buttons("Shown below", [choice["label"] for choice in data["choices"]])
    figures = _scene_section(trace) + _residual_section(trace) + _spectrum_section(trace, data["choices"])
    parts = [
        sections.masthead(trace, links),
        sections.error_summary(trace),
        sections.identified_effects(trace),
        sections.alternative_models(trace),
        figures_container(choices, figures),
        *(part(trace) for part in DETAIL_SECTIONS),
    ]
    title = f"{trace.robot_before.name}: {trace.sentence}"
    return html_page(title, "\n".join(parts), data, ("trace.js",))


def _scene_section(trace: Trace) -> str:
    """The robot in space with its controls."""
    lead = (
        "Cables are coloured by their tension in the extended model. The other paths are drawn farther from its path "
        "than they are, by the factor chosen below the picture."
    )
    label = (
        f"The robot in space: {trace.robot_before.cable_count} cables from their exit points to the platform, coloured "
        "by tension, and the paths before, after and measured."
    )
    keys = legend_key("before") + legend_key("after") + legend_key("measured")
    return scene_section("The robot in motion", lead, label, keys, magnified=True)


def _residual_section(trace: Trace) -> str:
    """A panel for each output: the residuals over time."""
    scale = (
        '<fieldset class="segments small"><legend>Vertical scale</legend>'
        '<label><input type="radio" name="scale" value="all" checked><span>All</span></label>'
        '<label><input type="radio" name="scale" value="left"><span>What is left</span></label></fieldset>'
    )
    lead = f"The residual, measured minus co-simulated, over time. {_noise_band_sentence(trace)}"
    keys = legend_key("before") + legend_key("after") + legend_key("band", "± 2 standard deviations of the noise")
    content = f'<div class="bar"><p class="keys">{keys}</p>{scale}</div>' + _output_panels(
        trace, "residual", "Residual over time"
    )
    return section("residuals", "What the models leave", content, lead)


def _spectrum_section(trace: Trace, choices: Sequence[Mapping[str, Any]]) -> str:
    """A panel for each output: the spectra of the residuals, with the modes marked."""
    lead = (
        "How strongly the same residuals swing at each frequency: their amplitude spectral density (Welch, Hann "
        "windows). Sensor noise alone, alike at all frequencies (white), would lie on the dashed line. The bands are "
        "where the modes of the extended model, in which it swings by itself, lie along the path."
    )
    keys = (
        legend_key("recorded", "before")
        + legend_key("after")
        + legend_key("floor-line", "noise")
        + legend_key("mode", "modes, by number")
    )
    band_texts = [f"{choice['label']}: {band['words']}" for choice in choices for band in choice["bands"]]
    modes = (
        bullet_list(band_texts)
        if band_texts
        else "<p>No modes are marked: along this path the model does not rest.</p>"
    )
    panels = _output_panels(trace, "spectrum", "Spectrum of the residual")
    return section("spectra", "At which frequencies", f'{modes}<p class="keys">{keys}</p>{panels}', lead)


def _output_panels(trace: Trace, kind: str, what: str) -> str:
    """Figure panels of all outputs, positions and tensions in groups of their own."""
    indexed_outputs = list(enumerate(measured_outputs(trace)))
    groups = {
        title: [(index, output.label) for index, output in indexed_outputs if output.errors_key[0] == field]
        for title, field in (("Position", "axes"), ("Tension", "cables"))
    }
    return panel_groups(kind, groups, f"{what} before and after")


def _noise_band_sentence(trace: Trace) -> str:
    """A sentence on the source of the noise band."""
    declared = [noise_deviation(trace, output)[1] for output in measured_outputs(trace)]
    if all(declared):
        sensors = trace.robot_before.sensors
        sentence = "The band is the sensors&rsquo; noise as the robot file declares it"
        if sensors.winch_speed_noise:
            speed = format_significant(1e3 * sensors.winch_speed_noise)
            return f"{sentence}; noise of the winch speeds ({escape_text(speed)} mm/s) adds a slow drift beyond it."
        return f"{sentence}."
    if any(declared):
        return "The band is the sensors&rsquo; noise: declared in the robot file, or else estimated."
    return "The band is the sensors&rsquo; noise as estimated; the robot file declares none."
