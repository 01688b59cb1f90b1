"""The linearised plant as a sampled controller meets it: winch speeds that run on ramps from sample to sample."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..linear import LinearPlant

Array = NDArray[np.float64]


def measured(linear: LinearPlant) -> list[int]:
    """Places of position and tensions among the plant's outputs."""
    return [*range(3), *range(6, 6 + len(linear.tensions))]


def sampled_plant(linear: LinearPlant, period: float) -> Any:
    """From winch accelerations, held over samples of ``period`` (s), to position, tensions and winch speeds.

    A ``control.StateSpace`` with states (plant, winch speeds): inputs held over a sample are then ramps of speed.
    """
    system, count = linear.system, len(linear.tensions)
    seen = measured(linear)
    winches = list(system.input_labels[:count])
    still, each = np.zeros((count, system.nstates)), np.eye(count)
    driven = control.ss(
        np.block([[system.A, system.B[:, :count]], [still, np.zeros_like(each)]]),
        np.vstack([still.T, each]),
        np.block([[system.C[seen], system.D[seen, :count]], [still, each]]),
        0.0,
        states=[*system.state_labels, *winches],
        inputs=[f"winch_acceleration_{index}" for index in range(1, count + 1)],
        outputs=[*(system.output_labels[place] for place in seen), *winches],
    )
    return control.sample_system(driven, period, method="zoh", name="sampled_plant")


def ramp_plant(linear: LinearPlant, period: float) -> Any:
    """From winch speeds at the samples to position and tensions there: a ``control.StateSpace``, shape (3 + n, n)."""
    system, count = linear.system, len(linear.tensions)
    seen = measured(linear)
    driven = control.ss(
        system.A,
        system.B[:, :count],
        system.C[seen],
        system.D[seen, :count],
        inputs=system.input_labels[:count],
        outputs=[system.output_labels[place] for place in seen],
    )
    return control.sample_system(driven, period, method="foh", name="ramp_plant")
