"""A trace as one HTML page that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..tracer.verdict import Trace
from . import sections
from .figures import measured_outputs, noise_deviation, trace_page_data
from .markup import bullet_list, escape_text, section
from .panels import panel_groups
from .scene import choice_buttons, figures_container, legend_key, scene_section
from .shell import html_page
from .tried import candidates_section
from .units import format_significant
from .where import localisation_section

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
