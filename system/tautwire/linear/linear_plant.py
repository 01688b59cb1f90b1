"""The robot linearised about an operating point: state space, minimal channels and model file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi
import control
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance

from ..errors import InputError
from ..memoisation import memoised
from ..robot.kinematics import validated_pose
from ..robot.rigid_equilibrium import static_equilibrium
from ..robot.schema import Quaternion, Robot, validate_robot
from ..robot.static_equilibrium import static_tensions
from ..robot.symbolic_model import SymbolicModel, freeze_drifting_states, symbolic_model
from ..validation import NumberRule, validate_number
from .modes import Modes, modes_of
from .nonsmooth import DEFAULT_SWING, OperatingPoint, validity_notes
from .operating_point import ACCELERATION_TOLERANCE, SURVEY_TOLERANCE, Pose, equilibrium_state, requested_position

Array = NDArray[np.float64]

SWING_RULE = NumberRule("the amplitude of a mode", "m", minimum=0.0)

# Relative to scaled matrices; values from 1e-11 to 1e-6 give the same orders on the shipped robots.
MINREAL_TOLERANCE = 1e-9


@dataclass(frozen=True)
class LinearPlant:
    """A robot linearised about an operating point at rest; all signals are deviations from there, in SI units.

    ``system`` is a continuous ``control.StateSpace`` with named states (position, velocity, unstrained lengths,
    states of effects), inputs (winch speeds, external force) and outputs (position, velocity, tensions, lengths). A
    rigid body has a rotation behind its position, in rad about the world's axes, an angular velocity behind its
    velocity and a moment behind the force.
    States of effects without equilibrium (the age of creep, a drum's angle) are frozen at the start and removed, and
    sensors have no delay. ``position`` (3,) in m, and ``orientation``, a unit quaternion; ``tensions`` (n,) in N, and
    their ``tension_slopes`` by the pose (n, d), in N/m and N/rad; ``state`` is the operating point. ``notes`` state,
    one line each, what the linear plant leaves out: slack, and nonsmooth laws so near that small motions meet them.
    """

    system: Any
    position: Array
    tensions: Array
    tension_slopes: Array
    state: Array
    modes: Modes
    notes: tuple[str, ...] = ()
    orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)

    @property
    def degrees_of_freedom(self) -> int:
        """Those of the platform, d: 6 of a rigid body, 3 of a point mass."""
        return len(self.modes.shapes)


def linearise(
    robot: Robot,
    at: Sequence[float] | Array | None = None,
    swing: float = DEFAULT_SWING,
    orientation: Sequence[float] | Array | None = None,
) -> LinearPlant:
    """Linearises the robot at rest at a position, three coordinates in m, by default the start, with exact derivatives.

    The ``orientation`` of a rigid platform is a unit quaternion, by default that of the robot file; with fewer than six
    cables it is the nearest one in equilibrium.

    ``dx/dt = A x + B u, y = C x + D u``: u are n winch speeds (m/s) and an external force (N), y is position (m),
    velocity (m/s), tensions (N) and lengths (m).

    Elsewhere it is the same robot, moved there by its winches: start lengths and start tensions stay, the
    unstrained lengths are those at which the laws give the static tensions, and states of effects have
    settled. A cable that is slack there stays slack: its rows are zero. ``notes`` report that, and all nonsmooth
    behaviour within a swing of ``swing`` (m) in a mode, see :func:`tautwire.linear.nonsmooth.validity_notes`.

    Raises UnreachableError where the cables cannot hold the platform, OperatingPointError where they do not hold
    it stably, or where the states of an effect never settle, InputError where a point mass is to turn, ArgumentError
    for an invalid argument.
    """
    validate_robot("linearise: robot", robot)
    validate_number("linearise: swing", swing, SWING_RULE)
    pose, tensions, tolerance = _pose_at_rest(robot, requested_position(robot, at), orientation)
    model, derivatives = _model_and_derivatives(robot, pose.orientation)
    state = equilibrium_state(model, pose, tensions, tolerance)
    A, B, C, D, tension_jacobian = _jacobians(derivatives, model, state)
    tension_slopes = tension_jacobian[:, model.indices.pose]
    modes = modes_of(pose, model.indices, tensions, tension_slopes, A, B)
    operating_point = OperatingPoint(robot, model, state, tensions, tension_slopes)
    return LinearPlant(
        _state_space(model, (A, B, C, D)),
        pose.position,
        tensions,
        tension_slopes,
        state,
        modes,
        validity_notes(operating_point, (A, B, C, D), modes, swing),
        pose.orientation,
    )


def _pose_at_rest(
    robot: Robot, position: Array, orientation: Sequence[float] | Array | None
) -> tuple[Pose, Array, float]:
    """The pose at rest at a position (m), static tensions (n,) in N there, and what passes for rest."""
    if not robot.platform.is_rigid_body:
        pose = Pose(robot, *validated_pose("linearise", robot, position, orientation))
        return pose, static_tensions(robot, position), ACCELERATION_TOLERANCE
    at_rest = static_equilibrium(robot, position, orientation=orientation)
    # Two cables hold a surveyed position only nearly; statics has judged that.
    is_exact = at_rest.residual_force <= ACCELERATION_TOLERANCE * robot.platform.mass * max(robot.gravity, 1.0)
    tolerance = ACCELERATION_TOLERANCE if is_exact else SURVEY_TOLERANCE
    return Pose(robot, position, at_rest.orientation), at_rest.tensions, tolerance


def _state_space(model: SymbolicModel, matrices: tuple[Array, Array, Array, Array]) -> Any:
    return control.ss(
        *matrices,
        states=signal_names(model.state_names),
        inputs=signal_names(model.input_names),
        outputs=signal_names(model.output_names),
        name="plant",
    )


def signal_names(names: Sequence[str]) -> list[str]:
    """Signal names for python-control, which reserves the dot for ``system.signal``."""
    return [name.replace(".", "_") for name in names]


# Modes along a path and gains at its knots are of one model.
@memoised(max_results=4)
def _model_and_derivatives(robot: Robot, orientation: Quaternion) -> tuple[SymbolicModel, casadi.Function]:
    """The model at an orientation, and the derivatives of :func:`_jacobians` as functions of states and inputs."""
    model = freeze_drifting_states(symbolic_model(robot, reference_orientation=orientation))
    pairs = [(f, x) for f in (model.rates, model.outputs) for x in (model.states, model.inputs)]
    pairs.append((model.span_tensions, model.states))
    jacobians = [casadi.jacobian(f, x) for f, x in pairs]
    return model, casadi.Function("derivatives", [model.states, model.inputs], jacobians)


def _jacobians(
    derivatives: casadi.Function, model: SymbolicModel, state: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """A, B, C, D, and the Jacobian of the span tensions by the states."""
    values = derivatives(state, np.zeros(model.inputs.numel()))
    a, b, c, d, tension_jacobian = (np.asarray(value, dtype=float) for value in values)
    return a, b, c, d, tension_jacobian


def minimal(
    system: Any,
    inputs: Sequence[str] | str | None = None,
    outputs: Sequence[str] | str | None = None,
    tolerance: float = MINREAL_TOLERANCE,
) -> Any:
    """Minimal realisation of a ``control.StateSpace`` from some inputs to some outputs, by name, with these names.

    None means all inputs, or all outputs.

    Uncontrollable and unobservable states are removed, such as unstrained lengths that the inputs do not drive or
    the outputs do not show. Scaled first, since position, force and tension differ by many powers of ten: time by
    the fastest eigenvalue, states by balancing, signals by their gains; then reduced by orthogonal
    staircases (slycot's TB01PD).

    Raises InputError where a signal is unknown.

    Source: Varga (1981), Proc. 20th IEEE CDC, 42-47.
    """
    rows = _signal_indices("output", system.output_labels if outputs is None else outputs, system.output_labels)
    columns = _signal_indices("input", system.input_labels if inputs is None else inputs, system.input_labels)
    A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in (system.A, system.B, system.C, system.D))
    time_scale = max(float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0)), np.finfo(float).tiny)
    A, (state_scales, _) = matrix_balance(A / time_scale, permute=False, separate=True)
    B, C = B / state_scales[:, None] / time_scale, C * state_scales
    input_gains = np.maximum(np.linalg.norm(B, axis=0), np.finfo(float).tiny)[columns]
    output_gains = np.maximum(np.linalg.norm(C, axis=1), np.finfo(float).tiny)[rows]
    scaled = control.ss(
        A, B[:, columns] / input_gains, C[rows] / output_gains[:, None], np.zeros((len(rows), len(columns)))
    )
    reduced = scaled.minreal(tolerance)
    return control.ss(
        reduced.A * time_scale,
        reduced.B * time_scale * input_gains,
        reduced.C * output_gains[:, None],
        D[np.ix_(rows, columns)],
        inputs=[system.input_labels[column] for column in columns],
        outputs=[system.output_labels[row] for row in rows],
        name=f"{system.name}_minimal",
    )


def transfer_function(system: Any, source: str, target: str, tolerance: float = MINREAL_TOLERANCE) -> Any:
    """The transfer function from one named input to one named output, a ``control.TransferFunction`` of minimal order.

    It is that of :func:`minimal`. Raises InputError where a signal is unknown.
    """
    channel = minimal(system, source, target, tolerance)
    return control.ss2tf(channel, inputs=[source], outputs=[target], name=f"{target}_by_{source}")


def _signal_indices(kind: str, names: Sequence[str] | str, labels: Sequence[str]) -> list[int]:
    requested = [names] if isinstance(names, str) else list(names)
    if not requested:
        raise InputError(kind, f"no {kind} is named", f"choose among {', '.join(labels)}")
    for name in requested:
        if name not in labels:
            raise InputError(kind, f"there is no {kind} {name!r}", f"choose among {', '.join(labels)}")
    return [list(labels).index(name) for name in requested]


def model_document(plant: LinearPlant) -> dict[str, Any]:
    """The content of a model file: operating point, modes, matrices as lists of rows, names, notes."""
    system, modes = plant.system, plant.modes
    return {
        "position": plant.position.tolist(),
        "orientation": list(plant.orientation),
        "tensions": plant.tensions.tolist(),
        "frequencies_hz": modes.frequencies.tolist(),
        "damping_ratios": modes.damping_ratios.tolist(),
        "damped_frequencies_hz": modes.damped_frequencies.tolist(),
        "mode_shapes": modes.shapes.tolist(),
        "cable_shares": modes.cable_shares.tolist(),
        "translational_shares": modes.translational_shares.tolist(),
        **{name: np.asarray(getattr(system, name)).tolist() for name in ("A", "B", "C", "D")},
        "states": list(system.state_labels),
        "inputs": list(system.input_labels),
        "outputs": list(system.output_labels),
        "notes": list(plant.notes),
    }
