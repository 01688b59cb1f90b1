"""Which recordings the benchmark makes: a case is a robot, what it hides, and seeds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal
from zlib import crc32

from tests.support.robots import EXAMPLES, NAMES

from .forms import FORMS, LISTED, UNLISTED, Form, forms_of
from .motion import MOTIONS, Motion, declared

Size = Literal["small", "middle", "large"]
Kind = Literal["listed", "form", "pair", "unlisted", "empty"]

SIZES: tuple[Size, ...] = ("small", "middle", "large")
EMPTY_EACH = 2
PAIRS = (
    ("anchor", "pulley"),
    ("modulus", "creep"),
    ("damping", "payload"),
    ("friction", "drum-slip"),
    ("relaxation", "drum-eccentricity"),
    ("hysteresis", "payload"),
    ("sag", "pulley"),
    ("thermal", "damping"),
    ("payload", "drag-wind"),
    ("sensor_delay", "modulus-one"),
)
QUICK = (
    "damping",
    "modulus-one",
    "relaxation",
    "hysteresis",
    "creep",
    "thermal",
    "sag",
    "pulley",
    "anchor",
    "drum-eccentricity",
    "friction",
    "sensor_delay",
)
# Of robot eight, m/s^2: only under accelerations like gravity's would its ropes push.
HARD_SHAKE = 8.0


@dataclass(frozen=True)
class Part:
    """One effect that a case hides, and how visible it is."""

    form: Form
    size: Size


@dataclass(frozen=True)
class Case:
    """One robot that hides something, or nothing; it is recorded on two programs."""

    key: str
    kind: Kind
    robot: str
    parts: tuple[Part, ...]

    @property
    def motion(self) -> Motion:
        """How it moves."""
        motion = MOTIONS[self.robot]
        pushing = any(part.form.key == "pushing" for part in self.parts)
        return replace(motion, shake=HARD_SHAKE) if pushing else motion

    @property
    def names(self) -> frozenset[str]:
        """What it hides, by the names of effects."""
        return frozenset(part.form.name for part in self.parts)

    @property
    def exact_names(self) -> frozenset[str]:
        """Those whose form is that of the list."""
        return self.names

    @property
    def label(self) -> str:
        """What it hides, as a row of a table."""
        return " + ".join(sorted(name.removeprefix("unlisted_") for name in self.names)) or "nothing"

    def seed(self, which: str) -> int:
        """Of the program and the noise of one recording, ``fit`` or ``check``; the same on every machine."""
        return crc32(f"{self.key} {which}".encode()) % 1_000_000

    def effects(self, strengths: Mapping[str, float]) -> dict[str, Any]:
        """What the rig is to do, by the strength of each form."""
        robot = declared(self.robot)
        return {part.form.name: part.form.settings(strengths[part.form.key], robot) for part in self.parts}

    def fingerprint(self, effects: Mapping[str, Any]) -> str:
        """Of all that makes its recordings."""
        content = [self.key, self.robot, (EXAMPLES / self.robot / "robot.toml").read_text(encoding="utf-8")]
        content += [repr(self.motion), json.dumps(effects, sort_keys=True)]
        return hashlib.sha256("\n".join(content).encode()).hexdigest()[:16]


def main_cases() -> tuple[Case, ...]:
    """Every listed effect at three sizes, pairs, kinds that are not on the list, and empty ones."""
    return (*_listed(), *_pairs(), *_unlisted(), *empty_cases("empty", EMPTY_EACH * len(NAMES)))


def quick_cases() -> tuple[Case, ...]:
    """A look: robot three, middle size."""
    middle = tuple(Case(f"quick-{key}", "listed", "three", (Part(FORMS[key], "middle"),)) for key in QUICK)
    unlisted = Case("quick-bungee", "unlisted", "three", (Part(FORMS["bungee"], "middle"),))
    return (*middle, unlisted, Case("quick-empty", "empty", "three", ()))


def empty_cases(prefix: str, count: int) -> tuple[Case, ...]:
    """Robots that do what their files say, in turn."""
    return tuple(Case(f"{prefix}-{index:03d}", "empty", NAMES[index % len(NAMES)], ()) for index in range(count))


def _listed() -> tuple[Case, ...]:
    cases = []
    for index, name in enumerate(dict.fromkeys(form.name for form in LISTED)):
        forms = forms_of(name)
        for place, size in enumerate(SIZES):
            # Robots and forms turn at different paces, so that each size meets each of both.
            form, robot = forms[place % len(forms)], NAMES[(index + place) % len(NAMES)]
            cases.append(Case(f"{form.key}-{robot}-{size}", "listed", robot, (Part(form, size),)))
    return tuple(cases)


def _pairs() -> tuple[Case, ...]:
    return tuple(
        Case(f"{a}+{b}-{robot}", "pair", robot, (Part(FORMS[a], "middle"), Part(FORMS[b], "middle")))
        for index, (a, b) in enumerate(PAIRS)
        for robot in [NAMES[index % len(NAMES)]]
    )


def _unlisted() -> tuple[Case, ...]:
    return tuple(
        Case(f"unlisted-{form.key}-{robot}", "unlisted", robot, (Part(form, size),))
        for index, form in enumerate(UNLISTED)
        for robot in [NAMES[index % len(NAMES)]]
        for size in [SIZES[1 + index % 2]]
    )
