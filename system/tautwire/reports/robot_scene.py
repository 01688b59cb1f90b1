"""The 3D scene of a robot on a page: what the slider moves, as data, and the figure with its controls, as HTML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .downsampling import pack_float32
from .html_markup import escape_text, section

Array = NDArray[np.float64]

VIEWS = {"perspective": "Perspective", "top": "Top", "front": "Front", "side": "Side", "close": "Close up"}
# s; a longer run is played faster.
MAX_PLAYBACK_TIME = 60.0


@dataclass(frozen=True)
class ScenePath:
    """A path in the scene: ``points`` (N, 3) in m; ``colour`` is a name in the style, ``dash`` one of plotly's."""

    name: str
    points: Array
    colour: str
    width: float
    dash: str = "solid"


@dataclass(frozen=True)
class RobotScene:
    """The frames of the slider: ``platform`` (N, 3) in m and ``tension`` (N, n) in N at ``time`` (N,) in s.

    Deviations of ``paths`` from the platform's own are drawn ``magnification`` times larger. ``measured_tension`` has
    the shape of ``tension``, None where there is none.
    """

    time: Array
    platform: Array
    tension: Array
    paths: tuple[ScenePath, ...]
    measured_tension: Array | None = None
    magnification: int = 1


def pack_columns(values: Array) -> list[str]:
    """Each column packed as base64 of float32."""
    return [pack_float32(column) for column in values.T]


def scene_data(scene: RobotScene) -> dict[str, Any]:
    """The JSON data of a scene for ``scene.js``."""
    finite = scene.tension[np.isfinite(scene.tension)]
    duration = float(scene.time[-1] - scene.time[0])
    return {
        "time": pack_float32(scene.time),
        "clock": "s",
        "decimals": 2,
        "pace": min(1.0, MAX_PLAYBACK_TIME / duration) if duration > 0.0 else 1.0,
        "cycle": False,
        "platform": pack_columns(scene.platform),
        "paths": [
            {"name": p.name, "columns": pack_columns(p.points), "colour": p.colour, "width": p.width, "dash": p.dash}
            for p in scene.paths
        ],
        "tension": pack_columns(scene.tension),
        "measuredTension": None if scene.measured_tension is None else pack_columns(scene.measured_tension),
        "tensionRange": [float(finite.min()), float(finite.max())] if finite.size else [0.0, 1.0],
        "tensionTitle": "Tension (N)",
        "tensionUnit": "N",
        "magnify": scene.magnification,
    }


def scene_section(
    title: str, lead: str, label: str, legend: str = "", magnified: bool = False, slider: str = "Time"
) -> str:
    """The figure with its ``slider`` and views; ``lead`` and ``legend`` are HTML, ``label`` describes the figure."""
    views = "".join(f'<button type="button" data-view="{view}">{label}</button>' for view, label in VIEWS.items())
    magnify = '<label>Deviations drawn <select id="magnify"></select></label>' if magnified else ""
    content = (
        '<figure class="scene"><div class="plot" id="scene" role="img" '
        f'aria-label="{escape_text(label)}"></div></figure>'
        '<div class="controls"><button type="button" id="play" aria-pressed="false">Play</button>'
        f'<label class="time">{slider} <input type="range" id="time" min="0" max="0" value="0" step="1">'
        '<output id="time-shown" for="time"></output></label></div>'
        '<p class="aside" id="flat" hidden>This browser shows no 3D (WebGL is off): the robot is drawn flat.</p>'
        f'<div class="controls"><span class="buttons" role="group" aria-label="View">{views}</span>{magnify}</div>'
        '<div class="tensions" id="tensions" role="group" aria-label="What the cables carry then"></div>'
    )
    return section("robot", title, (f'<p class="keys">{legend}</p>' if legend else "") + content, lead)


def choice_buttons(legend: str, labels: Sequence[str]) -> str:
    """Radio buttons that select what the figures below show."""
    buttons = "".join(
        f'<label><input type="radio" name="choice" value="{index}"{" checked" if index == 0 else ""}>'
        f"<span>{escape_text(label)}</span></label>"
        for index, label in enumerate(labels)
    )
    if not buttons:
        return ""
    choices = f'<fieldset class="segments"><legend>{escape_text(legend)}</legend>{buttons}</fieldset>'
    return f'<div class="chooser">{choices}</div>'


def figures_container(choices: str, figures: str) -> str:
    """The part of a page below its choice buttons, which stay in view while it scrolls."""
    notice = "The figures below need JavaScript; all numbers are in the tables."
    return f'<div class="chosen">{choices}<noscript><p class="aside">{notice}</p></noscript>{figures}</div>'


def legend_key(name: str, label: str = "") -> str:
    """An entry of a legend; ``name`` is a class of the style, ``label`` HTML."""
    return f'<span class="key key-{name}">{label or name}</span>'
