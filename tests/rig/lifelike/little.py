"""The little things of a robot: by lot, and each about as large as the sensors' noise."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.rig.effect import Effect
from tests.rig.lifelike.design import Design
from tests.rig.lifelike.processes import ornstein_uhlenbeck, swaying
from tests.rig.lifelike.sensors import Memory, Tracker, drifting
from tests.rig.lifelike.surroundings import Belt, Trembling
from tests.rig.lifelike.survey import Survey

# What each little thing may be called, by the names of the list.
CALLED = {
    "drag": ("drag",),
    "friction": ("friction",),
    "relaxation": ("relaxation", "damping"),
    "drum": ("drum",),
    "backlash": ("hysteresis", "drum", "friction"),
    "belt": ("relaxation", "damping", "modulus"),
    "rope_warmth": ("thermal", "creep"),
    "cell_drift": ("sensor_offset",),
}


@dataclass(frozen=True)
class Little:
    """What is there in small; zero or empty where it is not. SI units.

    `settings` are effects of the list, `counts` says how many m of rope an encoder counts in (0: speeds with noise),
    `lengths` whether the log has rope lengths, `blind` that a planar robot's tracker does not look across the plane.
    """

    settings: dict[str, dict[str, Any]]
    force_rms: float
    force_bandwidth: float
    tension_rms: float
    tension_bandwidth: float
    cell: Memory
    place: Memory
    sway: float = 0.0
    sway_frequency: float = 1.0
    backlash: float = 0.0
    belt: float = 0.0
    rope_warmth: float = 0.0
    cell_drift: float = 0.0
    tracker: Tracker = field(default_factory=Tracker)
    counts: float = 0.0
    lengths: str = "speeds"
    blind: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """What it may be called."""
        things = [*self.settings, *(n for n in ("backlash", "belt", "rope_warmth", "cell_drift") if getattr(self, n))]
        return tuple(sorted({name for thing in things for name in CALLED[thing]}))

    def surroundings(self, random: np.random.Generator, design: Design, half_step: float, rows: int) -> list[Effect]:
        """What acts on one run."""
        count = design.robot.count
        force = ornstein_uhlenbeck(random, (rows, 3), half_step, self.force_rms, self.force_bandwidth)
        sway = swaying(random, (rows, 3), half_step, self.sway, self.sway_frequency) * [1.0, 1.0, 0.0]
        if design.planar:
            force[:, 1], sway[:, 1] = 0.0, 0.0
        growth = drifting(random, (rows, count), self.rope_warmth)
        tension = ornstein_uhlenbeck(random, (rows, count), half_step, self.tension_rms, self.tension_bandwidth)
        moment = self.force_rms * design.size
        torque = ornstein_uhlenbeck(random, (rows, 3), half_step, moment, self.force_bandwidth) if moment else None
        trembling = Trembling(
            half_step=half_step,
            force=force,
            tension=tension,
            torque=torque,
            sway=sway,
            sway_rate=np.gradient(sway, half_step, axis=0),
            growth=growth,
            growth_rate=np.gradient(growth, half_step, axis=0),
        )
        return [trembling, Belt(stiffness_constant=self.belt)] if self.belt else [trembling]


def no_little() -> Little:
    """Nothing but white noise."""
    return Little({}, 0.0, 1.0, 0.0, 1.0, Memory(0.0, 1.0), Memory(0.0, 1.0))


def little_of(random: np.random.Generator, design: Design, survey: Survey, without: tuple[str, ...]) -> Little:
    """The little things of a robot; none of the effects in `without`, which hide there in large."""
    robot, noise = design.robot, design.robot.noise
    force = design.weight * _between(random, 2e-4, 1.2e-3)
    stiffness = float(robot.modulus[0] * robot.area[0]) / design.length

    def lot(chance: float, low: float, high: float) -> float:
        value = _between(random, low, high)
        return value if random.random() < chance else 0.0

    settings = {k: v for k, v in _settings(random, design, force).items() if k not in without}
    counts = 0.0
    lengths = "speeds"
    if random.random() < 0.35:
        counts = noise.winch_speed * 0.01 * _between(random, 2.0, 8.0)
        lengths = str(random.choice(["speeds", "both", "lengths"]))
    return Little(
        settings=settings,
        force_rms=force,
        force_bandwidth=_between(random, 0.2, 6.0),
        tension_rms=noise.tension * _between(random, 0.2, 1.0),
        tension_bandwidth=_between(random, 0.2, 6.0),
        cell=Memory(noise.tension * _between(random, 0.3, 1.0), _between(random, 0.1, 12.0)),
        place=Memory(noise.position * _between(random, 0.3, 1.0), _between(random, 0.1, 12.0)),
        sway=lot(0.3, 0.3, 1.5) * noise.position,
        sway_frequency=_between(random, 0.5, 3.0),
        backlash=lot(0.3, 0.5, 2.0) * noise.position,
        belt=_inverse(lot(0.3, 1e-3, 4e-3), stiffness),
        rope_warmth=lot(0.3, 0.1, 0.5) * survey.anchor / design.length,
        cell_drift=lot(0.3, 0.2, 1.0) * survey.tension_offset,
        tracker=Tracker(lot(0.3, 1.0, 8.0), lot(0.25, 1.0, 4.0), 2.0 * noise.position),
        counts=counts,
        lengths=lengths,
        blind=bool(random.random() < 0.5),
    )


def _settings(random: np.random.Generator, design: Design, force: float) -> dict[str, dict[str, Any]]:
    """Listed effects, each with a chance of one half, or less."""
    robot, noise = design.robot, design.robot.noise
    speed = usual_speed(design)
    grip = _between(random, 0.2, 0.7) * noise.tension / (0.5 * np.pi * design.usual_tension)
    radius = _between(random, 0.03, 0.15) * design.width**0.3
    every = {
        "drag": {"drag_area": _between(random, 0.3, 1.0) * force / (0.5 * 1.225 * speed**2)},
        "friction": {"coefficient": float(grip), "smoothing": 0.03 * speed},
        "relaxation": {"modulus": _between(random, 1e-3, 4e-3) * robot.modulus[0], "time": _between(random, 0.1, 1.0)},
        "drum": {"eccentricity": _between(random, 0.3, 1.0) * noise.position / radius, "radius": radius, "phase": 0.7},
    }
    present = random.random(len(every)) < [0.6, 0.6, 0.6, 0.25]
    return {name: values for (name, values), there in zip(every.items(), present, strict=True) if there}


def usual_speed(design: Design) -> float:
    """About the root mean square of the platform's speed on its slow tones, m/s."""
    return 2.0 * np.pi * 0.08 * design.width * 0.5 / (0.5 * sum(design.slow))


def _between(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _inverse(share: float, stiffness: float) -> float:
    return stiffness / share if share else 0.0
