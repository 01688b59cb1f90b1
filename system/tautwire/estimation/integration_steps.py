"""Integration steps that the filter takes between two samples, from the eigenvalues of the robot at its start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, factorial, pi

import casadi
import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..robot.schema import Robot
from ..robot.symbolic_model import symbolic_model

Eigenvalues = NDArray[np.complex128]


@dataclass(frozen=True)
class Substeps:
    """Integration steps between two samples: of the state itself, and of its derivatives.

    The latter use a series of some order over a part so small that ``doublings`` make it a whole step.
    """

    state: int
    slope: int
    order: int = 4
    doublings: int = 0


# Radians of the fastest vibration in one step of the state, and of its derivatives. An angle a errs by a^4/120 of the
# frequency, of which a disturbance hides far more.
MAX_STATE_ANGLE, MAX_SLOPE_ANGLE = 0.05, 0.7
MAX_STATE_ANGLE_BESIDE_DISTURBANCE = 0.1
# Time constants of the fastest decay likewise: what has died away causes no more error.
MAX_STATE_DECAY, MAX_SLOPE_DECAY = 0.5, 2.0
# Up to so many steps of the state, a decay is resolved as finely as a vibration.
MAX_FINE_STEPS = 40
# Steps of the state beyond which a sample is too far from the one before: the filter would fill gigabytes. Some five
# periods of the fastest vibration.
MAX_STATE_STEPS = 600
# Truncation error allowed to the series of the derivatives, for a vibration and for a decay.
VIBRATION_TRUNCATION_ERROR, DECAY_TRUNCATION_ERROR, MIN_SERIES_ORDER = 2e-5, 1e-3, 2
# How much faster than without its effects a robot may vibrate for the steps to follow it: nine times as stiff. A rope's
# friction of 20 N within 1e-4 of strain would ask ten times the steps of a desktop robot.
MAX_EFFECT_SPEED_UP = 3.0
# For effects with states, which may be quicker under way than at rest, and in a fit than at its start. With many
# states each doubling costs more than everything else.
DOUBLINGS, MANY_STATES_COUNT, DOUBLINGS_OF_MANY_STATES = 4, 24, 2


def substeps_of_robot(
    robot: Robot, sample_time: float, state_count: int, has_effect_states: bool, max_angle: float = MAX_STATE_ANGLE
) -> Substeps:
    """Integration steps for samples ``sample_time`` (s) apart; ``has_effect_states`` if effects add states.

    One step of the state turns the fastest vibration by ``max_angle`` (rad) at most.
    """
    doublings = DOUBLINGS_OF_MANY_STATES if state_count > MANY_STATES_COUNT else DOUBLINGS
    own, exponents = (eigenvalues_at_start(each) * sample_time for each in (replace(robot, effects=()), robot))
    limit = MAX_EFFECT_SPEED_UP * float(np.max(np.abs(own)))
    followed = exponents.real + 1j * np.clip(exponents.imag, -limit, limit)
    return substeps_of_eigenvalues(followed, doublings if has_effect_states else 0, max_angle)


def require_followable(robot: Robot, path: str, sample_time: float) -> None:
    """Raises RecordingError where the samples of a recording are too far apart for the filter to follow the robot."""
    if substeps_of_robot(robot, sample_time, 0, False).state > MAX_STATE_STEPS:
        frequency = float(np.max(np.abs(eigenvalues_at_start(robot)))) / (2.0 * pi)
        problem = f"samples are {sample_time:.4g} s apart, and the robot moves at up to {frequency:.3g} Hz"
        raise RecordingError(path, problem, "is the time in ms? It has to be in s; else record faster")


def substeps_of_eigenvalues(exponents: Eigenvalues, doublings: int = 0, max_angle: float = MAX_STATE_ANGLE) -> Substeps:
    """Integration steps between samples over which the modes change by ``exp(exponents)``."""
    vibration, decay = float(np.max(np.abs(exponents.imag))), float(np.max(np.abs(exponents)))
    fine_steps = min(ceil(decay / max_angle), MAX_FINE_STEPS)
    state = max(1, ceil(vibration / max_angle), ceil(decay / MAX_STATE_DECAY), fine_steps)
    slope = max(1, ceil(vibration / MAX_SLOPE_ANGLE), ceil(decay / MAX_SLOPE_DECAY))
    parts, order = slope * 2**doublings, MIN_SERIES_ORDER
    while any(
        2**doublings * (turn / parts) ** (order + 1) / factorial(order + 1) > left
        for turn, left in ((vibration, VIBRATION_TRUNCATION_ERROR), (decay, DECAY_TRUNCATION_ERROR))
    ):
        order += 1
    return Substeps(state, slope, order, doublings)


def eigenvalues_at_start(robot: Robot) -> Eigenvalues:
    """Eigenvalues of the model linearised at the start, in rad/s."""
    model = symbolic_model(robot)
    jacobian = casadi.Function("a", [model.states, model.inputs], [casadi.jacobian(model.rates, model.states)])
    start_state = casadi.Function("start", [], [model.start])
    matrix = np.array(jacobian(start_state()["o0"], 0.0))
    return np.linalg.eigvals(matrix).astype(complex)
