"""A trace as one HTML page that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..tracer.verdict import Trace
from . import sections
from .figures import noise_of, outputs, page_data
from .markup import bullets, section, text
from .panels import panel_groups
from .scene import chooser, figures_body, key, scene_section
from .shell import html_page
from .tried import tried
from .units import significant
from .where import where

DETAILS = (where, tried, sections.left, sections.unseen, sections.notes)


def trace_page(trace: Trace, links: Mapping[str, str]) -> str:
    """The report page; ``links`` maps labels to paths beside the page, such as "robot.toml"."""
    data = page_data(trace)
    choices = chooser("Shown below", [choice["label"] for choice in data["choices"]])
    figures = _scene_section(trace) + _residual_section(trace) + _spectrum_section(trace, data["choices"])
    parts = [
        sections.masthead(trace, links),
        sections.summary(trace),
        sections.found(trace),
        sections.also_possible(trace),
        figures_body(choices, figures),
        *(part(trace) for part in DETAILS),
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
    keys = key("before") + key("after") + key("measured")
    return scene_section("The robot in motion", lead, label, keys, magnified=True)


def _residual_section(trace: Trace) -> str:
    """A panel for each output: what the models leave over time."""
    scale = (
        '<fieldset class="segments small"><legend>Vertical scale</legend>'
        '<label><input type="radio" name="scale" value="all" checked><span>All</span></label>'
        '<label><input type="radio" name="scale" value="left"><span>What is left</span></label></fieldset>'
    )
    lead = f"The residual, measured minus co-simulated, over time. {_band_text(trace)}"
    keys = key("before") + key("after") + key("band", "± 2 standard deviations of the noise")
    content = f'<div class="bar"><p class="keys">{keys}</p>{scale}</div>' + _panels(
        trace, "residual", "Residual over time"
    )
    return section("residuals", "What the models leave", content, lead)


def _spectrum_section(trace: Trace, choices: Sequence[Mapping[str, Any]]) -> str:
    """A panel for each output: spectra of what the models leave, with the modes marked."""
    lead = (
        "How strongly the same residuals swing at each frequency: their amplitude spectral density (Welch, Hann "
        "windows). Sensor noise alone, alike at all frequencies (white), would lie on the dashed line. The bands are "
        "where the modes of the extended model, in which it swings by itself, lie along the path."
    )
    keys = key("recorded", "before") + key("after") + key("floor-line", "noise") + key("mode", "modes, by number")
    told = [f"{choice['label']}: {band['words']}" for choice in choices for band in choice["bands"]]
    modes = bullets(told) if told else "<p>No modes are marked: along this path the model does not rest.</p>"
    panels = _panels(trace, "spectrum", "Spectrum of the residual")
    return section("spectra", "At which frequencies", f'{modes}<p class="keys">{keys}</p>{panels}', lead)


def _panels(trace: Trace, kind: str, what: str) -> str:
    """Figures for all outputs, positions apart from tensions."""
    shown = list(enumerate(outputs(trace)))
    groups = {
        title: [(place, output.label) for place, output in shown if output.key[0] == field]
        for title, field in (("Position", "axes"), ("Tension", "cables"))
    }
    return panel_groups(kind, groups, f"{what} before and after")


def _band_text(trace: Trace) -> str:
    """Where the noise band comes from."""
    declared = [noise_of(trace, output)[1] for output in outputs(trace)]
    if all(declared):
        sensors = trace.robot_before.sensors
        said = "The band is the sensors&rsquo; noise as the robot file declares it"
        if sensors.winch_speed_noise:
            speed = significant(1e3 * sensors.winch_speed_noise)
            return f"{said}; noise of the winch speeds ({text(speed)} mm/s) adds a slow drift beyond it."
        return f"{said}."
    if any(declared):
        return "The band is the sensors&rsquo; noise: declared in the robot file, or else estimated."
    return "The band is the sensors&rsquo; noise as estimated; the robot file declares none."
