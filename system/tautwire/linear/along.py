"""The modes along a path, each followed by its shape through crossings with others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from ..arguments import robot_of, whole_number_of
from ..array_arguments import array_of, rising_of
from ..errors import ArgumentError
from ..robots.robot import Robot
from ..trajectory import Trajectory, trajectory_of
from .modes import Modes, cable_shares
from .plant import linearise

Array = NDArray[np.float64]

POINTS = 101
SURE = 0.9
HALVINGS = 6
EQUAL = 1e-3


@dataclass(frozen=True)
class _Here:
    """Modes at a place, and what the cables have in motions there."""

    modes: Modes
    shares: Callable[[Array], Array]


@dataclass(frozen=True)
class ModesAlong:
    """Modes at N places of a path; column k of every array is one mode all along, by frequency at the first place.

    ``abscissa`` (N,) is time in s, or distance travelled in m where ``timed`` is False; ``positions`` (N, 3) in m;
    ``frequencies`` and ``damped_frequencies`` (N, 3) in Hz; ``damping_ratios`` (N, 3); ``shapes`` (N, 3, 3), unit
    columns; ``cable_shares`` (N, n, 3). ``likeness`` (N - 1,) is the least modal assurance criterion, ``(phi_a .
    phi_b)^2`` for unit shapes of a point mass, between neighbours: near 1 each mode is surely itself, below 0.5 the
    path is too coarse there, or modes of one frequency mix.
    """

    abscissa: Array
    timed: bool
    positions: Array
    frequencies: Array
    damping_ratios: Array
    damped_frequencies: Array
    shapes: Array
    cable_shares: Array
    likeness: Array


def modes_along(
    robot: Robot, path: Trajectory | ArrayLike, times: ArrayLike | None = None, points: int = POINTS
) -> ModesAlong:
    """The modes of a robot at rest at places along a path; the paper's Fig. 15 in one call.

    ``path`` is a trajectory, taken at ``times`` (N,) in s or at equally many ``points`` of its duration, or positions
    (N, 3) in m, which may have ``times`` too. A mode is followed by its shape; between neighbours whose shapes differ
    much the path is halved, up to six times, to tell which is which. Modes whose frequencies differ by less than 0.1 %
    turn into each other at the least change: their shapes are turned back to look like those before, so that modes
    that come so near cross.

    Raises ArgumentError where an argument is none of these, or the path has fewer than two places, and what
    :func:`tautwire.linear.linearise` raises.
    """
    robot_of("modes_along: robot", robot)
    whole_number_of("modes_along: points", points, 2, "give two or more")
    place, abscissa, timed = _path(path, times, points)
    count = len(abscissa)

    def here(where: float) -> _Here:
        plant = linearise(robot, place(where), swing=0.0)
        energies = partial(cable_shares, robot, plant.position, plant.tensions, plant.tension_slopes)
        return _Here(plant.modes, energies)

    found = _followed(here, count)
    stacked = {field.name: np.array([getattr(modes, field.name) for modes in found]) for field in fields(Modes)}
    likeness = [np.min(_likeness(a, b).diagonal()) for a, b in pairwise(found)]
    positions = np.array([place(float(index)) for index in range(count)])
    return ModesAlong(abscissa=abscissa, timed=timed, positions=positions, likeness=np.array(likeness), **stacked)


def _path(
    path: Trajectory | ArrayLike, times: ArrayLike | None, points: int
) -> tuple[Callable[[float], Array], Array, bool]:
    """The place at a number of points, fractions between neighbours, with the abscissa and whether that is time."""
    if not hasattr(path, "__len__"):
        trajectory = trajectory_of("modes_along: path", path)
        asked = np.linspace(0.0, trajectory.duration, points) if times is None else times
        instants = rising_of("modes_along: times", asked, "finite times (N,) in s that rise, two or more")
        numbers = np.arange(len(instants))
        return (lambda where: trajectory.position(np.array([np.interp(where, numbers, instants)]))[0]), instants, True
    positions = array_of("modes_along: path", path, (None, 3), "a path, or finite positions (N, 3) in m")
    if len(positions) < 2:
        raise ArgumentError("modes_along: path", path, f"has {len(positions)} places", "give two or more")
    numbers = np.arange(len(positions))
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    abscissa = travelled
    if times is not None:
        meaning = f"one time for each of {len(positions)} positions, in s"
        abscissa = array_of("modes_along: times", times, (len(positions),), meaning)
    return (
        (lambda where: np.array([np.interp(where, numbers, axis) for axis in positions.T])),
        abscissa,
        times is not None,
    )


def _followed(here: Callable[[float], _Here], count: int) -> list[Modes]:
    """The modes at 0 ... count - 1, followed both ways from where they differ most in frequency."""
    places = [here(float(index)) for index in range(count)]
    first = int(np.argmax([_least_gap(place.modes.frequencies) for place in places]))
    found = {first: places[first].modes}
    for sign, indices in ((1, range(first + 1, count)), (-1, range(first - 1, -1, -1))):
        for index in indices:
            before = index - sign
            found[index] = _follow(here, found[before], before, places[index], index, HALVINGS)
    order = np.argsort(found[0].frequencies)
    return [_in_order(found[index], order) for index in range(count)]


def _follow(
    here: Callable[[float], _Here], before: Modes, begin: float, after: _Here, end: float, halvings: int
) -> Modes:
    """The modes at ``end`` in the order and with the signs of those ``before``, at ``begin``."""
    carried = _turned(after, before)
    likeness = _likeness(before, carried)
    rows, columns = linear_sum_assignment(-likeness)
    if halvings == 0 or np.min(likeness[rows, columns]) > SURE:
        return _along(_in_order(carried, columns), before)
    middle = 0.5 * (begin + end)
    between = _follow(here, before, begin, here(middle), middle, halvings - 1)
    return _follow(here, between, middle, after, end, halvings - 1)


def _likeness(a: Modes, b: Modes) -> Array:
    """Modal assurance criterion of each mode of one set with each of another; the mass is the same along all axes."""
    likeness: Array = (a.shapes.T @ b.shapes) ** 2
    return likeness


def _in_order(modes: Modes, order: NDArray[np.intp]) -> Modes:
    return Modes(**{field.name: getattr(modes, field.name)[..., order] for field in fields(Modes)})


def _along(modes: Modes, before: Modes) -> Modes:
    """Shapes that point the way those before do."""
    against = np.sum(before.shapes * modes.shapes, axis=0) < 0.0
    return replace(modes, shapes=np.where(against, -modes.shapes, modes.shapes))


def _turned(here: _Here, towards: Modes) -> Modes:
    """Shapes of nearly one frequency turned among each other to look most like those of ``towards`` (Procrustes).

    Each gets that frequency whose rank its Rayleigh quotient has.
    """
    modes, shapes = here.modes, here.modes.shapes.copy()
    order = np.arange(len(modes.frequencies))
    for group in _groups(modes.frequencies):
        _, columns = linear_sum_assignment(-((shapes[:, group].T @ towards.shapes) ** 2))
        left, _, right = np.linalg.svd(shapes[:, group].T @ towards.shapes[:, columns])
        turn = left @ right
        shapes[:, group] = shapes[:, group] @ turn
        quotients = (turn**2).T @ modes.frequencies[group] ** 2
        order[group] = np.array(group)[np.argsort(np.argsort(quotients))]
    return replace(_in_order(modes, order), shapes=shapes, cable_shares=here.shares(shapes))


def _groups(frequencies: Array) -> list[list[int]]:
    """Modes, by ascending frequency, that differ by less than :data:`EQUAL` from the next."""
    groups: list[list[int]] = [[0]]
    for mode, (lower, upper) in enumerate(pairwise(frequencies), start=1):
        if upper - lower <= EQUAL * upper:
            groups[-1].append(mode)
        else:
            groups.append([mode])
    return [group for group in groups if len(group) > 1]


def _least_gap(frequencies: Array) -> float:
    return float(np.min(np.diff(frequencies) / frequencies[1:]))
