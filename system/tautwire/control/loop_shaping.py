"""H-infinity loop shaping of a sampled plant: the controller that keeps the largest margin at a chosen loop shape.

Four-block mixed sensitivity, ``min || [S_o, S_o G; K S_o, K S_o G] ||``, G the plant with its weights: disturbances
also enter where the winches act, so lightly damped modes are damped, not cancelled. A bilinear map carries the
sampled plant to a continuous one and the controller back; it leaves the norm as it is.

Sources: McFarlane and Glover (1992), IEEE Transactions on Automatic Control 37(6), 759-769; Glover and Doyle (1988),
Systems and Control Letters 11, 167-172, for the controller, by SLICOT's SB10AD.
"""

from __future__ import annotations

from typing import Any

import control
import numpy as np
from numpy.typing import NDArray
from slycot import sb10ad
from threadpoolctl import threadpool_limits

Array = NDArray[np.float64]

# The controller with the very smallest norm has poles at infinity; one a little larger has not.
SLACK = 1.1
GIVEN_NORM = 4
# Integrators of the plant, moved off the axis by this in 1/s.
LEAK = 1e-5


def shaped_controller(plant: Any, weights: Any) -> Any:
    """The robust controller of a sampled ``plant``, to be closed with positive feedback; states of both and no more.

    ``weights`` is a continuous ``control.StateSpace`` of the w-plane on the plant's outputs.
    """
    period = plant.dt
    shaped = weights * to_continuous(plant)
    states, seen, driven = shaped.nstates, shaped.noutputs, shaped.ninputs
    A = shaped.A - LEAK * np.eye(states)
    B = np.hstack([shaped.B, np.zeros((states, seen)), shaped.B])
    C = np.vstack([shaped.C, np.zeros((driven, states)), shaped.C])
    each = np.eye(seen)
    D = np.block(
        [
            [shaped.D, each, shaped.D],
            [np.zeros((driven, driven + seen)), np.eye(driven)],
            [shaped.D, each, shaped.D],
        ]
    )
    # Small matrices: threads that wait for each other would cost most of the time.
    with threadpool_limits(limits=1, user_api="blas"):
        _, _, norm, _ = control.hinfsyn(control.ss(A, B, C, D), seen, driven)
        found = sb10ad(states, B.shape[1], C.shape[0], driven, seen, SLACK * norm, A, B, C, D, job=GIVEN_NORM)
    return to_sampled(control.ss(*found[1:5]) * weights, period)


def to_continuous(system: Any) -> Any:
    """The w-plane system of a sampled one, ``z = (1 + s h / 2) / (1 - s h / 2)``; no pole may be at -1."""
    h = system.dt
    each = np.eye(system.nstates)
    inverse = np.linalg.inv(system.A + each)
    return control.ss(
        2.0 / h * (system.A - each) @ inverse,
        2.0 / np.sqrt(h) * inverse @ system.B,
        2.0 / np.sqrt(h) * system.C @ inverse,
        system.D - system.C @ inverse @ system.B,
    )


def to_sampled(system: Any, period: float) -> Any:
    """The inverse of :func:`to_continuous`."""
    each = np.eye(system.nstates)
    inverse = np.linalg.inv(each - 0.5 * period * system.A)
    return control.ss(
        inverse @ (each + 0.5 * period * system.A),
        np.sqrt(period) * inverse @ system.B,
        np.sqrt(period) * system.C @ inverse,
        system.D + 0.5 * period * system.C @ inverse @ system.B,
        period,
    )
