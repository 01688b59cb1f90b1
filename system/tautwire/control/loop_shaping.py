"""H-infinity loop shaping of a sampled plant: the controller with the largest margin for a chosen loop shape.

Four-block mixed sensitivity, ``min || [S_o, S_o G; K S_o, K S_o G] ||``, G the plant with its weights: disturbances
also enter where the winches act, so lightly damped modes are damped, not cancelled. A bilinear map (Tustin)
transforms the sampled plant to a continuous one and the controller back; it preserves the norm.

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

# The optimal controller has poles at infinity; a slightly suboptimal one has not.
NORM_FACTOR = 1.1
SB10AD_GIVEN_NORM_JOB = 4
# Shift of the plant's integrators off the imaginary axis, in 1/s.
INTEGRATOR_LEAK = 1e-5


def synthesise_controller(plant: Any, weights: Any) -> Any:
    """Synthesises the H-infinity controller of a sampled ``plant``, to be closed with positive feedback.

    ``weights`` is a continuous ``control.StateSpace`` in the w-plane on the plant's outputs. The
    controller has the states of both.
    """
    period = plant.dt
    shaped = weights * to_continuous(plant)
    state_count, output_count, input_count = shaped.nstates, shaped.noutputs, shaped.ninputs
    A = shaped.A - INTEGRATOR_LEAK * np.eye(state_count)
    B = np.hstack([shaped.B, np.zeros((state_count, output_count)), shaped.B])
    C = np.vstack([shaped.C, np.zeros((input_count, state_count)), shaped.C])
    identity = np.eye(output_count)
    D = np.block(
        [
            [shaped.D, identity, shaped.D],
            [np.zeros((input_count, input_count + output_count)), np.eye(input_count)],
            [shaped.D, identity, shaped.D],
        ]
    )
    # Small matrices: thread synchronisation would dominate the time.
    with threadpool_limits(limits=1, user_api="blas"):
        _, _, norm, _ = control.hinfsyn(control.ss(A, B, C, D), output_count, input_count)
        synthesis = sb10ad(
            state_count,
            B.shape[1],
            C.shape[0],
            input_count,
            output_count,
            NORM_FACTOR * norm,
            A,
            B,
            C,
            D,
            job=SB10AD_GIVEN_NORM_JOB,
        )
    return to_sampled(control.ss(*synthesis[1:5]) * weights, period)


def to_continuous(system: Any) -> Any:
    """Bilinear transform to the w-plane, ``z = (1 + s h / 2) / (1 - s h / 2)``; no pole may be at -1."""
    h = system.dt
    identity = np.eye(system.nstates)
    inverse = np.linalg.inv(system.A + identity)
    return control.ss(
        2.0 / h * (system.A - identity) @ inverse,
        2.0 / np.sqrt(h) * inverse @ system.B,
        2.0 / np.sqrt(h) * system.C @ inverse,
        system.D - system.C @ inverse @ system.B,
    )


def to_sampled(system: Any, period: float) -> Any:
    """The inverse of :func:`to_continuous`."""
    identity = np.eye(system.nstates)
    inverse = np.linalg.inv(identity - 0.5 * period * system.A)
    return control.ss(
        inverse @ (identity + 0.5 * period * system.A),
        np.sqrt(period) * inverse @ system.B,
        np.sqrt(period) * system.C @ inverse,
        system.D + 0.5 * period * system.C @ inverse @ system.B,
        period,
    )
