"""Hidden degrees of freedom: something that swings along and is not in the model, told by its frequency and place.

A mass on a spring that rides along gives ``k (u - s)`` to what carries it, with ``s`` the motion of that, and

    u'' + 2 zeta w u' + w^2 u = w^2 s + 2 zeta w s'

On the platform ``s`` is its position; at an exit point or in a rope that gives way, the tension. For each frequency
this force is one more series, and what it takes off the innovations is a spectrum that no rhythm of the motion itself
can fake: where the motion has a peak, its series has that too.

Source: the tuned absorber, Den Hartog (1956), Mechanical Vibrations, sec. 3.3; Ljung (1999), sec. 11.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter
from threadpoolctl import threadpool_limits

from tautwire_fmu.laws.formula import FORCES

from ...errors import TautwireError
from ...linear import linearise
from ...robots.robot import Robot
from ...runs.start import placed
from ..data import Evidence, Sample
from ..fit import Fitter
from ..likelihood import Likelihood
from ..linearisation import linearise_run
from ..verdict import Resonance
from .ports import Along, Ports, Site, moves

Array = NDArray[np.float64]

# The first so many samples are looked at.
MOST_SAMPLES = 10_000
DAMPING_RATIO = 0.02
SPACING = 0.03
# The slowest swings so often in the recording; the fastest is below this share of the sampling rate.
FEWEST_SWINGS, FASTEST_SHARE = 4.0, 0.2
FREQUENCIES = 110
# Of the platform's unknown white acceleration, m/s^2 per root hertz: the first under which the run follows the data.
ROUGHNESS = (0.01, 0.03, 0.1, 0.3)
FOLLOWS = 3.0
# Nats on both samples together and on each, and how much more than at any other frequency.
TOGETHER, EACH, MORE = 20.0, 5.0, 2.5
# So much more is enough where both samples peak so near each other, as a share of the frequency.
SHARP, MORE_OF_SHARP = 0.035, 1.8
# How far apart two frequencies are the same, as a share, or one over the duration; twice as far they are not.
SAME = 0.12
MODE_SHARE = 0.06
OUTPUT_SHARE = 0.25
# Of what the nuisances leave beyond chance.
EXPLAINED = 0.1
CHANCE = 3.0
LEAST_SHARE = 1e-9


class _Column(NamedTuple):
    site: Site
    series: Array


class _Scan(NamedTuple):
    """Nats that each frequency (F,) gains, and each of its sites alone (F, sites); ``left`` are there to be gained."""

    together: Array
    alone: Array
    left: float


@threadpool_limits.wrap(limits=1)
def resonances(robot: Robot, fitter: Fitter, evidence: Evidence) -> tuple[Resonance, ...]:
    """What swings on the platform or at the exit points, where both samples say so."""
    samples = [sample.beginning(MOST_SAMPLES) for sample in (evidence.fit, evidence.judge)]
    frequencies = _frequencies(samples)
    modes = _modes(robot)
    scans = [_scans(robot, fitter, sample, frequencies) for sample in samples]
    names = evidence.fit.recording.channel_names
    found = []
    for group, outputs in ((0, names[:3]), (1, names[3:])):
        fit, judge = scans[0][group], scans[1][group]
        if not _agree(frequencies, fit, judge, FEWEST_SWINGS / frequencies[0]):
            continue
        places = [int(np.argmax(scan.together)) for scan in (fit, judge)]
        gains = [float(scan.together[place]) for scan, place in zip((fit, judge), places, strict=True)]
        frequency = float(np.average(frequencies[places], weights=gains))
        alone = fit.alone[places[0]] + judge.alone[places[1]]
        shown = tuple(n for n, gain in zip(outputs, alone, strict=True) if gain >= OUTPUT_SHARE * np.max(alone))
        if not np.any(np.abs(modes - frequency) < MODE_SHARE * modes):
            found.append((sum(gains), Resonance(frequency, shown, ("fit", "check"))))
    best = max((gain for gain, _ in found), default=0.0)
    return tuple(resonance for gain, resonance in found if gain > best / MORE)


def _frequencies(samples: Sequence[Sample]) -> Array:
    duration = min(sample.recording.duration for sample in samples)
    step = max(float(np.median(np.diff(sample.recording.time))) for sample in samples)
    slowest = FEWEST_SWINGS / duration
    count = min(FREQUENCIES, int(np.log(max(FASTEST_SHARE / step / slowest, 1.1)) / SPACING))
    found: Array = slowest * np.exp(SPACING * np.arange(count + 1))
    return found


def _modes(robot: Robot) -> Array:
    try:
        return linearise(robot).modes.frequencies
    except TautwireError:
        return np.zeros(0)


def _agree(frequencies: Array, fit: _Scan, judge: _Scan, duration: float) -> bool:
    """Whether both samples, of at least so many seconds, have one clear peak, in one place."""
    peaks, others, tops = [], 0.0, 0.0
    for scan in (fit, judge):
        place = int(np.argmax(scan.together))
        if place in (0, len(frequencies) - 1) or scan.together[place] < max(EACH, EXPLAINED * scan.left):
            return False
        same = max(1.0 / duration, SAME * frequencies[place])
        peaks.append((frequencies[place], same))
        tops += float(scan.together[place])
        others += float(np.max(scan.together[np.abs(frequencies - frequencies[place]) > 2.0 * same], initial=0.0))
    (first, near), (second, close) = peaks
    more = MORE_OF_SHARP if abs(first - second) < SHARP * first else MORE
    return bool(abs(first - second) < max(near, close) and tops > TOGETHER and tops > more * others)


def _scans(robot: Robot, fitter: Fitter, sample: Sample, frequencies: Array) -> tuple[_Scan, _Scan]:
    """On the platform, and in the ropes."""
    likelihood, values = fitter.likelihood(robot, (), sample)
    roughness = _following(likelihood, values, sample)
    here = placed(robot, sample.start)
    ports = Ports(here, likelihood.model.state_names)
    runs = linearise_run(likelihood, values, sample.recording, roughness)
    whole = _joined([ports.along(run) for run in runs])
    step = float(np.median(np.diff(sample.recording.time)))
    quiet, swinging = _nuisances(whole, step), _swinging(whole, step, frequencies)
    return _gains(here, likelihood, values, sample, roughness, quiet, swinging, fitter)


def _following(likelihood: Likelihood, values: list[float], sample: Sample) -> float:
    for roughness in ROUGHNESS:
        innovations = likelihood.innovations(sample.recording, values, roughness)
        if float(np.nanmean(innovations.mean_square(sample.rows))) < FOLLOWS:
            return roughness
    return ROUGHNESS[-1]


def _joined(parts: Sequence[Along]) -> Along:
    """Stretches overlap by one sample."""

    def join(columns: Sequence[dict[str, Array]]) -> dict[str, Array]:
        return {
            name: np.concatenate([*(column[name][:-1] for column in columns), columns[-1][name][-1:]])
            for name in columns[0]
        }

    ropes = tuple(join([part.ropes[index] for part in parts]) for index in range(len(parts[0].ropes)))
    return Along(join([part.platform for part in parts]), ropes)


def _nuisances(whole: Along, step: float) -> list[_Column]:
    """What swings infinitely fast or slowly, or not at all: loads, masses, stiffnesses and dampings."""
    found = []
    for force, axis in zip(FORCES, "xyz", strict=True):
        speed = whole.platform[f"v{axis}"]
        place = whole.platform[axis] - whole.platform[axis][0]
        series = (np.ones_like(speed), place, speed, np.gradient(speed, step))
        found += [_Column(Site(force), column) for column in series]
    for cable, rope in enumerate(whole.ropes, start=1):
        found += [_Column(Site("tension", (cable,)), rope[name]) for name in ("tension", "strain_rate", "time")]
    return found


def _swinging(whole: Along, step: float, frequencies: Array) -> list[_Column]:
    """For each frequency: the axes, then the ropes."""
    found: list[_Column] = []
    sites = [*map(Site, FORCES), *(Site("tension", (cable,)) for cable in range(1, len(whole.ropes) + 1))]
    for frequency in frequencies.tolist():
        carriers = [whole.platform[axis] for axis in "xyz"] + [rope["tension"] for rope in whole.ropes]
        found += map(_Column, sites, _ridden(np.array(carriers), frequency, step))
    return found


def _ridden(carriers: Array, frequency: float, step: float) -> Array:
    """``u - s`` of riders that are at rest at the start, a row each."""
    w = 2.0 * np.pi * frequency
    lower = np.array([1.0, 2.0 * DAMPING_RATIO * w, w**2])
    upper, below, _ = cont2discrete((lower[1:], lower), step, method="foh")
    moved = carriers - carriers[:, :1]
    ridden: Array = lfilter(np.ravel(upper), below, moved, axis=1) - moved
    return ridden


def _gains(
    robot: Robot,
    likelihood: Likelihood,
    values: list[float],
    sample: Sample,
    roughness: float,
    quiet: Sequence[_Column],
    swinging: Sequence[_Column],
    fitter: Fitter,
) -> tuple[_Scan, _Scan]:
    """Nats by frequency beside the nuisances, from one run."""
    columns = [*quiet, *swinging]
    sites = [column.site for column in columns]
    begun = [column.series[:1] for column in columns]
    still, width = len(quiet), 3 + robot.cable_count
    inner, across = np.zeros((still, still)), np.zeros((still, len(swinging)))
    own, pull = np.zeros((len(swinging) // width, width, width)), np.zeros(len(columns))
    ports = Ports(robot, likelihood.model.state_names)
    slopes, first, last = np.zeros((len(likelihood.model.state_names), len(columns))), 0, 0
    squares, number = 0.0, 0
    for run in linearise_run(likelihood, values, sample.recording, roughness):
        fitter.between()
        count = len(run.step)
        time = ports.along(run).platform["time"]
        series = [column.series[None, first : first + count + 1] for column in columns]
        slopes, moved = run.carry(slopes, *moves(sites, series, begun, ports, run, time))
        first += count
        rows = np.zeros(count, dtype=bool)
        rows[run.own] = sample.rows[last : last + int(np.sum(run.own))]
        last += int(np.sum(run.own))
        seen = run.seen[rows]
        matrix, values_seen = moved[rows][seen], run.values[rows][seen]
        squares += float(values_seen @ values_seen)
        number += len(values_seen)
        inner += matrix[:, :still].T @ matrix[:, :still]
        across += matrix[:, :still].T @ matrix[:, still:]
        apart = matrix[:, still:].reshape(len(matrix), len(own), width)
        own += np.einsum("rfg,rfh->fgh", apart, apart, optimize=True)
        pull += matrix.T @ values_seen
    beyond_chance = 0.5 * (squares - number) - CHANCE * np.sqrt(0.5 * number)
    return _scanned(inner, across, own, pull, float(beyond_chance))


def _scanned(inner: Array, across: Array, own: Array, pull: Array, nats: float) -> tuple[_Scan, _Scan]:
    """Of the sums of products, with the nuisances projected out; ``nats`` are there before that."""
    still, width = len(inner), own.shape[1]
    held = _solved(inner, np.column_stack([across, pull[:still]]))
    nats -= 0.5 * float(pull[:still] @ held[:, -1])
    left = (pull[still:] - across.T @ held[:, -1]).reshape(-1, width)
    shaped, solved = (matrix.reshape(still, -1, width) for matrix in (across, held[:, :-1]))
    rest = own - np.einsum("nfg,nfh->fgh", shaped, solved, optimize=True)
    scans = []
    for group in (slice(0, 3), slice(3, width)):
        together = np.array([_gain(r[group, group], f[group]) for r, f in zip(rest, left, strict=True)])
        size = np.maximum(np.diagonal(rest, axis1=1, axis2=2)[:, group], np.finfo(float).tiny)
        scans.append(_Scan(together, 0.5 * left[:, group] ** 2 / size, nats))
    return scans[0], scans[1]


def _gain(gram: Array, pull: Array) -> float:
    return float(0.5 * pull @ _solved(gram, pull[:, None])[:, 0])


def _solved(gram: Array, right: Array) -> Array:
    size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    solved: Array = np.linalg.lstsq(gram / np.outer(size, size), right / size[:, None], rcond=LEAST_SHARE)[0]
    return solved / size[:, None]
