"""A trace as one HTML page that needs no network."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from string import Template

from ..tracer.verdict import Trace
from . import sections
from .figures import ROLE_LABELS, noise_of, outputs, page_data
from .markup import inline_json, section, text
from .summary import Output
from .units import significant
from .where import where

SCRIPTS = ("drawing.js", "panels.js", "scene.js", "page.js")
DETAILS = (where, sections.candidates, sections.left, sections.unseen, sections.notes)
VIEWS = ("Perspective", "Top", "Front", "Side")


def trace_page(trace: Trace, links: Mapping[str, str]) -> str:
    """The report page; ``links`` maps labels to paths beside the page, such as "robot.toml"."""
    # Imported here: plotly takes long to import, and only pages need it.
    from plotly.offline import get_plotlyjs

    return Template(_asset("page.html")).substitute(
        title=text(f"{trace.robot_before.name}: {trace.sentence}"),
        style=_asset("style.css"),
        header=sections.masthead(trace, links),
        summary=sections.summary(trace) + sections.found(trace) + sections.also_possible(trace),
        chooser=_chooser(trace),
        figures=_scene_section(trace) + _residual_section(trace) + _spectrum_section(trace),
        details="".join(part(trace) for part in DETAILS),
        data=inline_json(page_data(trace)),
        plotly=get_plotlyjs(),
        scripts="\n".join(_asset(name) for name in SCRIPTS),
    )


def _asset(name: str) -> str:
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


def _chooser(trace: Trace) -> str:
    """Radio buttons that choose the recording that the figures show."""
    buttons = "".join(
        f'<label><input type="radio" name="recording" value="{place}"{" checked" if place == 0 else ""}>'
        f"<span>{text(ROLE_LABELS.get(each.role, each.role))}</span></label>"
        for place, each in enumerate(trace.comparisons)
    )
    return f'<fieldset class="segments"><legend>Shown below</legend>{buttons}</fieldset>' if buttons else ""


def _scene_section(trace: Trace) -> str:
    """The robot in space with its controls."""
    views = "".join(f'<button type="button" data-view="{view.lower()}">{view}</button>' for view in VIEWS)
    content = (
        '<figure class="scene"><div class="plot" id="scene" role="img" '
        f'aria-label="The robot in space: {trace.robot_before.cable_count} cables from their exit points to the '
        'platform, coloured by tension, and the paths before, after and measured."></div></figure>'
        '<div class="controls"><button type="button" id="play" aria-pressed="false">Play</button>'
        '<label class="time">Time <input type="range" id="time" min="0" max="0" value="0" step="1">'
        '<output id="time-shown" for="time"></output></label></div>'
        f'<div class="controls"><span class="buttons" role="group" aria-label="View">{views}</span>'
        '<label>Deviations drawn <select id="magnify"></select></label></div>'
        '<div class="tensions" id="tensions" aria-label="Tensions at this time"></div>'
    )
    lead = (
        "Cables are coloured by their tension in the extended model. Differences from the extended model&rsquo;s path "
        "are drawn larger, by the factor chosen below the picture."
    )
    key = '<p class="keys">' + _key("before") + _key("after") + _key("measured") + "</p>"
    return section("robot", "The robot in motion", key + content, lead)


def _residual_section(trace: Trace) -> str:
    """A panel for each output: what the models leave over time."""
    scale = (
        '<fieldset class="segments small"><legend>Vertical scale</legend>'
        '<label><input type="radio" name="scale" value="all" checked><span>All</span></label>'
        '<label><input type="radio" name="scale" value="left"><span>What is left</span></label></fieldset>'
    )
    lead = f"Measured minus co-simulated, over time. {_band_text(trace)}"
    keys = '<p class="keys">' + _key("before") + _key("after") + _key("band", "± 2 &sigma; of the noise") + "</p>"
    content = f'<div class="bar">{keys}{scale}</div>' + _panels(trace, "residual")
    return section("residuals", "What the models leave", content, lead)


def _spectrum_section(trace: Trace) -> str:
    """A panel for each output: spectra of what the models leave."""
    lead = (
        "Amplitude spectral density of the same residuals (Welch, Hann windows). White sensor noise alone would "
        "lie on the dashed line."
    )
    keys = '<p class="keys">' + _key("before") + _key("after") + _key("floor-line", "noise") + "</p>"
    return section("spectra", "At which frequencies", keys + _panels(trace, "spectrum"), lead)


def _panels(trace: Trace, kind: str) -> str:
    """Figures for all outputs, positions apart from tensions; scripts fill them when they come into view."""
    shown = list(enumerate(outputs(trace)))
    groups = (
        ("Position", [each for each in shown if each[1].key[0] == "axes"]),
        ("Tension", [each for each in shown if each[1].key[0] == "cables"]),
    )
    return "".join(
        f'<h3>{title}</h3><div class="panels">{"".join(_panel(kind, *each) for each in group)}</div>'
        for title, group in groups
    )


def _panel(kind: str, place: int, output: Output) -> str:
    """An empty figure; its caption and label follow the chosen recording."""
    return (
        f'<figure class="panel" data-kind="{kind}" data-channel="{place}"><figcaption><strong>{text(output.label)}'
        '</strong> <span class="numbers"></span></figcaption>'
        f'<div class="plot" role="img" aria-label="{kind} of {text(output.label)} before and after"></div></figure>'
    )


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


def _key(name: str, label: str = "") -> str:
    return f'<span class="key key-{name}">{label or name}</span>'
