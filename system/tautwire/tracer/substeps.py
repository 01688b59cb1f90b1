"""How often the filter steps between two samples, from the modes of the model."""

from __future__ import annotations

from math import ceil, factorial

import casadi
import numpy as np
from numpy.typing import NDArray

from ..model.symbolic import symbolic_model
from ..robots.robot import Robot
from .filter_step import Substeps

Modes = NDArray[np.complex128]

# Radians of the fastest vibration in one step of the state, and of its derivatives.
STATE_ANGLE, SLOPE_ANGLE = 0.05, 0.7
# Time constants of the fastest decay likewise: what has died away has nothing left to err by.
STATE_DECAY, SLOPE_DECAY = 0.5, 2.0
# Up to so many steps of the state, a decay gets as short ones as a vibration.
FEW_STEPS = 40
# What the series of the derivatives may leave out of a vibration, and of a decay.
LEFT_OUT, LEFT_OUT_OF_DECAY, LEAST_ORDER = 2e-5, 1e-3, 2
# Where effects remember, which may be quicker under way than at rest, and in a fit than where it begins. With many
# states each doubling costs more than all the rest.
DOUBLINGS, MANY_STATES, DOUBLINGS_OF_MANY = 4, 24, 2


def substeps_between(robot: Robot, sample_time: float, states: int, remembers: bool) -> Substeps:
    """For samples ``sample_time`` (s) apart and a filter of so many ``states``; ``remembers`` tells of effects' own."""
    doublings = DOUBLINGS_OF_MANY if states > MANY_STATES else DOUBLINGS
    return substeps_for(modes(robot) * sample_time, doublings if remembers else 0)


def substeps_for(turns: Modes, doublings: int = 0) -> Substeps:
    """Between samples over which the modes go on by ``exp(turns)``."""
    vibration, decay = float(np.max(np.abs(turns.imag))), float(np.max(np.abs(turns)))
    fine = min(ceil(decay / STATE_ANGLE), FEW_STEPS)
    state = max(1, ceil(vibration / STATE_ANGLE), ceil(decay / STATE_DECAY), fine)
    slope = max(1, ceil(vibration / SLOPE_ANGLE), ceil(decay / SLOPE_DECAY))
    parts, order = slope * 2**doublings, LEAST_ORDER
    while any(
        2**doublings * (turn / parts) ** (order + 1) / factorial(order + 1) > left
        for turn, left in ((vibration, LEFT_OUT), (decay, LEFT_OUT_OF_DECAY))
    ):
        order += 1
    return Substeps(state, slope, order, doublings)


def modes(robot: Robot) -> Modes:
    """Eigenvalues at the start, in rad/s."""
    model = symbolic_model(robot)
    slope = casadi.Function("a", [model.states, model.inputs], [casadi.jacobian(model.rates, model.states)])
    start = casadi.Function("start", [], [model.start])
    matrix = np.array(slope(start()["o0"], 0.0))
    return np.linalg.eigvals(matrix).astype(complex)
