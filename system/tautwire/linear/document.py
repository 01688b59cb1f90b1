"""The content of a model file of a linearised plant."""

from __future__ import annotations

from typing import Any

import numpy as np

from .plant import LinearPlant


def model_document(plant: LinearPlant) -> dict[str, Any]:
    """The content of a model file: operating point, modes, matrices as lists of rows, names, notes."""
    system, modes = plant.system, plant.modes
    return {
        "position": plant.position.tolist(),
        "tensions": plant.tensions.tolist(),
        "frequencies_hz": modes.frequencies.tolist(),
        "damping_ratios": modes.damping_ratios.tolist(),
        "damped_frequencies_hz": modes.damped_frequencies.tolist(),
        "mode_shapes": modes.shapes.tolist(),
        "cable_shares": modes.cable_shares.tolist(),
        **{name: np.asarray(getattr(system, name)).tolist() for name in ("A", "B", "C", "D")},
        "states": list(system.state_labels),
        "inputs": list(system.input_labels),
        "outputs": list(system.output_labels),
        "notes": list(plant.notes),
    }
