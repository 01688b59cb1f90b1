"""A linearised robot as one HTML page that needs no network: its modes in motion, and the gains of its plant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from ..linear import LinearPlant
from ..robots.robot import Robot
from ..runs.wiring import AXES
from . import charts
from .markup import Column, bullets, downloads, number, section, table, text
from .modes_figures import GAIN_OUTPUTS, modes_data, signal_label
from .panels import panel_groups
from .scene import chooser, figures_body, key, scene_section
from .shell import html_page
from .units import percent, significant


def modes_page(robot: Robot, plant: LinearPlant, links: Mapping[str, str]) -> str:
    """The page of a robot linearised about rest; ``links`` maps labels to paths beside the page."""
    data = modes_data(robot, plant)
    choices = chooser("Mode", [choice["label"] for choice in data["choices"]])
    parts = [
        _masthead(robot, plant, links),
        _modes_section(plant),
        figures_body(choices, _scene_section(robot)),
        _cables_section(plant),
        _gains_section(plant),
        _notes(plant),
    ]
    title = f"{robot.name}: {_sentence(plant)}"
    return html_page(title, "\n".join(parts), data, ("modes.js",))


def _masthead(robot: Robot, plant: LinearPlant, links: Mapping[str, str]) -> str:
    place = ", ".join(significant(float(value), 4) for value in plant.position)
    verdict, kind = ("Small motions are linear here", "none") if not plant.notes else ("See the notes", "unexplained")
    return (
        f'<header><p class="eyebrow"><strong>Tautwire linear plant</strong> '
        f"<span>{text(robot.name)}, {robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{kind}">{verdict}</p><h1>{text(_sentence(plant))}</h1>'
        f'<p class="aside">At rest at {number(place)} m, with {plant.system.nstates} states, {plant.system.ninputs} '
        f"inputs and {plant.system.noutputs} outputs.</p>{downloads(links)}</header>"
    )


def _sentence(plant: LinearPlant) -> str:
    """The modes in one sentence."""
    modes = plant.modes
    hertz = Counter(f"{significant(float(value))} Hz" for value in modes.frequencies)
    said = [shown if count == 1 else f"{shown} ({count} modes)" for shown, count in hertz.items()]
    swings = said[0] if len(said) == 1 else f"{', '.join(said[:-1])} and {said[-1]}"
    least, most = (percent(float(value)) for value in (modes.damping_ratios.min(), modes.damping_ratios.max()))
    ratios = f"a damping ratio of {least}" if least == most else f"damping ratios of {least} to {most}"
    return f"The platform swings at {swings}, with {ratios}."


def _modes_section(plant: LinearPlant) -> str:
    modes = plant.modes
    columns = (
        Column("Mode"), Column("Frequency", True), Column("Damping ratio", True), Column("When damped", True),
        *(Column(f"Along {axis}", True) for axis in AXES),
    )  # fmt: skip
    rows = [
        [
            f"Mode {place + 1}",
            f"{significant(float(modes.frequencies[place]), 4)} Hz",
            number(f"{significant(100.0 * float(modes.damping_ratios[place]))} %"),
            "overdamped" if turning == 0.0 else f"{significant(float(turning), 4)} Hz",
            *(number(f"{round(float(value), 3) + 0.0:.3f}") for value in modes.shapes[:, place]),
        ]
        for place, turning in enumerate(modes.damped_frequencies)
    ]
    lead = (
        "How the platform swings by itself about rest, with the winches held: undamped frequency, damping ratio (100 % "
        "where it just no longer swings), frequency with that damping, and the direction, as a vector of length one."
    )
    return section("modes", "Modes", table("Modes of the platform", columns, rows, "modes", True), lead)


def _scene_section(robot: Robot) -> str:
    """The mode's shape in motion, with its controls."""
    lead = (
        "The shape is drawn far larger than it swings, and without its decay. Cables are coloured by how their tension "
        "changes for a swing of 1 mm."
    )
    label = (
        f"The robot in space: {robot.cable_count} cables from their exit points to the platform, which swings along "
        "the chosen mode, coloured by the change of their tension."
    )
    return scene_section("Shapes in motion", lead, label, key("after", "swing of the platform"), slider="Phase")


def _cables_section(plant: LinearPlant) -> str:
    """What each cable carries at rest, and its part of the energy that a mode stores."""
    shares, count = plant.modes.cable_shares, plant.modes.cable_shares.shape[1]
    columns = [Column("Cable"), Column("Tension at rest", True, True)]
    for mode in range(count):
        columns += [Column(f"Of mode {mode + 1}", True), Column("As a bar")]
    rows = []
    for cable, tension in enumerate(plant.tensions):
        row = [f"Cable {cable + 1}", f"{number(significant(float(tension), 4))} N"]
        for share in shares[cable]:
            row += [number(percent(float(share))), charts.bar(float(share), float(shares.max()))]
        rows.append(row)
    lead = "Each cable&rsquo;s part of the energy that a mode stores."
    return section("cables", "Which cables hold it", table("Cables", columns, rows, "shares", True), lead)


def _gains_section(plant: LinearPlant) -> str:
    """A panel for each output: gain and phase from the chosen input."""
    options = "".join(
        f'<option value="{place}">{text(signal_label(name))}</option>'
        for place, name in enumerate(plant.system.input_labels)
    )
    control = f'<p class="controls"><label>Driven by <select id="source">{options}</select></label></p>'
    groups: dict[str, list[tuple[int, str]]] = {title: [] for title in GAIN_OUTPUTS.values()}
    shown = [name for name in plant.system.output_labels if name.rpartition("_")[0] in GAIN_OUTPUTS]
    for place, name in enumerate(shown):
        groups[GAIN_OUTPUTS[name.rpartition("_")[0]]].append((place, signal_label(name)))
    keys = f'<p class="keys">{key("after", "gain, and below it the phase")}{key("mode", "modes, by number")}</p>'
    lead = (
        "How much each output swings for each unit of the input that swings, over frequency (gain), and how far ahead "
        "of the input it is (phase; behind where negative)."
    )
    return section("gains", "Gains", control + keys + panel_groups("gain", groups, "Gain and phase"), lead)


def _notes(plant: LinearPlant) -> str:
    return section("notes", "Notes", bullets(plant.notes)) if plant.notes else ""
