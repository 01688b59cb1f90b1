"""A linearised robot as one HTML page that needs no network: its modes in motion, and the gains of its plant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant
from ..linear.operating_point import Pose
from ..number_format import format_percent, format_significant
from ..provenance import Provenance
from ..robot.schema import Robot
from . import inline_charts as charts
from .downsampling import pack_float32
from .mode_bands import merge_mode_bands
from .page_rendering import Number, PageHeader, Row, render_page
from .robot_scene import RobotScene, ScenePath, pack_columns, scene_data

Array = NDArray[np.float64]

# Outputs whose gains are drawn, by the prefix of their names.
GAIN_OUTPUT_TITLES = {"position": "Position", "rotation": "Rotation", "tension": "Tension"}
# Unit of an input or output on the page, and its size in SI units.
SIGNAL_UNITS = {
    "position": ("mm", 1e-3),
    "rotation": ("mrad", 1e-3),
    "tension": ("N", 1.0),
    "winch_speed": ("mm/s", 1e-3),
    "external_force": ("N", 1.0),
    "external_moment": ("N m", 1.0),
}
POINT_SHAPE_TITLES = ("Shape along x", "Along y", "Along z")
BODY_SHAPE_TITLES = ("About x", "About y", "About z", "Translation")
POINT_SHAPE_TEXT = "and mode shape as a unit vector."
BODY_SHAPE_TEXT = (
    "and mode shape: the motion of the origin, and the turning in rad, by which an attachment or the centre of mass "
    "moves by 1 m at most. Translation is the share of the centre of mass in the kinetic energy."
)
SWING_AMPLITUDE = 1e-3  # m, for which the change of tension is stated
DRAWN_SWING_SHARE = 0.08  # of the robot's size, as drawn
FRAME_COUNT = 73
PLAYBACK_PERIOD = 2.0  # s, playback time of one period
MAX_GAIN_NUMBERS = 70_000  # in all gain curves of a page, which so weighs at most 1.5 MB
MAX_FREQUENCY_POINTS, MIN_FREQUENCY_POINTS = 300, 50  # per curve, beside the modes
FREQUENCY_MARGIN_FACTOR = 5.0


def modes_data(robot: Robot, plant: LinearPlant) -> dict[str, Any]:
    """The figure data: mode shapes in motion, and the frequency response of the plant from each input."""
    frequency = _frequency_grid(plant)
    bands = [band.document() for band in merge_mode_bands(np.array([plant.modes.frequencies]))]
    return {
        "anchors": [[float(value) for value in anchor] for anchor in robot.anchors],
        "magnifications": [1],
        "choices": [_mode_data(robot, plant, mode) for mode in range(len(plant.modes.frequencies))],
        "frequency": pack_float32(frequency),
        "bands": bands,
        "gains": _gains_data(plant, frequency),
    }


def signal_label(name: str) -> str:
    """A signal's name as text: "tension_2" is "tension 2"."""
    return name.replace("_", " ")


def _mode_data(robot: Robot, plant: LinearPlant, mode: int) -> dict[str, Any]:
    """One mode shape as a looping scene; "time" is the phase in per cent of a period."""
    phase = np.linspace(0.0, 1.0, FRAME_COUNT)
    swing = np.cos(2.0 * np.pi * phase)[:, None]
    shape = plant.modes.shapes[:, mode]
    size = float(np.max(np.ptp(np.vstack((np.array(robot.anchors), plant.position)), axis=0)))
    platform = plant.position + DRAWN_SWING_SHARE * size * swing * shape[:3]
    pose = Pose(robot, plant.position, plant.orientation)
    moved = DRAWN_SWING_SHARE * size * swing[:, :, None] * pose.displacements(shape[:, None])[1:, :, 0]
    attachments = pose.attachments + moved if robot.platform.is_rigid_body else None
    tension_change = SWING_AMPLITUDE * swing * (plant.tension_slopes @ shape)
    max_tension_change = float(np.max(np.abs(tension_change), initial=0.0)) or 1.0
    scene = scene_data(
        RobotScene(
            100.0 * phase,
            platform,
            tension_change,
            (ScenePath("swing", platform, "accent", 5),),
            attachments=attachments,
        )
    )
    label = f"{mode + 1}: {format_significant(float(plant.modes.frequencies[mode]))} Hz"
    animation = {
        "clock": "% of a period",
        "decimals": 0,
        "pace": PLAYBACK_PERIOD / 100.0,
        "cycle": True,
        "tensionRange": [-max_tension_change, max_tension_change],
        "tensionTitle": "Change of tension for 1 mm (N)",
    }
    return {"label": label, "scene": scene | animation}


def _frequency_grid(plant: LinearPlant) -> Array:
    """Frequency grid in Hz around the modes, including the modal frequencies, where gains peak."""
    modes, curve_count = plant.modes.frequencies, 2 * len(_drawn_outputs(plant)) * plant.system.ninputs
    points = int(np.clip(MAX_GAIN_NUMBERS // curve_count, MIN_FREQUENCY_POINTS, MAX_FREQUENCY_POINTS))
    around = np.geomspace(modes.min() / FREQUENCY_MARGIN_FACTOR, modes.max() * FREQUENCY_MARGIN_FACTOR, points)
    return np.union1d(around, modes)


def _drawn_outputs(plant: LinearPlant) -> list[tuple[int, str]]:
    """Indices and names of the outputs whose gains are drawn."""
    return [
        (index, name)
        for index, name in enumerate(plant.system.output_labels)
        if name.rpartition("_")[0] in GAIN_OUTPUT_TITLES
    ]


def _gains_data(plant: LinearPlant, frequency: Array) -> list[dict[str, Any]]:
    """Gain and phase of each output from each input."""
    system = plant.system
    response = np.asarray(system(2j * np.pi * frequency))
    return [
        {
            "label": signal_label(name),
            "from": [_gain_data(system, response, output_index, input_index) for input_index in range(system.ninputs)],
        }
        for output_index, name in _drawn_outputs(plant)
    ]


def _gain_data(system: Any, response: Array, output_index: int, input_index: int) -> dict[str, Any]:
    """Gain in the page's units and phase in degrees; None where the input does not act on the output."""
    output_name, input_name = system.output_labels[output_index], system.input_labels[input_index]
    (output_unit, output_unit_size), (input_unit, input_unit_size) = (
        SIGNAL_UNITS[output_name.rpartition("_")[0]],
        SIGNAL_UNITS[input_name.rpartition("_")[0]],
    )
    description = {"unit": f"{output_unit} per {input_unit}", "by": signal_label(input_name)}
    values = response[output_index, input_index]
    magnitude = np.abs(values) * input_unit_size / output_unit_size
    if not np.max(magnitude) > 0.0:
        return {**description, "gain": None, "phase": None, "peak": None}
    phase = np.degrees(np.unwrap(np.angle(values)))
    packed_gain, packed_phase = pack_columns(np.column_stack((magnitude, phase)))
    return {
        **description,
        "gain": packed_gain,
        "phase": packed_phase,
        "peak": format_significant(float(np.max(magnitude))),
    }


def modes_page(robot: Robot, plant: LinearPlant, links: Mapping[str, str], provenance: Provenance | None = None) -> str:
    """The page of a robot linearised about rest; ``links`` maps labels to paths beside the page."""
    figures, headline = modes_data(robot, plant), _modes_sentence(plant)
    subject, title = f"{robot.name}, {robot.cable_count} cables", f"{robot.name}: {headline}"
    verdict = ("See the notes", "unexplained") if plant.notes else ("Linear for small motions", "none")
    return render_page(
        "modes",
        PageHeader("Tautwire linear plant", subject, headline, title, *verdict, links, provenance),
        figures,
        robot=robot,
        plant=plant,
        position=", ".join(format_significant(float(value), 4) for value in plant.position),
        modes=_mode_rows(plant),
        shape_text=BODY_SHAPE_TEXT if robot.platform.is_rigid_body else POINT_SHAPE_TEXT,
        shape_titles=[*POINT_SHAPE_TITLES, *(BODY_SHAPE_TITLES if robot.platform.is_rigid_body else ())],
        mode_labels=[choice["label"] for choice in figures["choices"]],
        cables=_cable_rows(plant),
        inputs=[signal_label(name) for name in plant.system.input_labels],
        outputs=_gain_panels(figures["gains"]),
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


def _mode_rows(plant: LinearPlant) -> list[Row]:
    """Frequency, damping ratio, damped frequency and shape of each mode; of a rigid body its translational share."""
    modes, is_rigid = plant.modes, len(plant.modes.shapes) > len(POINT_SHAPE_TITLES)
    return [
        [
            f"Mode {mode + 1}",
            f"{format_significant(float(modes.frequencies[mode]), 4)} Hz",
            Number(f"{format_significant(100.0 * float(modes.damping_ratios[mode]))} %"),
            "overdamped" if damped_frequency == 0.0 else f"{format_significant(float(damped_frequency), 4)} Hz",
            *(Number(f"{round(float(value), 3) + 0.0:.3f}") for value in modes.shapes[:, mode]),
            *([Number(format_percent(float(modes.translational_shares[mode])))] if is_rigid else []),
        ]
        for mode, damped_frequency in enumerate(modes.damped_frequencies)
    ]


def _cable_rows(plant: LinearPlant) -> list[Row]:
    """Each cable's tension at rest, and its share of the potential energy of each mode as a number and a bar."""
    shares = plant.modes.cable_shares
    largest = float(shares.max())
    return [
        [
            f"Cable {cable + 1}",
            Number(f"{format_significant(float(tension), 4)} N"),
            *(
                cell
                for share in map(float, shares[cable])
                for cell in (Number(format_percent(share)), charts.bar(share, largest))
            ),
        ]
        for cable, tension in enumerate(plant.tensions)
    ]


def _gain_panels(gains: Sequence[Mapping[str, Any]]) -> dict[str, list[tuple[int, str]]]:
    """Channel indices and labels of the drawn outputs, by quantity."""
    channels = list(enumerate(gain["label"] for gain in gains))
    return {
        title: [(index, label) for index, label in channels if label.startswith(prefix)]
        for prefix, title in GAIN_OUTPUT_TITLES.items()
    }
