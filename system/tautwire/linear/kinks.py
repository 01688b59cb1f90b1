"""What a linear plant leaves out near rest: slack cables, effects with a kink or a bend there, lags of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ..model.symbolic import Model
from ..robots.robot import Robot
from .modes import POSITION, Modes
from .rest import slack_cables

Array = NDArray[np.float64]

SWING = 5e-3
BENT = 0.05
# Swings of a tension that are less than this share of the largest say nothing; nor does a share of the tension.
QUIET, UNFELT = 0.01, 1e-4
SAMPLES = 64


@dataclass(frozen=True)
class Rest:
    """A robot's equations at rest: ``state``, ``tensions`` (n,) of the ropes in N, their ``slopes`` (n, 3) in N/m."""

    robot: Robot
    model: Model
    state: Array
    tensions: Array
    slopes: Array


def kink_notes(rest: Rest, matrices: Sequence[Array], modes: Modes, swing: float = SWING) -> tuple[str, ...]:
    """What a user of the linear plant must know, a line each; none where it holds for a swing of ``swing`` (m).

    Slack: a cable carries nothing at rest, or goes slack within the swing in some mode. Effects: in a period of free
    swing by the laws, or with one winch at the speed of the slowest swing, tensions or ropes differ from the linear
    ones by more than 5 % of their change; a kink, as in friction, does that however small the swing. Sensors: what they
    show late.
    """
    slack = slack_cables(rest.tensions)
    notes = [f"cable {cable + 1} hangs slack: it carries nothing, and holds only while it stays so" for cable in slack]
    reach = _slack_swings(rest.tensions, rest.slopes @ modes.shapes)
    notes += [
        f"cable {cable + 1} goes slack at a swing of {reach[cable]:.2g} m"
        for cable in np.setdiff1d(np.flatnonzero(reach <= swing), slack)
    ]
    if rest.robot.effects and swing > 0.0:
        size = min(swing, 0.5 * float(np.min(reach)))
        notes += _swing_notes(rest, matrices, modes, size)
        notes += _winch_notes(rest, matrices, 2.0 * np.pi * float(modes.frequencies[0]) * size)
    return (*notes, *_lag_notes(rest.model, rest.robot.cable_count))


def _slack_swings(tensions: Array, slopes: Array) -> Array:
    """The swing in m, in the mode in which it is least, at which each cable goes slack; slopes (n, 3) in N/m."""
    steepest = np.max(np.abs(slopes), axis=1)
    return np.divide(tensions, steepest, out=np.full(len(tensions), np.inf), where=(steepest > 0.0) & (tensions > 0.0))


def _named(robot: Robot) -> str:
    names = dict.fromkeys(setting.name for setting in robot.effects)
    return f"an effect ({', '.join(names)}) has a kink or bends near rest"


def _swing_notes(rest: Rest, matrices: Sequence[Array], modes: Modes, size: float) -> list[str]:
    notes = []
    for mode, frequency in enumerate(modes.frequencies):
        offset = np.zeros(len(rest.state))
        offset[POSITION] = size * modes.shapes[:, mode]
        bends = _bends(rest, matrices, offset, np.linspace(0.0, 1.0 / frequency, SAMPLES))
        cable = int(np.argmax(bends))
        if not bends[cable] <= BENT:
            notes.append(
                f"mode {mode + 1}: in a swing of {size:.2g} m the tension of cable {cable + 1} is off the linear plant "
                f"by {bends[cable]:.0%} of its swing; {_named(rest.robot)}"
            )
    return notes


def _bends(rest: Rest, matrices: Sequence[Array], offset: Array, times: Array) -> Array:
    """By how much the tensions of a free swing differ from the linear ones, as shares of those, shape (n,)."""
    A, _, C, _ = matrices
    model, shown = rest.model, slice(6, 6 + rest.robot.cable_count)
    still = np.zeros(model.inputs.numel())
    laws = casadi.Function("laws", [model.states, model.inputs], [model.rates, model.outputs])
    step = expm(A * (times[1] - times[0]))
    linear = [offset]
    for _ in times[1:]:
        linear.append(step @ linear[-1])
    expected = np.array(linear) @ C[shown].T
    run = solve_ivp(
        lambda _, x: np.asarray(laws(x, still)[0]).ravel(),
        (times[0], times[-1]),
        rest.state + offset,
        method="LSODA",
        t_eval=times,
        rtol=1e-8,
        atol=1e-12,
    )
    if not run.success:
        return np.full(rest.robot.cable_count, np.inf)
    at_rest, *found = [np.asarray(laws(x, still)[1]).ravel()[shown] for x in (rest.state, *run.y.T)]
    swings = np.max(np.abs(expected), axis=0)
    bends: Array = np.max(np.abs(found - at_rest - expected), axis=0) / np.maximum(swings, QUIET * np.max(swings))
    return bends


def _winch_notes(rest: Rest, matrices: Sequence[Array], speed: float) -> list[str]:
    """Of winches that turn with ``speed`` (m/s) to either side: tensions at once, and how fast the rope grows."""
    _, B, _, D = matrices
    model, count = rest.model, rest.robot.cable_count
    told = casadi.Function(
        "told", [model.states, model.inputs], [model.outputs[6 : 6 + count], model.rates[6 : 6 + count]]
    )
    tension, rate = (np.asarray(value).ravel() for value in told(rest.state, np.zeros(model.inputs.numel())))
    bends: dict[int, float] = {}
    for winch in range(count):
        worst = 0.0
        for turn in (speed, -speed):
            inputs = np.zeros(model.inputs.numel())
            inputs[winch] = turn
            now, moved = (np.asarray(value).ravel() for value in told(rest.state, inputs))
            floor = UNFELT * np.max(rest.tensions)
            worst = max(
                worst,
                _share(now[winch] - tension[winch], D[6 + winch, winch] * turn, floor),
                _share(moved[winch] - rate[winch], B[6 + winch, winch] * turn, UNFELT * speed),
            )
        if not worst <= BENT:
            bends[winch + 1] = worst
    if not bends:
        return []
    return [
        f"winches {', '.join(map(str, bends))}: at {speed:.2g} m/s tension or rope of their cables is off the linear "
        f"plant by up to {max(bends.values()):.0%} of the change; {_named(rest.robot)}"
    ]


def _share(change: float, linear: float, floor: float) -> float:
    return abs(change - linear) / max(abs(change), abs(linear), floor)


def _lag_notes(model: Model, count: int) -> list[str]:
    """Of sensors that show late."""
    lags = np.asarray(casadi.evalf(model.lags), dtype=float).ravel()
    late = [("positions", float(lags[0])), *((f"tension {i + 1}", float(lags[3 + i])) for i in range(count))]
    return [f"{what}: sensors show {lag:g} s late, the plant at once" for what, lag in late if lag > 0.0]
