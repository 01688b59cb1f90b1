"""Where a run began, by all that was measured of it: what a co-simulation starts from.

The filter's first state, smoothed by all samples: with whitened innovations ``e_k`` and their slopes ``J_k`` by it

    x_0|N = x_0 - P_0 sum_k J_k' e_k

Source: Anderson and Moore (1979), Optimal Filtering, sec. 7.2.
"""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
from numpy.typing import NDArray

from ...model.symbolic import Model
from ...robots.robot import Release, Robot
from ...runs.start import placed
from ...statics.equilibrium import static_tensions
from ..data import Sample
from ..filter_step import Noise
from ..fit import Fitter
from ..likelihood import Likelihood
from ..linearisation import linearise_run

Array = NDArray[np.float64]


def is_open(noise: Noise) -> bool:
    """Whether more than the sensors' noise is unknown of the start."""
    return max(noise.start_velocity, noise.start_stretch, noise.self_stress) > 0.0


def released(fitter: Fitter, robot: Robot, sample: Sample) -> Robot:
    """The robot as its run on a recording began; at rest where the recording's start is."""
    here = placed(robot, sample.start)
    if not is_open(fitter.noise):
        return here
    likelihood, values = fitter.likelihood(robot, (), sample)
    state = _smoothed_start(likelihood, values, sample)
    x, y, z, vx, vy, vz = state[:6].tolist()
    there = placed(here, (x, y, z))
    moving = (vx, vy, vz) if fitter.noise.start_velocity > 0.0 else (0.0, 0.0, 0.0)
    beside = _tensions_at_rest(likelihood.model, state, robot.cable_count) - static_tensions(there)
    return replace(there, release=Release(moving, tuple(beside.tolist())))


def release_note(released_robot: Robot, path: str) -> tuple[str, ...]:
    """How the run of a recording began, where not as the robot file has it."""
    release = released_robot.release
    if release is None:
        return ()
    tensions = ", ".join(f"{tension:.4g}" for tension in static_tensions(released_robot) + np.array(release.tensions))
    speed = float(np.linalg.norm(release.velocity))
    moving = f", at {speed:.3g} m/s" if speed > 0.0 else ""
    return (f"{path}: the run starts with tensions of {tensions} N{moving}, as what was measured says",)


def _smoothed_start(likelihood: Likelihood, values: list[float], sample: Sample) -> Array:
    """The state (n,) at the start, by all samples of the recording."""
    state, covariance = likelihood.start(values)
    slopes = np.eye(len(state))
    pull = np.zeros(len(state))
    for run in linearise_run(likelihood, values, sample.recording):
        count = len(run.own)
        still = np.zeros((count, len(state), len(state)))
        slopes, moved = run.carry(slopes, still, np.zeros((count, run.seen.shape[1], len(state))))
        pull += np.einsum("kmp,km->p", moved, run.values)
    smoothed: Array = state - covariance @ pull
    return smoothed


def _tensions_at_rest(model: Model, state: Array, cable_count: int) -> Array:
    """Tensions of the ropes (n,) in N with the platform held at a state's place, winches too."""
    held = state.copy()
    held[3:6] = 0.0
    tensions = casadi.Function("tensions", [model.states, model.inputs], [model.span_tensions])
    found: Array = np.array(tensions(held, np.zeros(cable_count + 3))).ravel()
    return found
