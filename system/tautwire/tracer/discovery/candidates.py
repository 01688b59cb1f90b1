"""How every candidate term of a formula would move the innovations, to first order, and which few of them do best.

Terms are added one by one, each time the one that takes most off the sum of squares beside those chosen, while it
takes more than chance would with so many to choose from; then each is exchanged where another does better.

Source: Chen, Billings and Luo (1989), Orthogonal least squares methods and their application to non-linear system
identification, Int. J. Control 50(5), 1873-1896; Chen and Chen (2008), Extended Bayesian information criteria for
model selection with large model spaces, Biometrika 95(3), 759-771.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray

from ...model.symbolic import OF_FORMULAS
from ...robots.robot import Robot
from ...runs.start import placed
from ..data import Sample
from ..fit import Fitter
from ..hypotheses import Hypothesis, free_parameters
from ..linearisation import linearise_run
from .library import Reach, Term, reach_of
from .ports import Along, Ports, moves

Array = NDArray[np.float64]

MOST_TERMS = 6
MOST_EXCHANGES = 12
# Of a term's slopes, the share that others may leave of it at least.
OWN_SHARE = 1e-6


@dataclass(frozen=True)
class Slopes:
    """Slopes ``J`` of the whitened innovations ``e`` by some nuisances, then by each term: ``J' J``, ``J' e``.

    ``count`` is how many innovations there are.
    """

    nuisances: int
    terms: tuple[Term, ...]
    gram: Array
    pull: Array
    count: int


def reach(robot: Robot, accepted: Sequence[Hypothesis], fitter: Fitter, sample: Sample) -> Reach:
    """How far the run of a model over a recording goes."""
    likelihood, values = fitter.likelihood(robot, accepted, sample)
    ports = Ports(placed(robot, sample.start), likelihood.model.state_names)
    return reach_of([ports.along(run) for run in linearise_run(likelihood, values, sample.recording)])


def slopes_of(
    robot: Robot, accepted: Sequence[Hypothesis], terms: Sequence[Term], fitter: Fitter, sample: Sample
) -> Slopes:
    """Of terms added to a robot; the nuisances are the parameters of the accepted hypotheses."""
    likelihood, values = fitter.likelihood(robot, accepted, sample)
    free = free_parameters(robot, accepted)
    own = [place for place, parameter in enumerate(free) if parameter.setting != OF_FORMULAS]
    ports = Ports(placed(robot, sample.start), likelihood.model.state_names)
    size = len(own) + len(terms)
    gram, pull, count = np.zeros((size, size)), np.zeros(size), 0
    sites = [term.site for term in terms]
    slopes, begun, last = np.zeros((len(likelihood.model.state_names), len(terms))), None, 0
    for run in linearise_run(likelihood, values, sample.recording):
        fitter.between()
        along = ports.along(run)
        series = _series(terms, along)
        begun = [values[:, 0] for values in series] if begun is None else begun
        slopes, moved = run.carry(slopes, *moves(sites, series, begun, ports, run, along.platform["time"]))
        rows = np.zeros(len(run.own), dtype=bool)
        rows[run.own] = sample.rows[last : last + int(np.sum(run.own))]
        last += int(np.sum(run.own))
        matrix = np.concatenate([run.slopes[:, :, own], moved], axis=2)[rows]
        seen = run.seen[rows]
        gram += matrix[seen].T @ matrix[seen]
        pull += matrix[seen].T @ run.values[rows][seen]
        count += int(np.sum(seen))
    fine = np.isfinite(np.diag(gram))
    gram = np.where(np.outer(fine, fine), gram, 0.0)
    return Slopes(len(own), tuple(terms), gram, np.where(fine, pull, 0.0), count)


def _series(terms: Sequence[Term], along: Along) -> list[Array]:
    """Of each term its series: (1, K + 1) on the platform, else a row for each of its cables."""
    return [
        np.array([term.series(along.ropes[cable - 1]) for cable in term.cables])
        if term.cables
        else term.series(along.platform)[None, :]
        for term in terms
    ]


def best_terms(slopes: Slopes, present: dict[Term, float], between: Callable[[], None]) -> dict[Term, float]:
    """The few terms that explain most, with their coefficients; ``present`` are those that the run had already."""
    wanted = np.array([present.get(term, 0.0) for term in slopes.terms])
    # What would be left without the present ones.
    pull = slopes.pull - slopes.gram[:, slopes.nuisances :] @ wanted
    least = 0.5 * log(max(slopes.count, 2)) + log(max(len(slopes.terms), 1))
    chosen: list[int] = []
    while len(chosen) < MOST_TERMS:
        gains = _gains(slopes, pull, chosen)
        best = int(np.argmax(gains))
        if gains[best] < least:
            break
        chosen.append(best)
        between()
    for number in range(MOST_EXCHANGES if len(chosen) > 1 else 0):
        place = number % len(chosen)
        rest = [*chosen[:place], *chosen[place + 1 :]]
        gains = _gains(slopes, pull, rest)
        best = int(np.argmax(gains))
        if gains[best] > gains[chosen[place]] * (1.0 + OWN_SHARE):
            chosen[place] = best
    coefficients = _solved(slopes, pull, chosen)
    return {slopes.terms[term]: float(c) for term, c in zip(chosen, coefficients, strict=True)}


def _places(slopes: Slopes, chosen: Sequence[int]) -> list[int]:
    return [*range(slopes.nuisances), *(slopes.nuisances + term for term in chosen)]


def _gains(slopes: Slopes, pull: Array, chosen: Sequence[int]) -> Array:
    """Nats that each term would gain beside the nuisances and the chosen ones."""
    places = _places(slopes, chosen)
    own = np.diag(slopes.gram)[slopes.nuisances :]
    left, force = own.copy(), pull[slopes.nuisances :].copy()
    if places:
        size = np.sqrt(np.maximum(np.diag(slopes.gram)[places], np.finfo(float).tiny))
        inner = slopes.gram[np.ix_(places, places)] / np.outer(size, size)
        across = slopes.gram[np.ix_(places, range(slopes.nuisances, len(slopes.gram)))] / size[:, None]
        held = np.linalg.lstsq(inner, np.column_stack([across, pull[places] / size]), rcond=1e-12)[0]
        left = left - np.sum(across * held[:, :-1], axis=0)
        force = force - across.T @ held[:, -1]
    fine = left > OWN_SHARE * own
    gains: Array = np.where(fine, 0.5 * force**2 / np.where(fine, left, 1.0), 0.0)
    return gains


def _solved(slopes: Slopes, pull: Array, chosen: Sequence[int]) -> Array:
    """Coefficients of the chosen terms by least squares."""
    places = _places(slopes, chosen)
    size = np.sqrt(np.maximum(np.diag(slopes.gram)[places], np.finfo(float).tiny))
    inner = slopes.gram[np.ix_(places, places)] / np.outer(size, size)
    moves: Array = -np.linalg.lstsq(inner, pull[places] / size, rcond=1e-12)[0] / size
    return moves[slopes.nuisances :]
