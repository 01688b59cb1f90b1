"""The part of the linearised plant that winches reach and sensors show, by the Popov-Belevitch-Hautus (PBH) test.

    w' A = s w',  w' B = 0           no winch reaches the mode s: w' x decays by itself or not at all
    A v = s v,    C v = 0            no sensor shows it

Two kinds of modes that neither decay nor are reached concern no winch, and are left out of a design: motion across the
plane of all cables, and what the memory of an effect started with, a constant load. ``w' x = 0`` is then invariant.

Source: Zhou, Doyle and Glover (1996), Robust and Optimal Control, section 3.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import control
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance, null_space, qr

from ..errors import InputError
from ..linear import LinearPlant
from ..linear.operating_point import format_position
from ..robot.schema import AXES
from .design import integrated_freedoms, pose_signals
from .sampled_plant import sensor_output_indices

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Of scaled matrices: modes out of reach are below 1e-14, the least reachable ones of known robots above 1e-6.
RANK_TOLERANCE = 1e-9
# Relative to the fastest eigenvalue: slower decay passes for none.
DECAY_TOLERANCE = 1e-9
# Of an undamped oscillation's eigenvalue: what rounding leaves of its real part is less.
GROWTH_TOLERANCE = 1e-6
# Of the largest motion of a mode.
PLANE_TOLERANCE = 1e-6
# Of the pose's response to rope lengths: below it statics alone decides a coordinate.
REACH_TOLERANCE = 1e-6
# Winch motion over the platform's displacement: at most 2.3 on shipped robots, from ten on hardly any control.
MAX_WINCH_MOTION = 10.0
# Of the largest slope of tension along a mode.
STRETCH_TOLERANCE = 1e-9
# So that rounding does not decide between equal pivots: all places of a path are to have the same.
LATER_PIVOT_FACTOR = 0.95


@dataclass(frozen=True)
class HiddenModes:
    """Non-decaying modes of one eigenvalue, in 1/s, with its conjugate; ``vectors`` (q, k) by the plant's q states."""

    eigenvalue: complex
    vectors: ComplexArray

    @property
    def real_vectors(self) -> Array:
        """Real basis of the vectors and their conjugates."""
        parts = [self.vectors.real, self.vectors.imag] if self.eigenvalue.imag else [self.vectors.real]
        return np.hstack(parts)


@dataclass(frozen=True)
class ScaledPlant:
    """A plant from winch speeds to sensors with time, states and signals scaled; x = ``states`` times scaled states."""

    A: Array
    B: Array
    C: Array
    states: Array
    rate: float


def scaled_plant(linear: LinearPlant) -> ScaledPlant:
    """The plant scaled: time by the fastest eigenvalue, states by balancing, signals by their gains."""
    system, count = linear.system, len(linear.tensions)
    tiny = np.finfo(float).tiny
    rate = max(float(np.max(np.abs(np.linalg.eigvals(system.A)), initial=0.0)), tiny)
    A, (states, _) = matrix_balance(system.A / rate, permute=False, separate=True)
    B = system.B[:, :count] / states[:, None]
    C = system.C[sensor_output_indices(linear)] * states
    B = B / np.maximum(np.linalg.norm(B, axis=0), tiny)
    C = C / np.maximum(np.linalg.norm(C, axis=1), tiny)[:, None]
    return ScaledPlant(A, B, C, states, rate)


def unreached_modes(linear: LinearPlant) -> tuple[HiddenModes, ...]:
    """Non-decaying modes that no winch reaches, by left eigenvectors."""
    scaled = scaled_plant(linear)
    modes = _hidden_modes(scaled.A.T, scaled.B.T)
    return tuple(HiddenModes(s * scaled.rate, vectors / scaled.states[:, None]) for s, vectors in modes)


def unseen_modes(linear: LinearPlant) -> tuple[HiddenModes, ...]:
    """Non-decaying modes that no sensor shows, by right eigenvectors."""
    scaled = scaled_plant(linear)
    modes = _hidden_modes(scaled.A, scaled.C)
    return tuple(HiddenModes(s * scaled.rate, vectors * scaled.states[:, None]) for s, vectors in modes)


def _hidden_modes(A: Array, C: Array) -> list[tuple[complex, ComplexArray]]:
    """Non-decaying eigenvalues s, one of each pair, with the null space of [A - s I; C] where there is one."""
    hidden: list[tuple[complex, ComplexArray]] = []
    tested: list[complex] = []
    for eigenvalue in np.linalg.eigvals(A).astype(complex).tolist():
        s = eigenvalue if abs(eigenvalue) > RANK_TOLERANCE else 0j
        s = s if abs(s.imag) > RANK_TOLERANCE else complex(s.real)
        if s.real < -DECAY_TOLERANCE or s.imag < 0.0 or any(abs(s - other) < RANK_TOLERANCE for other in tested):
            continue
        tested.append(s)
        vectors = null_space(np.vstack([A - s * np.eye(len(A)), C]), rcond=RANK_TOLERANCE)
        if vectors.shape[1]:
            hidden.append((s, vectors))
    return hidden


def reachable_plant(linear: LinearPlant) -> LinearPlant:
    """The plant without motion across the plane of all cables and without the constant memories of effects.

    Outputs remain, in their order; the states left out are linear in the others. Where all is within reach it is the
    plant itself. Loads act by their parts that the winches reach.
    """
    unreached = unreached_modes(linear)
    oscillating = [modes for modes in unreached if modes.eigenvalue.imag]
    hidden = [modes for modes in unreached if _is_memory(linear, modes)]
    hidden += oscillating if _is_across_plane(linear, oscillating) else []
    if not hidden:
        return linear
    system, labels = linear.system, linear.system.state_labels
    W = np.hstack([modes.real_vectors for modes in hidden])
    dropped = _dropped_states(linear, W)
    kept = np.setdiff1d(np.arange(len(W)), dropped)
    states = np.zeros((len(W), len(kept)))
    states[kept] = np.eye(len(kept))
    states[dropped] = -np.linalg.solve(W[dropped].T, W[kept].T)
    inputs = system.B - W @ (np.linalg.pinv(W) @ system.B)
    reduced = control.ss(
        (system.A @ states)[kept],
        inputs[kept],
        system.C @ states,
        system.D,
        states=[labels[index] for index in kept],
        inputs=system.input_labels,
        outputs=system.output_labels,
        name=system.name,
    )
    return replace(linear, system=reduced)


def _is_memory(linear: LinearPlant, modes: HiddenModes) -> bool:
    """Whether unreached modes are constants that states of effects hold."""
    of_effects = modes.vectors[_effect_states(linear)]
    return modes.eigenvalue == 0 and int(np.linalg.matrix_rank(of_effects)) == of_effects.shape[1]


def _is_across_plane(linear: LinearPlant, oscillating: Sequence[HiddenModes]) -> bool:
    """Whether unreached modes are all motion across a plane: along its normal n, and rotations about axes in it."""
    d, count, labels = linear.degrees_of_freedom, len(linear.tensions), linear.system.state_labels
    size = sum(modes.vectors.shape[1] for modes in oscillating)
    is_growing = any(modes.eigenvalue.real > GROWTH_TOLERANCE * abs(modes.eigenvalue) for modes in oscillating)
    if size != (1 if d == 3 else 3) or is_growing or not set(twist_states(d)) <= set(labels):
        return False
    # Left eigenvectors show impulses, which the inverse of the mass matrix makes a motion.
    twist = [labels.index(name) for name in twist_states(d)]
    impulses = np.hstack([modes.real_vectors for modes in oscillating])[twist]
    motion = linear.system.B[twist, count : count + d] @ impulses
    normals, sizes, _ = np.linalg.svd(motion[:3])
    tilt = normals[:, 0] @ motion[3:] if d > 3 else np.zeros(1)
    bound = PLANE_TOLERANCE * np.max(np.abs(motion))
    return bool(sizes[0] > bound and np.all(sizes[1:] <= bound) and np.all(np.abs(tilt) <= bound))


def _effect_states(linear: LinearPlant) -> list[int]:
    """Indices of the states of effects."""
    others = [*_pose_and_twist(linear), *(f"unstrained_length_{i}" for i in range(1, len(linear.tensions) + 1))]
    return [index for index, label in enumerate(linear.system.state_labels) if label not in others]


def _pose_and_twist(linear: LinearPlant) -> list[str]:
    return [*pose_signals(linear.degrees_of_freedom), *twist_states(linear.degrees_of_freedom)]


def twist_states(degrees_of_freedom: int) -> list[str]:
    """Names of the states of velocity, and of a rigid body of angular velocity."""
    names = pose_signals(degrees_of_freedom)
    return [name.replace("position", "velocity").replace("rotation", "angular_velocity") for name in names]


def _dropped_states(linear: LinearPlant, W: Array) -> list[int]:
    """As many states as ``W`` has columns, which W' x = 0 gives by the others: of effects, else of the platform."""
    labels, d = linear.system.state_labels, linear.degrees_of_freedom
    groups = [_effect_states(linear)]
    groups += [[labels.index(name) for name in names] for names in (twist_states(d), pose_signals(d))]
    return _independent_rows(W / np.linalg.norm(W, axis=0), groups, RANK_TOLERANCE)


def _independent_rows(rows: Array, groups: Sequence[list[int]], tolerance: float) -> list[int]:
    """Indices, ascending, of rows that span all: of the first groups if possible, there the largest ones."""
    independent: list[int] = []
    remaining = rows
    for group in groups:
        if not group or not remaining.shape[1]:
            continue
        weighted = remaining[group] * LATER_PIVOT_FACTOR ** np.arange(len(group))[:, None]
        _, triangle, order = qr(weighted.T, mode="economic", pivoting=True)
        rank = int(np.count_nonzero(np.abs(np.diag(triangle)) > tolerance))
        chosen = [group[index] for index in order[:rank]]
        independent += chosen
        remaining = remaining @ null_space(remaining[chosen]) if chosen else remaining
    return sorted(independent)


def integrated_coordinates(linear: LinearPlant) -> list[int]:
    """Coordinates of the pose that integral action holds, as many as the winches reach at zero frequency.

    All of them or the position, by :func:`integrated_freedoms`, as far as constant rope lengths move them independently
    of each other: of a point mass in a plane two.
    """
    freedoms = integrated_freedoms(len(linear.tensions), linear.degrees_of_freedom)
    gain = linear.system.C[:freedoms] @ _states_at_rest(linear)
    groups = [list(range(len(AXES))), list(range(len(AXES), freedoms))]
    return _independent_rows(gain / np.linalg.norm(gain, 2), groups, REACH_TOLERANCE)


def _states_at_rest(linear: LinearPlant) -> Array:
    """Basis of the states at which the plant rests, with winches at standstill."""
    scaled = scaled_plant(linear)
    at_rest = null_space(np.hstack([scaled.A, scaled.B]), rcond=RANK_TOLERANCE)[: len(scaled.A)]
    states: Array = scaled.states[:, None] * at_rest
    return states


def reach_notes(linear: LinearPlant) -> tuple[str, ...]:
    """One line for each mode that winches reach, but only by motions over ten times as large as the platform's.

    At rest the pose is ``shapes eta``, ``eta = R dl`` by the unstrained lengths; of mode i the least ``|dl|`` for a
    displacement by ``eta_i``, the largest of centre of mass and attachments, is ``eta_i / |R_i|``.
    """
    labels, freedoms = list(linear.system.state_labels), linear.degrees_of_freedom
    at_rest = _states_at_rest(linear)
    lengths = at_rest[[labels.index(f"unstrained_length_{i}") for i in range(1, len(linear.tensions) + 1)]]
    pose_gain = linear.system.C[:freedoms] @ at_rest @ np.linalg.pinv(lengths)
    modal_gains = np.linalg.norm(np.linalg.solve(linear.modes.shapes, pose_gain), axis=1)
    return tuple(
        f"at [{format_position(linear.position)}] m: the winches hardly reach the mode of {frequency:.3g} Hz, "
        f"{_directions(dict(enumerate(np.abs(shape))))}: moving the platform by 1 mm in it takes winch motions of "
        f"{1.0 / gain:.2g} mm, and feedback does little to it; arrange the cables otherwise, or shape paths so that "
        "they do not excite it"
        for frequency, shape, gain in zip(linear.modes.frequencies, linear.modes.shapes.T, modal_gains, strict=True)
        if REACH_TOLERANCE < gain < 1.0 / MAX_WINCH_MOTION
    )


def lowest_frequency(linear: LinearPlant) -> float:
    """Angular frequency of the lowest mode that stretches a cable, in rad/s; motion across a plane stretches none."""
    stretch = np.linalg.norm(linear.tension_slopes @ linear.modes.shapes, axis=0)
    return 2.0 * np.pi * float(linear.modes.frequencies[stretch > STRETCH_TOLERANCE * np.max(stretch)][0])


def require_reachable(where: str, linear: LinearPlant) -> None:
    """Refuses a plant with a mode that does not decay and that no winch reaches or no sensor shows.

    Raises InputError, which names the mode.
    """
    at = f"at [{format_position(linear.position)}] m"
    for modes in unreached_modes(linear):
        problem = f"{_description(linear, modes)} {at}: no winch reaches it and it does not decay"
        hint = "arrange the cables so that they move the platform there, or give the robot file an effect that damps it"
        raise InputError(where, problem, hint)
    for modes in unseen_modes(linear):
        problem = f"{_description(linear, modes)} {at}: neither pose nor tensions show it and it does not decay"
        raise InputError(where, problem, "leave out the effect that it belongs to")


def _description(linear: LinearPlant, modes: HiddenModes) -> str:
    """Frequency of modes, and what moves in them."""
    labels, twist = list(linear.system.state_labels), twist_states(linear.degrees_of_freedom)
    size = np.abs(modes.vectors).max(axis=1)
    if modes.eigenvalue.imag == 0.0:
        return f"has a mode at standstill, of {labels[int(np.argmax(size))]},"
    moving = {twist.index(label): value for label, value in zip(labels, size, strict=True) if label in twist}
    return f"has a mode of {modes.eigenvalue.imag / (2.0 * np.pi):.3g} Hz, {_directions(moving)},"


def _directions(amplitudes: Mapping[int, float]) -> str:
    """Names of the coordinates in which a mode is at least half as large as in that of its largest amplitude."""
    names = [*AXES, *(f"rotation about {axis}" for axis in AXES)]
    most = max(amplitudes.values())
    directions = " and ".join(names[index] for index, value in amplitudes.items() if value > 0.5 * most)
    return f"along {directions}".replace("along rot", "rot")
