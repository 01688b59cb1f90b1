"""The linearised plant in discrete time, with winch speeds that are ramps between samples."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant
from ..robot.platform_symbols import StateIndices

Array = NDArray[np.float64]


def sensor_output_indices(linear: LinearPlant) -> list[int]:
    """Indices of pose and tensions among the plant's outputs."""
    indices = StateIndices(linear.degrees_of_freedom, len(linear.tensions))
    outputs = range(linear.system.noutputs)
    return [*outputs[indices.pose], *outputs[indices.tensions]]


def sampled_plant(linear: LinearPlant, period: float) -> Any:
    """Discrete plant from winch accelerations, held for ``period`` (s), to pose, tensions and winch speeds.

    A ``control.StateSpace`` with states (plant, winch speeds): inputs held over a sample are then ramps of speed.
    """
    system, count = linear.system, len(linear.tensions)
    sensor_rows = sensor_output_indices(linear)
    winches = list(system.input_labels[:count])
    zeros, identity = np.zeros((count, system.nstates)), np.eye(count)
    driven = control.ss(
        np.block([[system.A, system.B[:, :count]], [zeros, np.zeros_like(identity)]]),
        np.vstack([zeros.T, identity]),
        np.block([[system.C[sensor_rows], system.D[sensor_rows, :count]], [zeros, identity]]),
        0.0,
        states=[*system.state_labels, *winches],
        inputs=[f"winch_acceleration_{index}" for index in range(1, count + 1)],
        outputs=[*(system.output_labels[row] for row in sensor_rows), *winches],
    )
    return control.sample_system(driven, period, method="zoh", name="sampled_plant")


def ramp_plant(linear: LinearPlant, period: float) -> Any:
    """Discrete plant from winch speeds to pose and tensions at the samples: ``control.StateSpace``, (d + n, n)."""
    system, count = linear.system, len(linear.tensions)
    sensor_rows = sensor_output_indices(linear)
    driven = control.ss(
        system.A,
        system.B[:, :count],
        system.C[sensor_rows],
        system.D[sensor_rows, :count],
        inputs=system.input_labels[:count],
        outputs=[system.output_labels[row] for row in sensor_rows],
    )
    return control.sample_system(driven, period, method="foh", name="ramp_plant")
