"""Speed-controlled winch drive: a motor whose PI speed loop follows a commanded rope speed within limits.

A PI controller on an inertia, in terms of the rope: ``v`` its speed, ``c`` the command, ``z`` the integral part.

    dv/dt = a,   a = 2 zeta w (c - v) + z,   dz/dt = w (a - z) / (2 zeta)

which is ``(2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2)`` from ``c`` to ``v``. Limits: ``c`` is cut to ``[-V, V]`` and
``a`` to ``[max(-A, -2 zeta w (V + v)), min(A, 2 zeta w (V - v))]``, so ``|v| <= V``. The integral follows the
limited acceleration, not the demanded one, so it stays within ``[-A, A]`` and does not wind up.

Source: Astrom and Hagglund (2006), Advanced PID Control, ISA, section 3.5, automatic reset of a saturated controller.
"""

from typing import Any, NamedTuple, Tuple

from .mathematics import Mathematics

NO_LIMIT = 1e15
# Dead band of the limits in m/s and m/s^2, so that rounding does not decide where a winch rests at one.
LIMIT_DEAD_BAND = 1e-9


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


def proportional_gain(drive: DriveConstants) -> Any:
    """Proportional gain: acceleration for each m/s of speed error, in 1/s."""
    return 2.0 * drive.damping_ratio * drive.frequency


def acceleration(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> Any:
    """Acceleration of the rope under a commanded speed (m/s), in m/s^2."""
    lower, upper = _acceleration_bounds(m, drive, state)
    return _clamp(m, _demanded_acceleration(m, drive, state, command), lower, upper)


def state_rates(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> DriveState:
    """Rates of change of the state."""
    limited_acceleration = acceleration(m, drive, state, command)
    return DriveState(
        limited_acceleration, 0.5 * drive.frequency / drive.damping_ratio * (limited_acceleration - state.integral)
    )


def limit_margins(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> Tuple[Any, Any, Any]:
    """Event indicators of the limits: at a zero crossing a limit becomes active or inactive, or another takes over.

    They are the distances to the limit of the commanded speed (m/s) and to that of the acceleration (m/s^2), and of the
    speed to where its limit takes over from that of the acceleration (m/s). The first is positive while the
    acceleration is limited and the last while it is not, since they do not matter then.
    """
    demand = _demanded_acceleration(m, drive, state, command)
    lower, upper = _acceleration_bounds(m, drive, state)
    limit_excess = m.maximum(demand - upper, lower - demand)
    acceleration_reserve = drive.acceleration_limit - m.absolute(demand)
    takeover_distance = m.absolute(drive.speed_limit - drive.acceleration_limit / proportional_gain(drive))
    return (
        m.maximum(drive.speed_limit - m.absolute(command) - LIMIT_DEAD_BAND, limit_excess / proportional_gain(drive)),
        -limit_excess - LIMIT_DEAD_BAND,
        m.maximum(takeover_distance - m.absolute(state.speed), acceleration_reserve / proportional_gain(drive)),
    )


def _demanded_acceleration(m: Mathematics, drive: DriveConstants, state: DriveState, command: Any) -> Any:
    limited_command = _clamp(m, command, -drive.speed_limit, drive.speed_limit)
    return proportional_gain(drive) * (limited_command - state.speed) + state.integral


def _acceleration_bounds(m: Mathematics, drive: DriveConstants, state: DriveState) -> Tuple[Any, Any]:
    lower = m.maximum(-drive.acceleration_limit, -proportional_gain(drive) * (drive.speed_limit + state.speed))
    upper = -m.maximum(-drive.acceleration_limit, -proportional_gain(drive) * (drive.speed_limit - state.speed))
    return lower, upper


def _clamp(m: Mathematics, value: Any, lower: Any, upper: Any) -> Any:
    return -m.maximum(-m.maximum(value, lower), -upper)
