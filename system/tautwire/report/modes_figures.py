"""The numbers that the figures of a linear plant's page draw."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant
from ..robots.robot import Robot
from .bands import joined
from .scene import Path, Scene, columns, scene_data
from .series import packed
from .units import significant

Array = NDArray[np.float64]

# Outputs whose gains are shown, by the first part of their names.
GAIN_OUTPUTS = {"position": "Position", "tension": "Tension"}
# What an input or output is counted in on the page, and how many SI units one of it is.
UNITS = {"position": ("mm", 1e-3), "tension": ("N", 1.0), "winch_speed": ("mm/s", 1e-3), "external_force": ("N", 1.0)}
SWING = 1e-3  # m, which the change of tension is told for
SWING_SHARE = 0.08  # of the robot's size, as drawn
STOPS = 73
PERIOD = 2.0  # s, one period as played
GAIN_POINTS = 300
BEYOND = 5.0


def modes_data(robot: Robot, plant: LinearPlant) -> dict[str, Any]:
    """The modes in motion, and the gains of the plant from each input, ready to draw."""
    frequency = _frequencies(plant)
    bands = [band.document() for band in joined(np.array([plant.modes.frequencies]))]
    return {
        "anchors": [[float(value) for value in anchor] for anchor in robot.anchors],
        "magnifications": [1],
        "choices": [_mode(robot, plant, mode) for mode in range(len(plant.modes.frequencies))],
        "frequency": packed(frequency),
        "bands": bands,
        "gains": _gains(plant, frequency),
    }


def signal_label(name: str) -> str:
    """A signal's name as a reader says it: "tension_2" is "tension 2"."""
    return name.replace("_", " ")


def _mode(robot: Robot, plant: LinearPlant, mode: int) -> dict[str, Any]:
    """One mode as a scene that goes round; "time" is a period's share in per cent."""
    phase = np.linspace(0.0, 1.0, STOPS)
    swing = np.cos(2.0 * np.pi * phase)[:, None]
    shape = plant.modes.shapes[:, mode]
    size = float(np.max(np.ptp(np.vstack((np.array(robot.anchors), plant.position)), axis=0)))
    platform = plant.position + SWING_SHARE * size * swing * shape
    change = SWING * swing * (plant.tension_slopes @ shape)
    largest = float(np.max(np.abs(change), initial=0.0)) or 1.0
    scene = scene_data(Scene(100.0 * phase, platform, change, (Path("swing", platform, "accent", 5),)))
    label = f"{mode + 1}: {significant(float(plant.modes.frequencies[mode]))} Hz"
    told = {
        "clock": "% of a period",
        "decimals": 0,
        "pace": PERIOD / 100.0,
        "cycle": True,
        "tensionRange": [-largest, largest],
        "tensionTitle": "Change of tension for 1 mm (N)",
    }
    return {"label": label, "scene": scene | told}


def _frequencies(plant: LinearPlant) -> Array:
    """Frequencies in Hz about the modes, and just at them, where gains have their peaks."""
    modes = plant.modes.frequencies
    around = np.geomspace(modes.min() / BEYOND, modes.max() * BEYOND, GAIN_POINTS)
    return np.union1d(around, modes)


def _gains(plant: LinearPlant, frequency: Array) -> list[dict[str, Any]]:
    """For each output the gain and phase from each input."""
    system = plant.system
    response = np.asarray(system(2j * np.pi * frequency))
    return [
        {
            "label": signal_label(name),
            "from": [_gain(system, response, row, source) for source in range(system.ninputs)],
        }
        for row, name in enumerate(system.output_labels)
        if name.rpartition("_")[0] in GAIN_OUTPUTS
    ]


def _gain(system: Any, response: Array, row: int, source: int) -> dict[str, Any]:
    """Gain in handy units and phase in degrees; null where the input does not act."""
    output, driver = system.output_labels[row], system.input_labels[source]
    (unit, one), (per, each) = UNITS[output.rpartition("_")[0]], UNITS[driver.rpartition("_")[0]]
    described = {"unit": f"{unit} per {per}", "by": signal_label(driver)}
    values = response[row, source]
    size = np.abs(values) * each / one
    if not np.max(size) > 0.0:
        return {**described, "gain": None, "phase": None, "peak": None}
    phase = np.degrees(np.unwrap(np.angle(values)))
    gain, turned = columns(np.column_stack((size, phase)))
    return {**described, "gain": gain, "phase": turned, "peak": significant(float(np.max(size)))}
