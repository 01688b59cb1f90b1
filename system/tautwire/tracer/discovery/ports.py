"""Where a formula can act, and how a unit there moves the filter's run: a force, a tension in a rope, a mass.

Any term of a formula is one series along the run times the slopes of its place. The start follows too: a force that is
there at the start is held by other tensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi
import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws.formula import FORCES, NAME, TIME

from ...model.arrays import NUMPY
from ...model.assembly import Assembly, assemble
from ...model.symbolic import OF_FORMULAS, FreeParameter, symbolic_model
from ...model.uncertain import uncertain_numbers
from ...native.repeated import Repeated, stacked
from ...robots.robot import Formula, Robot
from ..linearisation import Linearised
from ..sensing import shown_late

Array = NDArray[np.float64]

# One from the first moment after the start: a tension does not act there, nor does a mass that grows.
AFTER_START = f"tanh(1e9*{TIME.name})"
CLOCK = f"{NAME}.{TIME.name}"


class Site(NamedTuple):
    """A place of formulas, and the cables in which it acts together, none on the platform."""

    place: str
    cables: tuple[int, ...] = ()


@dataclass(frozen=True)
class Along:
    """Names of formulas along K + 1 samples of a run: on the platform, and in each rope; arrays (K + 1,)."""

    platform: dict[str, Array]
    ropes: tuple[dict[str, Array], ...]


class Ports:
    """A robot's places: the forces by axis, the mass, the tension of each cable; p = 4 + n of them.

    Each stretch handed in has to follow the last one.
    """

    def __init__(self, robot: Robot, state_names: Sequence[str]) -> None:
        self._robot = robot
        self._assembly: Assembly = assemble(robot)
        self._names = tuple(state_names)
        numbers = [f"port_{i}" for i in range(4 + robot.cable_count)]
        texts = [*numbers[:3], *(f"{number}*{AFTER_START}" for number in numbers[3:])]
        sites = [*((force, ()) for force in FORCES), ("mass", ()), *(("tension", (i,)) for i in robot.cable_numbers)]
        formulas = [
            Formula(place, text, cables, {number: 0.0})
            for (place, cables), text, number in zip(sites, texts, numbers, strict=True)
        ]
        whole = replace(robot, formulas=(*robot.formulas, *formulas))
        self._slopes = Repeated(_slopes(whole, numbers, state_names))
        self._elapsed, self._travel = 0.0, np.zeros(robot.cable_count)

    def along(self, run: Linearised) -> Along:
        """What formulas may speak of, along the predicted states."""
        states = dict(zip(self._names, run.states, strict=True))
        steps = np.append(0.0, run.step)
        time = self._elapsed + np.cumsum(steps)
        moved = 0.5 * (run.speeds[:, 1:] + run.speeds[:, :-1]) * run.step
        travel = self._travel[:, None] + np.hstack([np.zeros((len(moved), 1)), np.cumsum(moved, axis=1)])
        self._elapsed, self._travel = float(time[-1]), travel[:, -1]
        position = [states[f"position.{axis}"] for axis in "xyz"]
        velocity = [states[f"velocity.{axis}"] for axis in "xyz"]
        platform = dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*position, *velocity), strict=True))
        ropes = []
        for index, component in enumerate(self._assembly.cables):
            own = tuple(
                tuple(
                    states.get(self._name(a.effect.name, s.name, index), np.zeros_like(time)) for s in a.effect.states
                )
                for a in component.effects
            )
            inputs = cable_law.CableInputs(position, velocity, run.speeds[index])
            line = cable_law.span(NUMPY, component.constants, inputs, component.effects)
            unstrained = states[f"unstrained_length_{index + 1}"]
            state = cable_law.CableState(unstrained, travel[index], own)
            moving = cable_law.motion(NUMPY, component.constants, component.effects, state, line, run.speeds[index])
            values = (moving.strain, moving.strain_rate, moving.elastic_tension, line.length, run.speeds[index])
            names = ("strain", "strain_rate", "tension", "length", "winch_speed")
            ropes.append(dict(zip(names, values, strict=True)) | {"travel": travel[index], "time": time})
        return Along(platform | {"time": time}, tuple(ropes))

    def _name(self, effect: str, state: str, index: int) -> str:
        return CLOCK if (effect, state) == (NAME, TIME.name) else f"{effect}.{state}_{index + 1}"

    def through(self, run: Linearised, time: Array) -> tuple[Array, Array, Array, Array]:
        """Slopes at K + 1 samples by what acts there: rates (K + 1, n, p), sensors (K + 1, m, p).

        And the same by what acts at the start, through the static tensions.
        """
        speeds = np.vstack([run.speeds, np.zeros((3, len(time)))])
        longer = [np.hstack([c, c[:, -1:]]) for c in (run.speeds[:, 1:], run.step[None, :], run.shift)]
        found = self._slopes(len(time), run.states, time[None, :], speeds, *longer)
        shaped = [stacked(part, len(time)) for part in found]
        return shaped[0], shaped[1], shaped[2], shaped[3]


def moves(
    sites: Sequence[Site], series: Sequence[Array], begun: Sequence[Array], ports: Ports, run: Linearised, time: Array
) -> tuple[Array, Array]:
    """What series in some sites move along a stretch: B (K, n, p) and D (K, m, p), see :class:`Linearised`.

    Each series has a row for each cable of its site, or one on the platform, (rows, K + 1); ``begun`` (rows,) is what
    it was at the start. ``time`` (K + 1,) in s.
    """
    rates, shown, rates_begun, shown_begun = ports.through(run, time)
    three = list(zip(sites, series, begun, strict=True))
    by_rates = np.stack([_moved(*each, rates, rates_begun) for each in three], axis=2)
    by_sensors = np.stack([_moved(*each, shown, shown_begun) for each in three], axis=2)
    begin, end = by_rates[:-1], by_rates[1:]
    carried = run.step[:, None, None] / 6.0 * (run.transition @ begin + 2.0 * run.half @ (begin + end) + end)
    return carried, by_sensors[:-1]


def _moved(site: Site, values: Array, first: Array, now: Array, begun: Array) -> Array:
    """Of one series, (K + 1, rows of what moves)."""
    if site.place in FORCES:
        port = FORCES.index(site.place)
        pushed: Array = now[:, :, port] * values[0][:, None] + begun[:, :, port] * first[0]
        return pushed
    if site.place == "mass":
        grown: Array = now[:, :, 3] * values[0][:, None]
        return grown
    rows = zip(site.cables, values, first, strict=True)
    pulled: Array = np.sum([now[:, :, 3 + cable] * (row - at)[:, None] for cable, row, at in rows], axis=0)
    return pulled


def _slopes(whole: Robot, numbers: Sequence[str], state_names: Sequence[str]) -> Function:
    """Of a moment: states of the run, time, inputs, next speed, step, shift; gives the four results of ``through``."""
    free = [FreeParameter(OF_FORMULAS, number) for number in numbers]
    model = symbolic_model(whole, free, uncertain_numbers(whole))
    count = whole.cable_count
    places = [model.state_names.index(name) for name in state_names]
    later, step, shift = SX.sym("later", count), SX.sym("step"), SX.sym("shift", 3 + count)
    shown = shown_late(model, count, later, step, shift)
    time = SX.sym("time")
    others = [place for place in range(model.states.numel()) if place not in places]
    outside = model.inputs[count:]
    results: list[tuple[SX, SX]] = []
    for expression in (model.rates[places], shown):
        by_number = casadi.jacobian(expression, model.parameters)
        by_force = casadi.jacobian(expression, outside)
        now = casadi.horzcat(by_force, by_number[:, 3:])
        begun = casadi.horzcat(by_number[:, :3] - by_force, SX(expression.numel(), 1 + count))
        results.append((now, begun))
    (rates, rates_begun), (sensed, sensed_begun) = results
    given = [model.states[places], time, model.inputs, later, step, shift]
    outcome = [rates, sensed, rates_begun, sensed_begun]
    neutral = [model.parameters, *([model.states[others]] if others else [])]
    known = [SX.zeros(len(numbers)), *([time] if others else [])]
    settled = casadi.substitute(outcome, neutral, known)
    return Function("ports", given, [casadi.densify(expression) for expression in settled])
