"""Cases as of real robots: a lifelike robot by lot of the rig, and what it hides."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from zlib import crc32

from tests.rig.lifelike.hidden import (
    HIDDEN,
    HIDDEN_ON_PLATFORMS,
    PAIRS,
    RIGHT,
    UNLISTED,
    WRONG,
    Hidden,
    names_of,
)

from .cases import Case, Kind

RIG = Path(__file__).resolve().parents[2] / "rig"
PREFIX, ALARM = "lifelike-", "lifelike-alarm-"
EMPTY = 6
# Cables, and whether they lie in a plane, in turn.
ROBOTS = ((3, False), (4, False), (3, False), (8, False), (4, True), (3, False), (6, False))
# These lean or push out of the plane of a planar robot, or hardly show in one.
NEVER_PLANAR = ("pulley-tilted", "sag-steep", "swing")


@dataclass(frozen=True)
class LifelikeCase(Case):
    """One lifelike robot; `hide` are keys of the rig's HIDDEN, `cables` and `planar` are by lot where they are None.

    One `turning` has a platform that turns, an `exact` one nothing uncertain or little.
    """

    hide: tuple[str, ...] = ()
    cables: int | None = None
    planar: bool | None = None
    turning: bool = False
    exact: bool = False

    @property
    def parts_hidden(self) -> list[Hidden]:
        """What it hides, by the rig's own keys."""
        known = HIDDEN_ON_PLATFORMS if self.turning else HIDDEN
        return [known[key] for key in self.hide]

    @property
    def names(self) -> frozenset[str]:
        """What it hides, by the names of effects."""
        return frozenset(names_of(self.parts_hidden))

    @property
    def exact_names(self) -> frozenset[str]:
        """Those whose form is that of the list, so that intervals can be held against the truth."""
        return frozenset(part.name for part in self.parts_hidden if part.manner == "right")

    @property
    def own_seed(self) -> int:
        """Of the robot and all that happens to it; the same on every machine."""
        return crc32(self.key.encode()) % 1_000_000

    def effects(self, strengths: Mapping[str, float]) -> dict[str, Any]:
        """None before the recordings are made; the rig finds the strengths."""
        return {}

    def fingerprint(self, effects: Mapping[str, Any]) -> str:
        """Of all that makes its recordings."""
        return hashlib.sha256(f"{self.key} {_rig_version()}".encode()).hexdigest()[:16]


def lifelike_cases() -> tuple[LifelikeCase, ...]:
    """Every listed effect in its own form and in another, pairs, what is on no list, and empty ones."""
    return (
        *_each("listed", [(part.key,) for part in RIGHT]),
        *_each("form", [(part.key,) for part in WRONG]),
        *_each("pair", list(PAIRS)),
        *_each("unlisted", [(part.key,) for part in UNLISTED]),
        *lifelike_empty_cases(f"{PREFIX}empty-", EMPTY),
    )


def lifelike_empty_cases(prefix: str, count: int) -> tuple[LifelikeCase, ...]:
    """Robots of any kind with nothing but the little things."""
    return tuple(LifelikeCase(f"{prefix}{index:03d}", "empty", "any", ()) for index in range(count))


def _each(kind: Kind, hidden: list[tuple[str, ...]]) -> list[LifelikeCase]:
    cases = []
    for index, keys in enumerate(hidden):
        cables, planar = ROBOTS[index % len(ROBOTS)]
        if planar and any(key in NEVER_PLANAR for key in keys):
            cables, planar = 4, False
        robot = f"{cables} cables in a plane" if planar else f"{cables} cables"
        key = f"{PREFIX}{'+'.join(keys)}-{cables}{'p' if planar else ''}"
        cases.append(LifelikeCase(key, kind, robot, (), keys, cables, planar))
    return cases


@cache
def _rig_version() -> str:
    content = hashlib.sha256()
    for path in sorted(path for path in RIG.rglob("*.py") if not path.name.startswith("test_")):
        content.update(path.read_bytes())
    return content.hexdigest()
