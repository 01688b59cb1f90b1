"""From what happens to what a log says: noise with a memory, drift, a tracker that drops out and jumps, counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.rig.lifelike.processes import ornstein_uhlenbeck
from tests.rig.robot import Vector


@dataclass(frozen=True)
class Memory:
    """The part of a sensor's noise that has a memory: deviation, and bandwidth in Hz."""

    rms: float
    bandwidth: float


@dataclass(frozen=True)
class Tracker:
    """How often a minute the tracker drops out and jumps, and by how many metres at most it jumps."""

    dropouts: float = 0.0
    jumps: float = 0.0
    jump: float = 0.0


def noisy(random: np.random.Generator, values: Vector, interval: float, white: float, memory: Memory) -> Vector:
    """With white noise of a deviation, and noise that remembers."""
    shape = (values.shape[0], values.shape[1])
    coloured = ornstein_uhlenbeck(random, shape, interval, memory.rms, memory.bandwidth)
    return np.asarray(values + random.normal(scale=white, size=shape) + coloured, float)


def drifting(random: np.random.Generator, shape: tuple[int, int], most: float) -> Vector:
    """A slow drift of each column that ends at most `most` from where it began, bent by chance."""
    share = np.linspace(0.0, 1.0, shape[0])[:, None]
    ends = random.uniform(-most, most, shape[1])
    return np.asarray(ends * share ** random.uniform(0.5, 2.0, shape[1]), float)


def tracked(random: np.random.Generator, position: Vector, interval: float, tracker: Tracker) -> Vector:
    """Positions with stretches that are missing (nan) for 0.05 to 1 s, and stretches that stand off for 0.5 to 4 s."""
    result = position.copy()
    span = interval * len(position)
    for _ in range(random.poisson(tracker.jumps * span / 60.0)):
        begin, length = random.uniform(0.0, span), random.uniform(0.5, 4.0)
        rows = slice(int(begin / interval), int((begin + length) / interval))
        result[rows] += random.uniform(-tracker.jump, tracker.jump, position.shape[1])
    for _ in range(random.poisson(tracker.dropouts * span / 60.0)):
        begin, length = random.uniform(1.0, span), random.uniform(0.05, 1.0)
        result[int(begin / interval) : int((begin + length) / interval)] = np.nan
    return result


def counted(travel: Vector, count: float) -> Vector:
    """Travel as an encoder tells it, in whole counts of `count` m of rope."""
    return np.asarray(count * np.round(travel / count), float)


def differentiated(travel: Vector, interval: float) -> Vector:
    """Speeds by central differences; one-sided at the ends."""
    return np.asarray(np.gradient(travel, interval, axis=0), float)
