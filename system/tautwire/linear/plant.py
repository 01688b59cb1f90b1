"""The robot linearised about an operating point with exact derivatives: a python-control state space, and modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import control
import numpy as np
from numpy.typing import NDArray

from ..arguments import validate_number, validate_robot
from ..model.symbolic import SymbolicModel, freeze_drifting_states, symbolic_model
from ..robots.checked_table import NumberRule
from ..robots.robot import Robot
from ..statics.equilibrium import static_tensions
from .kinks import DEFAULT_SWING, OperatingPoint, validity_notes
from .modes import POSITION, Modes, modes_of
from .rest import equilibrium_state, requested_position

Array = NDArray[np.float64]

SWING_RULE = NumberRule("the swing of a mode", "m", minimum=0.0)


@dataclass(frozen=True)
class LinearPlant:
    """A robot linearised about an operating point at rest; all signals are deviations from there, in SI units.

    ``system`` is a continuous ``control.StateSpace`` with named states (position, velocity, unstrained lengths,
    states of effects), inputs (winch speeds, external force) and outputs (position, velocity, tensions, lengths).
    States of effects without equilibrium (the age of creep, a drum's angle) are frozen at the start and removed, and
    sensors have no delay. ``position`` (3,) in m; ``tensions`` (n,) in N, and their ``tension_slopes`` (n, 3) by
    position, in N/m; ``state`` is the operating point. ``notes`` state, one line each, what the linear plant leaves
    out: slack, and nonsmooth laws so near that small motions meet them.
    """

    system: Any
    position: Array
    tensions: Array
    tension_slopes: Array
    state: Array
    modes: Modes
    notes: tuple[str, ...] = ()


def linearise(robot: Robot, at: Sequence[float] | Array | None = None, swing: float = DEFAULT_SWING) -> LinearPlant:
    """Linearises the robot at rest at a position, three coordinates in m, by default the start, with exact derivatives.

    ``dx/dt = A x + B u, y = C x + D u``: u are n winch speeds (m/s) and an external force (N), y is position (m),
    velocity (m/s), tensions (N) and lengths (m).

    Elsewhere it is the same robot, moved there by its winches: start lengths and start tensions stay, the
    unstrained lengths are those at which the laws give the static tensions, and states of effects have
    settled. A cable that is slack there stays slack: its rows are zero. ``notes`` report that, and all nonsmooth
    behaviour within a swing of ``swing`` (m) in a mode, see :func:`tautwire.linear.nonsmooth.validity_notes`.

    Raises UnreachableError where the cables cannot hold the platform, OperatingPointError where they do not hold
    it stably, or where the states of an effect never settle, ArgumentError for an invalid argument.
    """
    validate_robot("linearise: robot", robot)
    validate_number("linearise: swing", swing, SWING_RULE)
    position = requested_position(robot, at)
    tensions = static_tensions(robot, position)
    model = freeze_drifting_states(symbolic_model(robot))
    state = equilibrium_state(robot, model, position, tensions)
    A, B, C, D, tension_jacobian = _jacobians(model, state)
    tension_slopes = tension_jacobian[:, POSITION]
    modes = modes_of(robot, position, tensions, tension_slopes, A, B)
    system = control.ss(
        A,
        B,
        C,
        D,
        states=signal_names(model.state_names),
        inputs=signal_names(model.input_names),
        outputs=signal_names(model.output_names),
        name="plant",
    )
    operating_point = OperatingPoint(robot, model, state, tensions, tension_slopes)
    return LinearPlant(
        system,
        position,
        tensions,
        tension_slopes,
        state,
        modes,
        validity_notes(operating_point, (A, B, C, D), modes, swing),
    )


def signal_names(names: Sequence[str]) -> list[str]:
    """Signal names for python-control, which reserves the dot for ``system.signal``."""
    return [name.replace(".", "_") for name in names]


def _jacobians(model: SymbolicModel, state: Array) -> tuple[Array, Array, Array, Array, Array]:
    """A, B, C, D, and the Jacobian of the span tensions by the states."""
    pairs = [(f, x) for f in (model.rates, model.outputs) for x in (model.states, model.inputs)]
    pairs.append((model.span_tensions, model.states))
    derivatives = casadi.Function(
        "derivatives", [model.states, model.inputs], [casadi.jacobian(f, x) for f, x in pairs]
    )
    values = derivatives(state, np.zeros(model.inputs.numel()))
    a, b, c, d, tension_jacobian = (np.asarray(value, dtype=float) for value in values)
    return a, b, c, d, tension_jacobian
