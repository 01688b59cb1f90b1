"""The robot linearised about rest with exact derivatives of the laws: python-control's state space, and modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import control
import numpy as np
from numpy.typing import NDArray

from ..arguments import number_of, robot_of
from ..model.symbolic import Model, symbolic_model, with_drifts_held
from ..robots.checked_table import NumberRule
from ..robots.robot import Robot
from ..statics.equilibrium import static_tensions
from .kinks import SWING, Rest, kink_notes
from .modes import POSITION, Modes, modes_of
from .rest import position_of, rest_state

Array = NDArray[np.float64]

SWING_RULE = NumberRule("the swing of a mode", "m", minimum=0.0)


@dataclass(frozen=True)
class LinearPlant:
    """A robot linearised about rest; all signals are deviations from there, in SI units.

    ``system`` is a continuous ``control.StateSpace`` with named states (position, velocity, unstrained lengths,
    states of effects), inputs (winch speeds, external force) and outputs (position, velocity, tensions, lengths).
    States of effects that never settle (the age of creep, a drum's angle) are held as at the start and left out, and
    sensors show without their lag. ``position`` (3,) in m; ``tensions`` (n,) in N, and their ``tension_slopes`` (n,
    3) by position, in N/m; ``state`` is the operating point. ``notes`` say, a line each, what the linear plant leaves
    out: slack, and kinks of the laws so near that small motions meet them.
    """

    system: Any
    position: Array
    tensions: Array
    tension_slopes: Array
    state: Array
    modes: Modes
    notes: tuple[str, ...] = ()


def linearise(robot: Robot, at: Sequence[float] | Array | None = None, swing: float = SWING) -> LinearPlant:
    """Linearise about rest at a position, three coordinates in m, by default the start, with exact derivatives.

    ``dx/dt = A x + B u, y = C x + D u``: u are n winch speeds (m/s) and an external force (N), y is position (m),
    velocity (m/s), tensions (N) and lengths (m).

    Elsewhere it is the same robot, moved there by its winches: start lengths and start tensions stay, the
    unstrained lengths are those at which the laws give the static tensions, and states of effects have
    settled. A cable that is slack there stays so: its rows are zero. ``notes`` tell of that, and of every kink that a
    swing of ``swing`` (m) in one of the modes meets, see :func:`tautwire.linear.kinks.kink_notes`.

    Raises UnreachableError where the cables cannot hold the platform, OperatingPointError where they do not hold
    it stably, or where the states of an effect never settle, ArgumentError where an argument is none of these.
    """
    robot_of("linearise: robot", robot)
    number_of("linearise: swing", swing, SWING_RULE)
    position = position_of(robot, at)
    tensions = static_tensions(robot, position)
    model = with_drifts_held(symbolic_model(robot))
    state = rest_state(robot, model, position, tensions)
    A, B, C, D, by_state = _jacobians(model, state)
    slopes = by_state[:, POSITION]
    modes = modes_of(robot, position, tensions, slopes, A, B)
    system = control.ss(
        A,
        B,
        C,
        D,
        states=signals(model.state_names),
        inputs=signals(model.input_names),
        outputs=signals(model.output_names),
        name="plant",
    )
    rest = Rest(robot, model, state, tensions, slopes)
    return LinearPlant(system, position, tensions, slopes, state, modes, kink_notes(rest, (A, B, C, D), modes, swing))


def signals(names: Sequence[str]) -> list[str]:
    """Names as python-control takes them: it keeps the dot for ``system.signal`` and refuses it in a name."""
    return [name.replace(".", "_") for name in names]


def _jacobians(model: Model, state: Array) -> tuple[Array, Array, Array, Array, Array]:
    """A, B, C, D, and the slopes of the tensions of the free ropes by the states."""
    pairs = [(f, x) for f in (model.rates, model.outputs) for x in (model.states, model.inputs)]
    pairs.append((model.span_tensions, model.states))
    derivatives = casadi.Function(
        "derivatives", [model.states, model.inputs], [casadi.jacobian(f, x) for f, x in pairs]
    )
    values = derivatives(state, np.zeros(model.inputs.numel()))
    a, b, c, d, slopes = (np.asarray(value, dtype=float) for value in values)
    return a, b, c, d, slopes
