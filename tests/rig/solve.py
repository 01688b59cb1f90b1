"""Integration of the rig's equations at high accuracy, and its true outputs at given instants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from tests.rig.mechanics import Rig, Settings
from tests.rig.program import Program
from tests.rig.robot import Robot, Vector

Method = Literal["RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"]


@dataclass(frozen=True)
class Run:
    """True quantities, one row per instant; tension is the span's, cell what the load cell feels.

    Of a platform that turns also its rotation matrices and angular velocity (rad/s).
    """

    time: Vector
    position: Vector
    velocity: Vector
    tension: Vector
    pull: Vector
    cell: Vector
    length: Vector
    strain: Vector
    direction: Vector
    state: Vector
    rig: Rig
    rotation: Vector | None = None
    turning: Vector | None = None


def simulate(
    robot: Robot,
    effects: Settings | None,
    program: Program,
    times: Sequence[float] | Vector,
    velocity: Sequence[float] | Vector | None = None,
    method: Method = "DOP853",
    rtol: float = 1e-10,
    atol: float = 1e-12,
    turning: Sequence[float] | Vector | None = None,
) -> Run:
    """Run from the start at t = 0; `velocity` is an initial one, m/s, `turning` an angular one, rad/s; else at rest."""
    rig = Rig(robot, effects, program)
    instants = np.asarray(times, float)
    start = rig.begin(*(None if each is None else np.asarray(each, float) for each in (velocity, turning)))
    states = integrate(rig, start, instants, method, rtol, atol)
    moments = [rig.evaluate(float(time), state) for time, state in zip(instants, states, strict=True)]

    def stack(name: str) -> Vector:
        return np.array([getattr(moment, name) for moment in moments])

    fields = ("position", "velocity", "tension", "pull", "cell", "length", "strain", "direction", "state")
    turned = ("rotation", "turning") if rig.turning else ()
    return Run(time=instants, rig=rig, **{name: stack(name) for name in (*fields, *turned)})


def integrate(
    rig: Rig, state: Vector, times: Vector, method: Method = "DOP853", rtol: float = 1e-10, atol: float = 1e-12
) -> Vector:
    """States at rising instants >= 0, restarting wherever the winch program has a kink."""
    last = float(times[-1])
    bounds = [0.0, *sorted({kink for kink in rig.program.kinks if 0.0 < kink < last}), last]
    result = np.empty((len(times), rig.size))
    result[times <= 0.0] = state
    first_step = None
    for left, right in pairwise(bounds):
        if right <= left:
            continue
        wanted = np.flatnonzero((times > left) & (times <= right))
        instants = times[wanted]
        ends = len(instants) > 0 and instants[-1] == right
        solution = solve_ivp(
            rig.rates,
            (left, right),
            state,
            method=method,
            t_eval=instants if ends else np.append(instants, right),
            rtol=rtol,
            atol=atol,
            first_step=None if first_step is None else min(first_step, right - left),
        )
        if not solution.success:
            raise RuntimeError(f"integration stopped at {solution.t[-1]} s: {solution.message}")
        state = solution.y[:, -1]
        result[wanted] = solution.y.T[: len(wanted)]
        first_step = right - left if len(bounds) > 100 else None
    return result
