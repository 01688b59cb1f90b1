"""The winch's drive: a motor whose speed loop makes the rope follow a commanded speed, within limits.

A PI controller on an inertia, in terms of the rope: ``v`` its speed, ``c`` the command, ``z`` the integral part.

    dv/dt = a,   a = 2 zeta w (c - v) + z,   dz/dt = w (a - z) / (2 zeta)

which is ``(2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2)`` from ``c`` to ``v``. Limits: ``c`` is cut to ``[-V, V]`` and
``a`` to ``[max(-A, -2 zeta w (V + v)), min(A, 2 zeta w (V - v))]``, so ``|v| <= V``. The integral follows the
acceleration that was possible, not the one asked for, so it stays within ``[-A, A]`` and does not wind up.

Source: Astrom and Hagglund (2006), Advanced PID Control, ISA, section 3.5, automatic reset of a saturated controller.
"""

from typing import Any, NamedTuple, Tuple

from .mathematics import Mathematics

NO_LIMIT = 1e15
# A limit acts from here on, lest rounding decide where a winch rests at it; m/s, m/s^2.
NEGLIGIBLE = 1e-9


class DriveConstants(NamedTuple):
    """``frequency`` w in rad/s, ``damping_ratio`` zeta; limits of the rope in m/s and m/s^2, or NO_LIMIT."""

    frequency: Any
    damping_ratio: Any
    speed_limit: Any
    acceleration_limit: Any


class DriveState(NamedTuple):
    """Speed of the rope in m/s and integral part of its acceleration in m/s^2."""

    speed: Any
    integral: Any


def gain(drive: DriveConstants) -> Any:
    """Acceleration for each m/s that the rope is too slow, in 1/s."""
    return 2.0 * drive.damping_ratio * drive.frequency


def acceleration(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> Any:
    """Acceleration of the rope under a commanded speed (m/s), in m/s^2."""
    lower, upper = _bounds(m, drive, state)
    return _cut(m, _demand(m, drive, state, command), lower, upper)


def state_rates(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> DriveState:
    """Rates of change of the state."""
    possible = acceleration(m, drive, state, command)
    return DriveState(possible, 0.5 * drive.frequency / drive.damping_ratio * (possible - state.integral))


def margins(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> Tuple[Any, Any, Any]:
    """Where one of these changes its sign the law has a kink: a limit begins or ceases to act, or another takes over.

    What is left to the limit of the commanded speed (m/s) and to that of the acceleration (m/s^2), and of the speed to
    where its limit takes over from that of the acceleration (m/s). The first is positive while the acceleration is cut
    and the last while it is not, since they do not matter then.
    """
    demand = _demand(m, drive, state, command)
    lower, upper = _bounds(m, drive, state)
    excess = m.maximum(demand - upper, lower - demand)
    unasked = drive.acceleration_limit - m.absolute(demand)
    taken_over = m.absolute(drive.speed_limit - drive.acceleration_limit / gain(drive))
    return (
        m.maximum(drive.speed_limit - m.absolute(command) - NEGLIGIBLE, excess / gain(drive)),
        -excess - NEGLIGIBLE,
        m.maximum(taken_over - m.absolute(state.speed), unasked / gain(drive)),
    )


def _demand(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> Any:
    within = _cut(m, command, -drive.speed_limit, drive.speed_limit)
    return gain(drive) * (within - state.speed) + state.integral


def _bounds(m: Mathematics, drive: DriveConstants, state: DriveState) -> Tuple[Any, Any]:
    lower = m.maximum(-drive.acceleration_limit, -gain(drive) * (drive.speed_limit + state.speed))
    upper = -m.maximum(-drive.acceleration_limit, -gain(drive) * (drive.speed_limit - state.speed))
    return lower, upper


def _cut(m: Mathematics, value: Any, lower: Any, upper: Any) -> Any:
    return -m.maximum(-m.maximum(value, lower), -upper)
