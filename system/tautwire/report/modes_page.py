"""A linearised robot as one HTML page that needs no network: its modes in motion, and the gains of its plant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from ..linear import LinearPlant
from ..robots.robot import Robot
from ..runs.wiring import AXES
from . import charts
from .markup import TableColumn, bullet_list, download_links, escape_text, number_html, section, table
from .modes_figures import GAIN_OUTPUT_TITLES, modes_data, signal_label
from .panels import panel_groups
from .scene import choice_buttons, figures_container, legend_key, scene_section
from .shell import html_page
from .units import format_percent, format_significant


def modes_page(robot: Robot, plant: LinearPlant, links: Mapping[str, str]) -> str:
    """The page of a robot linearised about rest; ``links`` maps labels to paths beside the page."""
    data = modes_data(robot, plant)
    choices = choice_buttons("Mode", [choice["label"] for choice in data["choices"]])
    parts = [
        _masthead(robot, plant, links),
        _modes_section(plant),
        figures_container(choices, _scene_section(robot)),
        _cables_section(plant),
        _gains_section(plant),
        _notes_section(plant),
    ]
    title = f"{robot.name}: {_modes_sentence(plant)}"
    return html_page(title, "\n".join(parts), data, ("modes.js",))


def _masthead(robot: Robot, plant: LinearPlant, links: Mapping[str, str]) -> str:
    position_text = ", ".join(format_significant(float(value), 4) for value in plant.position)
    verdict, css_class = (
        ("Small motions are linear here", "none") if not plant.notes else ("See the notes", "unexplained")
    )
    return (
        f'<header><p class="eyebrow"><strong>Tautwire linear plant</strong> '
        f"<span>{escape_text(robot.name)}, {robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{css_class}">{verdict}</p><h1>{escape_text(_modes_sentence(plant))}</h1>'
        f'<p class="aside">At rest at {number_html(position_text)} m, with {plant.system.nstates} states, {plant.system.ninputs} '
        f"inputs and {plant.system.noutputs} outputs.</p>{download_links(links)}</header>"
    )


def _modes_sentence(plant: LinearPlant) -> str:
    """The modes in one sentence."""
    modes = plant.modes
    frequency_counts = Counter(f"{format_significant(float(value))} Hz" for value in modes.frequencies)
    frequency_texts = [
        frequency_text if count == 1 else f"{frequency_text} ({count} modes)"
        for frequency_text, count in frequency_counts.items()
    ]
    frequencies_text = (
        frequency_texts[0]
        if len(frequency_texts) == 1
        else f"{', '.join(frequency_texts[:-1])} and {frequency_texts[-1]}"
    )
    min_ratio, max_ratio = (
        format_percent(float(value)) for value in (modes.damping_ratios.min(), modes.damping_ratios.max())
    )
    damping_text = (
        f"a damping ratio of {min_ratio}" if min_ratio == max_ratio else f"damping ratios of {min_ratio} to {max_ratio}"
    )
    return f"The platform swings at {frequencies_text}, with {damping_text}."


def _modes_section(plant: LinearPlant) -> str:
    modes = plant.modes
    columns = (
        TableColumn("Mode"), TableColumn("Frequency", True), TableColumn("Damping ratio", True), TableColumn("When damped", True),
        *(TableColumn(f"Along {axis}", True) for axis in AXES),
    )  # fmt: skip
    rows = [
        [
            f"Mode {mode + 1}",
            f"{format_significant(float(modes.frequencies[mode]), 4)} Hz",
            number_html(f"{format_significant(100.0 * float(modes.damping_ratios[mode]))} %"),
            "overdamped" if damped_frequency == 0.0 else f"{format_significant(float(damped_frequency), 4)} Hz",
            *(number_html(f"{round(float(value), 3) + 0.0:.3f}") for value in modes.shapes[:, mode]),
        ]
        for mode, damped_frequency in enumerate(modes.damped_frequencies)
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
    return scene_section("Shapes in motion", lead, label, legend_key("after", "swing of the platform"), slider="Phase")


def _cables_section(plant: LinearPlant) -> str:
    """Each cable's tension at rest, and its share of the potential energy of each mode."""
    shares, count = plant.modes.cable_shares, plant.modes.cable_shares.shape[1]
    columns = [TableColumn("Cable"), TableColumn("Tension at rest", True, True)]
    for mode in range(count):
        columns += [TableColumn(f"Of mode {mode + 1}", True), TableColumn("As a bar")]
    rows = []
    for cable, tension in enumerate(plant.tensions):
        row = [f"Cable {cable + 1}", f"{number_html(format_significant(float(tension), 4))} N"]
        for share in shares[cable]:
            row += [number_html(format_percent(float(share))), charts.bar(float(share), float(shares.max()))]
        rows.append(row)
    lead = "Each cable&rsquo;s part of the energy that a mode stores."
    return section("cables", "Which cables hold it", table("Cables", columns, rows, "shares", True), lead)


def _gains_section(plant: LinearPlant) -> str:
    """A panel for each output: gain and phase from the chosen input."""
    options = "".join(
        f'<option value="{place}">{escape_text(signal_label(name))}</option>'
        for place, name in enumerate(plant.system.input_labels)
    )
    control = f'<p class="controls"><label>Driven by <select id="source">{options}</select></label></p>'
    groups: dict[str, list[tuple[int, str]]] = {title: [] for title in GAIN_OUTPUT_TITLES.values()}
    shown = [name for name in plant.system.output_labels if name.rpartition("_")[0] in GAIN_OUTPUT_TITLES]
    for place, name in enumerate(shown):
        groups[GAIN_OUTPUT_TITLES[name.rpartition("_")[0]]].append((place, signal_label(name)))
    keys = f'<p class="keys">{legend_key("after", "gain, and below it the phase")}{legend_key("mode", "modes, by number")}</p>'
    lead = (
        "How much each output swings for each unit of the input that swings, over frequency (gain), and how far ahead "
        "of the input it is (phase; behind where negative)."
    )
    return section("gains", "Gains", control + keys + panel_groups("gain", groups, "Gain and phase"), lead)


def _notes_section(plant: LinearPlant) -> str:
    return section("notes", "Notes", bullet_list(plant.notes)) if plant.notes else ""
