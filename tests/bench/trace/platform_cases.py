"""Cases on platforms that turn, on eight cables and on four: exact but for white noise, and lifelike."""

from __future__ import annotations

from tests.rig.lifelike.hidden import HIDDEN_ON_PLATFORMS

from .cases import Kind
from .lifelike_cases import LifelikeCase

PREFIX = "platform-"
KINDS: dict[str, Kind] = {"right": "listed", "wrong": "form", "unlisted": "unlisted"}
LISTED = (
    "centre_of_mass",
    "attachment",
    "inertia",
    "rotational_drag",
    "transverse_damping",
    "payload-aside",
    "payload",
    "damping",
    "modulus",
    "drum",
    "friction",
    "pulley",
    "anchor",
    "hysteresis",
    "sensor_gain",
    "sensor_offset",
)
WRONG = ("rotational_drag-quadratic", "transverse_damping-quadratic", "friction-linear")
UNLISTED = ("bungee", "gusts", "frame")
# Of each number of cables, with nothing hidden.
EMPTY = 2


def platform_cases() -> tuple[LifelikeCase, ...]:
    """Every effect that only turning platforms have, others in turn, wrong forms, what is on no list, and empty ones.

    Exact ones hide effects in the form of the list, unlisted ones, or nothing.
    """
    lifelike = [_case(key, cables, False) for key in (*LISTED, *WRONG, *UNLISTED) for cables in (8, 4)]
    exact = [_case(key, (8, 4)[index % 2], True) for index, key in enumerate((*LISTED, *UNLISTED))]
    empty = [
        _case("", cables, is_exact, f"-{number}")
        for is_exact in (True, False)
        for cables in (8, 4)
        for number in range(EMPTY)
    ]
    return (*exact, *lifelike, *empty)


def _case(hide: str, cables: int, is_exact: bool, suffix: str = "") -> LifelikeCase:
    key = f"{PREFIX}{'exact' if is_exact else 'lifelike'}-{hide or 'empty'}-{cables}{suffix}"
    kind: Kind = KINDS[HIDDEN_ON_PLATFORMS[hide].manner] if hide else "empty"
    robot = f"platform on {cables} cables"
    return LifelikeCase(key, kind, robot, (), (hide,) if hide else (), cables, False, True, is_exact)
