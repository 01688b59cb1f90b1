"""The data of the figures on a linear plant's page."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant
from ..robots.robot import Robot
from .bands import merge_mode_bands
from .scene import RobotScene, ScenePath, pack_columns, scene_data
from .series import pack_float32
from .units import format_significant

Array = NDArray[np.float64]

# Outputs whose gains are drawn, by the prefix of their names.
GAIN_OUTPUT_TITLES = {"position": "Position", "tension": "Tension"}
# Unit of an input or output on the page, and its size in SI units.
SIGNAL_UNITS = {
    "position": ("mm", 1e-3),
    "tension": ("N", 1.0),
    "winch_speed": ("mm/s", 1e-3),
    "external_force": ("N", 1.0),
}
SWING_AMPLITUDE = 1e-3  # m, for which the change of tension is stated
DRAWN_SWING_SHARE = 0.08  # of the robot's size, as drawn
FRAME_COUNT = 73
PLAYBACK_PERIOD = 2.0  # s, playback time of one period
FREQUENCY_POINTS = 300
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
    platform = plant.position + DRAWN_SWING_SHARE * size * swing * shape
    tension_change = SWING_AMPLITUDE * swing * (plant.tension_slopes @ shape)
    max_tension_change = float(np.max(np.abs(tension_change), initial=0.0)) or 1.0
    scene = scene_data(
        RobotScene(100.0 * phase, platform, tension_change, (ScenePath("swing", platform, "accent", 5),))
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
    modes = plant.modes.frequencies
    around = np.geomspace(
        modes.min() / FREQUENCY_MARGIN_FACTOR, modes.max() * FREQUENCY_MARGIN_FACTOR, FREQUENCY_POINTS
    )
    return np.union1d(around, modes)


def _gains_data(plant: LinearPlant, frequency: Array) -> list[dict[str, Any]]:
    """Gain and phase of each output from each input."""
    system = plant.system
    response = np.asarray(system(2j * np.pi * frequency))
    return [
        {
            "label": signal_label(name),
            "from": [_gain_data(system, response, output_index, input_index) for input_index in range(system.ninputs)],
        }
        for output_index, name in enumerate(system.output_labels)
        if name.rpartition("_")[0] in GAIN_OUTPUT_TITLES
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
