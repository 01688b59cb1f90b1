"""How often to step between two samples, from the modes of the model at rest and under way."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, factorial

import casadi
import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import BY_NAME

from ..model.symbolic import Model
from ..recordings.recording import Recording
from ..robots.robot import Robot
from .filter_step import Substeps

Array = NDArray[np.float64]
Modes = NDArray[np.complex128]

# Radians of the fastest vibration in one integration step, and time constants of the fastest decay, which soon has
# nothing left to err by; and what the series of the derivatives may leave out of each.
STATE_ANGLE, SLOPE_ANGLE, LEFT_OUT = 0.05, 0.7, 2e-5
STATE_DECAY, SLOPE_DECAY, LEFT_OUT_OF_DECAY = 0.5, 2.0, 1e-3
LEAST_ORDER = 4
# Where a rope is under way its effects have this much of memory, and strain grows as fast as in nearly all samples.
UNDER_WAY, NEARLY_ALL = 0.5, 0.999
# Time constants in a sample: what is quicker under way is over at once, and no step would be short enough.
MOST_UNDER_WAY = 20.0


class Pace:
    """How fast the modes of a model are at some values of its parameters.

    An effect may be quick only while a rope strains: friction between strands forgets in the strain in which it yields.
    ``effects`` are the places of the effects' states; samples are ``sample_time`` (s) apart.
    """

    def __init__(self, model: Model, cable_count: int, effects: slice, sample_time: float) -> None:
        self._cable_count = cable_count
        self._effects = effects
        self._sample_time = sample_time
        self._start = casadi.Function("start", [model.parameters], [model.start])
        self._slopes = casadi.Function(
            "slopes",
            [model.states, model.inputs, model.parameters],
            [casadi.densify(casadi.jacobian(model.rates, model.states))],
        )

    def turns(self, parameters: Sequence[float] | Array, strain_rates: Array) -> Modes:
        """What modes go on by between samples, at the start at rest and with ropes straining so fast (n,) in 1/s."""
        theta = np.asarray(parameters, dtype=float)
        start = np.array(self._start(theta)).ravel()
        found = [self._at(start, np.zeros(self._cable_count), theta)]
        moving = start.copy()
        moving[self._effects] = UNDER_WAY
        if len(moving[self._effects]) and strain_rates.any():
            lengths = start[6 : 6 + self._cable_count]
            under_way = self._at(moving, lengths * strain_rates, theta)
            found.append(under_way * (MOST_UNDER_WAY / np.maximum(np.abs(under_way), MOST_UNDER_WAY)))
        return np.concatenate(found)

    def _at(self, state: Array, speeds: Array, parameters: Array) -> Modes:
        slopes = np.array(self._slopes(state, np.append(speeds, np.zeros(3)), parameters))
        if not np.all(np.isfinite(slopes)):
            return np.zeros(1, dtype=complex)
        turns: Modes = np.linalg.eigvals(self._sample_time * slopes).astype(complex)
        return turns


def remembers(robot: Robot) -> bool:
    """Whether some effect has states of its own, which may be quicker than the robot."""
    return any(BY_NAME[setting.name].states for setting in robot.effects)


def strain_rates(robot: Robot, recording: Recording) -> Array:
    """How fast the ropes of a recording strain, shape (n,) in 1/s, by their tensions; zero where none was measured.

    A rope whose tension was not measured strains as fast as the fastest other one. Of a robot whose effects remember
    nothing it is zero: nothing there is quicker under way.
    """
    if not remembers(robot):
        return np.zeros(robot.cable_count)
    moduli = np.array([cable.modulus * cable.area for cable in robot.cables])
    rates = np.abs(np.diff(recording.tension, axis=0)) / np.diff(recording.time)[:, None] / moduli
    known = np.isfinite(rates).any(axis=0)
    found = np.zeros(robot.cable_count)
    found[known] = np.nanquantile(rates[:, known], NEARLY_ALL, axis=0)
    found[~known] = found.max(initial=0.0)
    return found


def substeps_for(turns: Modes) -> Substeps:
    """How often to step between samples over which the modes go on by ``exp(turns)``."""
    vibration, decay = float(np.max(np.abs(turns.imag))), float(np.max(np.abs(turns)))
    state = max(1, ceil(vibration / STATE_ANGLE), ceil(decay / STATE_DECAY))
    slope = max(1, ceil(vibration / SLOPE_ANGLE), ceil(decay / SLOPE_DECAY))
    order = LEAST_ORDER
    while any(
        turn ** (order + 1) / factorial(order + 1) > left
        for turn, left in ((vibration / slope, LEFT_OUT), (decay / slope, LEFT_OUT_OF_DECAY))
    ):
        order += 1
    return Substeps(state, slope, order)


def covers(substeps: Substeps, turns: Modes) -> bool:
    """Whether these steps are short enough for other modes too."""
    needed = substeps_for(turns)
    finer = needed.slope < substeps.slope or (needed.slope == substeps.slope and needed.order <= substeps.order)
    return finer and needed.state <= substeps.state
