"""The operating point: unstrained lengths and effect states at which the cables hold the platform at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi
import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.rotation import rotation_matrix

from ..array_validation import validate_point
from ..errors import TautwireError
from ..robot.active_effects import attachments, centre_of_mass
from ..robot.cable_routes import cable_routes
from ..robot.schema import Quaternion, Robot
from ..robot.static_equilibrium import static_tensions
from ..robot.symbolic_model import SymbolicModel

Array = NDArray[np.float64]

SLACK_FRACTION = 1e-9
SLACK_LENGTH_FRACTIONS = (1e-6, 1e-5, 1e-4, 1e-3)
MAX_ITERATIONS = 50
NEWTON_TOLERANCE = 1e-10
# Of gravity: accelerations that pass for rest, and those of a platform that two cables hold at a surveyed position.
ACCELERATION_TOLERANCE, SURVEY_TOLERANCE = 1e-6, 1e-2


class OperatingPointError(TautwireError):
    """No equilibrium was found, or none about which the platform oscillates; carries position (m) and reason."""

    def __init__(self, robot: str, position: Sequence[float] | Array, reason: str) -> None:
        self.position = tuple(float(coordinate) for coordinate in position)
        self.reason = reason
        super().__init__(f"{robot}: {reason} at [{format_position(position)}] m")


@dataclass(frozen=True)
class Pose:
    """Pose of a robot's platform: ``position`` of its origin (3,) in m, and ``orientation``, a unit quaternion."""

    robot: Robot
    position: Array
    orientation: Quaternion

    @cached_property
    def arms(self) -> Array:
        """Centre of mass and attachments (1 + n, 3) from the origin, in the axes of the world, in m."""
        points = [centre_of_mass(self.robot), *attachments(self.robot)]
        turned: Array = np.array(points) @ np.array(rotation_matrix(self.orientation)).T
        return turned

    @cached_property
    def attachments(self) -> Array:
        """Where the cables are attached (n, 3), in m."""
        points: Array = self.position + self.arms[1:]
        return points

    @cached_property
    def unit_directions(self) -> Array:
        """Unit vectors of the cables at their attachments (3, n)."""
        return np.array([route.direction for route in self.routes]).T

    @cached_property
    def routes(self) -> tuple[Route, ...]:
        """Routes of the cables from their attachments to their exit points."""
        return cable_routes(REAL, self.robot, self.position.tolist(), self.orientation)

    @property
    def chords(self) -> Array:
        """Distances of the exit points from the attachments (n,), in m."""
        return np.array([route.chord for route in self.routes])

    def displacements(self, shapes: Array) -> Array:
        """Displacements (1 + n, 3, k) of centre of mass and attachments along ``shapes`` (d, k), to first order.

        ``a + r x s`` with the arm s, the translation a in the first three rows and the rotation r in those below.
        """
        turned = np.cross(_rotations(shapes).T[None], self.arms[:, None]).transpose(0, 2, 1)
        moved: Array = shapes[:3] + turned
        return moved

    def curvatures(self, shapes: Array) -> Array:
        """Second-order terms ``r x (r x s)`` (1 + n, 3, k) of these, with the arm s from the centre of mass."""
        rotations = _rotations(shapes).T[None]
        from_centre = (self.arms - self.arms[0])[:, None]
        return np.cross(rotations, np.cross(rotations, from_centre)).transpose(0, 2, 1)


def _rotations(shapes: Array) -> Array:
    """Rotation part (3, k) of shapes (d, k); zero for a point mass."""
    return shapes[3:] if len(shapes) > 3 else np.zeros_like(shapes)


def format_position(position: Sequence[float] | Array) -> str:
    """Formats a position for messages."""
    return ", ".join(f"{coordinate:g}" for coordinate in position)


def requested_position(robot: Robot, at: Sequence[float] | Array | None) -> Array:
    """The requested position in m, by default the start; raises ArgumentError if it is invalid."""
    return np.array(robot.platform.start if at is None else validate_point("at", at))


def slack_cables(tensions: Array) -> NDArray[np.intp]:
    """Indices, from 0, of the cables that carry nothing."""
    return np.flatnonzero(tensions <= SLACK_FRACTION * np.max(tensions))


def equilibrium_state(
    model: SymbolicModel, pose: Pose, tensions: Array, tolerance: float = ACCELERATION_TOLERANCE
) -> Array:
    """Equilibrium state of the model at a pose under static tensions (n,) in N; its rotations count from there.

    A slack cable is a little longer than its span, so that its law is smooth there. Accelerations up to ``tolerance``
    of that of gravity pass for rest.

    Raises OperatingPointError where an effect never settles or something else moves the platform.
    """
    for slack_length in SLACK_LENGTH_FRACTIONS:
        state = _solve_equilibrium(model, pose, tensions, slack_length)
        rates, outputs = _evaluate_model(model, state)
        slack = slack_cables(tensions)
        if np.all(outputs[model.indices.tensions][slack] <= SLACK_FRACTION * np.max(tensions)):
            break
    accelerations = np.abs(rates[model.indices.twist]).reshape(-1, 3).max(axis=1)
    for acceleration, unit in zip(accelerations, ("m/s2", "rad/s2"), strict=False):
        if acceleration > tolerance * max(pose.robot.gravity, 1.0):
            problem = f"the platform accelerates by {acceleration:.3g} {unit} under static tensions"
            raise OperatingPointError(pose.robot.name, pose.position, problem)
    return state


def _solve_equilibrium(model: SymbolicModel, pose: Pose, tensions: Array, slack_length: float) -> Array:
    """Newton's method on unstrained lengths and states of effects.

    Least-norm steps leave an undetermined state (hysteresis of strands) at its initial value.
    """
    lengths, first = model.indices.lengths, model.indices.lengths.start
    taut = np.setdiff1d(np.arange(len(tensions)), slack_cables(tensions)).tolist()
    excess = model.span_tensions / casadi.DM(np.maximum(tensions, np.finfo(float).tiny)) - 1.0
    residual = casadi.vertcat(excess[taut], model.rates[lengths.stop :])
    jacobian = casadi.jacobian(residual, model.states[first:])
    equations = casadi.Function("rest", [model.states, model.inputs], [residual, jacobian])
    state = np.concatenate([pose.position, np.zeros(model.states.numel() - 3)])
    state[lengths] = _initial_lengths(pose, tensions, slack_length)
    zero_inputs = np.zeros(model.inputs.numel())
    for _ in range(MAX_ITERATIONS):
        residual_value, jacobian_value = (np.asarray(value, dtype=float) for value in equations(state, zero_inputs))
        if not (np.all(np.isfinite(residual_value)) and np.all(np.isfinite(jacobian_value))):
            break
        if np.max(np.abs(residual_value), initial=0.0) <= NEWTON_TOLERANCE:
            return state
        state[first:] -= np.linalg.lstsq(jacobian_value, residual_value.ravel(), rcond=None)[0]
    problem = "no equilibrium found; the states of an effect may never converge"
    raise OperatingPointError(pose.robot.name, pose.position, problem)


def _initial_lengths(pose: Pose, tensions: Array, slack_length: float) -> Array:
    """Unstrained lengths by the inverse of the logarithmic law with the declared stiffness, in m."""
    lengths: Array = np.array([route.length for route in pose.routes])
    stiffness = np.array([cable.modulus * cable.area for cable in pose.robot.cables])
    unstrained_lengths: Array = lengths * np.exp((static_tensions(pose.robot) - tensions) / stiffness)
    unstrained_lengths[slack_cables(tensions)] *= 1.0 + slack_length
    return unstrained_lengths


def _evaluate_model(model: SymbolicModel, state: Array) -> tuple[Array, Array]:
    function = casadi.Function("model", [model.states, model.inputs], [model.rates, model.outputs])
    rates, outputs = function(state, np.zeros(model.inputs.numel()))
    return np.asarray(rates, dtype=float).ravel(), np.asarray(outputs, dtype=float).ravel()
