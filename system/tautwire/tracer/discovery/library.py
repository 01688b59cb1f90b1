"""Terms that a formula may be made of, place by place: what is left over by known effects is looked for among them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.expression import evaluate, read_expression
from tautwire_fmu.laws.formula import FORCES, PLACES

from ...model.arrays import NUMPY
from ...robots.robot import Robot
from .ports import Along, Site

Array = NDArray[np.float64]

# Where tanh bends, in root mean squares of its argument; waves in a room and on a drum, in shares of the motion.
BENDS = (0.1, 0.3, 1.0)
WAVES = 14
LONGEST_WAVE, SHORTEST_WAVE = 3.0, 0.1
SHAPE = "shape"
# The last term keeps its slope finite at rest.
SPEED = "sqrt(vx**2 + vy**2 + vz**2 + 1e-12)"


@dataclass(frozen=True)
class Term:
    """One term in a place: ``text`` may use a ``shape``, a number to be fitted with the coefficient.

    Terms of one ``family`` and shape share the number. ``cables`` as in a formula. A ``listed`` term looks like an
    effect that the project knows, and is there to go along with others.
    """

    place: str
    text: str
    cables: tuple[int, ...] = ()
    family: str = ""
    shape: float = 0.0
    listed: bool = False

    @property
    def site(self) -> Site:
        """Where it acts."""
        return Site(self.place, self.cables)

    def series(self, names: dict[str, Array]) -> Array:
        """Its values along a run, (K,)."""
        tree = read_expression(self.text, (*PLACES[self.place], SHAPE))
        some = next(iter(names.values()))
        values: Array = evaluate(NUMPY, tree, {**names, SHAPE: self.shape}) * np.ones_like(some)
        return values


@dataclass(frozen=True)
class Reach:
    """How far a run goes: mean and root mean square of each name, on the platform and over all ropes."""

    platform: dict[str, tuple[float, float]]
    rope: dict[str, tuple[float, float]]
    spread: dict[str, float] = field(default_factory=dict)


def reach_of(runs: Sequence[Along]) -> Reach:
    """Of a run, stretch by stretch."""
    platform = {name: np.concatenate([run.platform[name] for run in runs]) for name in runs[0].platform}
    rope = {name: np.concatenate([r[name] for run in runs for r in run.ropes]) for name in runs[0].ropes[0]}
    spread = {name: float(np.ptp(values)) for name, values in (platform | rope).items()}
    return Reach(_sizes(platform), _sizes(rope), spread)


def _sizes(columns: dict[str, Array]) -> dict[str, tuple[float, float]]:
    return {name: (float(np.mean(v)), float(np.sqrt(np.mean(v**2)))) for name, v in columns.items()}


def library(robot: Robot, reach: Reach, rhythms: Sequence[float]) -> tuple[Term, ...]:
    """All candidate terms; ``rhythms`` are angular frequencies (rad/s) at which something happens in time."""
    terms = [*_masses(), *(term for force in FORCES for term in _forces(force, robot, reach, rhythms))]
    every = robot.cable_numbers
    for cables in (every, *((cable,) for cable in every)):
        terms += _tensions(cables, reach, rhythms)
    return tuple(terms)


def _masses() -> Iterator[Term]:
    for text in ("time", "time**2"):
        yield Term("mass", text)


def _forces(force: str, robot: Robot, reach: Reach, rhythms: Sequence[float]) -> Iterator[Term]:
    centred = [_from(axis, value) for axis, value in zip("xyz", robot.platform.start, strict=True)]
    moving = [*centred, "vx", "vy", "vz"]
    yield Term(force, "1", listed=True)
    for text in _monomials(moving, 3):
        yield Term(force, text)
    for velocity in ("vx", "vy", "vz"):
        yield Term(force, f"{velocity}*{SPEED}", listed=True)
        yield from _bent(force, velocity, (), reach.platform[velocity][1])
    for text in ("time", "time**2", *(f"time*{name}" for name in moving)):
        yield Term(force, text)
    yield from _rhythms(force, (), rhythms)
    for axis, start in zip("xyz", centred, strict=True):
        for length in _waves(reach.spread[axis]):
            yield from _turning(force, start, (), axis, 2.0 * np.pi / length)


def _tensions(cables: tuple[int, ...], reach: Reach, rhythms: Sequence[float]) -> Iterator[Term]:
    """What grows with time looks like creep or warmth, waves over the travel like a drum out of round."""
    alone = ("tension", "strain_rate", "winch_speed", "travel", "time")
    for text in (*_monomials(alone, 2), *(f"{name}**3" for name in alone)):
        yield Term("tension", text, cables, listed=text in alone or "time" in text)
    for name in ("strain_rate", "winch_speed"):
        yield Term("tension", f"abs({name})", cables)
        yield Term("tension", f"{name}*abs({name})", cables)
        yield from _bent("tension", name, cables, reach.rope[name][1], listed=True)
    yield from _rhythms("tension", cables, rhythms)
    for length in _waves(reach.spread["travel"]):
        yield from _turning("tension", "travel", cables, "travel", 2.0 * np.pi / length, listed=True)


def _from(axis: str, start: float) -> str:
    return f"({axis} {'-' if start >= 0.0 else '+'} {abs(start):.4g})" if round(start, 3) else axis


def _monomials(names: Sequence[str], degree: int) -> Iterator[str]:
    for order in range(1, degree + 1):
        for chosen in combinations_with_replacement(names, order):
            powers = {name: chosen.count(name) for name in chosen}
            yield "*".join(name if power == 1 else f"{name}**{power}" for name, power in powers.items())


def _bent(place: str, name: str, cables: tuple[int, ...], size: float, listed: bool = False) -> Iterator[Term]:
    for bend in BENDS:
        if size > 0.0:
            yield Term(place, f"tanh({SHAPE}*{name})", cables, f"{name} bent", 1.0 / (bend * size), listed)


def _rhythms(place: str, cables: tuple[int, ...], rhythms: Sequence[float]) -> Iterator[Term]:
    for rhythm in rhythms:
        yield from _turning(place, "time", cables, "time", rhythm)


def _turning(
    place: str, name: str, cables: tuple[int, ...], family: str, pace: float, listed: bool = False
) -> Iterator[Term]:
    for function in ("sin", "cos"):
        yield Term(place, f"{function}({SHAPE}*{name})", cables, family, pace, listed)


def _waves(spread: float) -> list[float]:
    """Lengths of waves that a motion so far could show, m."""
    if spread <= 0.0:
        return []
    lengths: list[float] = np.geomspace(LONGEST_WAVE * spread, SHORTEST_WAVE * spread, WAVES).tolist()
    return lengths
