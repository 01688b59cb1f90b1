"""How an effect that is absent would begin to act, along the run of a model without it.

With the effect's own states ``z`` and their slopes ``Z`` by its parameters

    dz/dt = g(x, z)        dZ/dt = g_z Z + g_p        d(dx/dt) = f_p + f_z Z        d(shown) = h_p + h_z Z

are taken along the run's states ``x``: an absent effect moves nothing, so it need not be simulated with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi
import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import Effect

from ..model.symbolic import FreeParameter, symbolic_model
from ..model.uncertain import uncertain_numbers
from ..native.repeated import Repeated, stacked
from ..robots.robot import PER_CABLE, Robot
from .hypotheses import Hypothesis
from .linearisation import Linearised
from .sensing import shown_late

Array = NDArray[np.float64]

# Integration steps of an effect's own states in a sample; they can be stiffer than the robot.
SUBSTEPS = 4


@dataclass(frozen=True)
class Column:
    """One direction: a parameter of an effect on a cable (none on the platform), at one of the effect's trials."""

    effect: str
    cables: tuple[int, ...]
    parameter: str
    trial: int


class EffectDirections:
    """One effect, switched on and neutral, each cable for itself, beside what a robot has already.

    ``columns`` (p) say what is moved; ``values`` (p) where they begin; ``start`` (n, p) are slopes of the start.
    """

    def __init__(
        self,
        robot: Robot,
        effect: Effect,
        cables: Sequence[int],
        forms: Sequence[tuple[str, ...]],
        trials: Sequence[Mapping[str, float]],
        state_names: Sequence[str],
    ) -> None:
        places = [()] if effect.component not in PER_CABLE else [(cable,) for cable in cables]
        free, whole, fixed, begun = [], robot, [], []
        for chosen in places:
            setting = Hypothesis(effect, chosen).neutral(robot, chosen)
            whole = whole.with_effect(setting)
            index = next(i for i, s in enumerate(whole.effects) if (s.name, s.cables) == (effect.name, chosen))
            names = list(dict.fromkeys(name for form in forms for name in form if name not in trials[0]))
            free += [FreeParameter(index, name) for name in names]
            begun += [(chosen, name, float(setting.values[name])) for name in names]
            fixed += [FreeParameter(index, name) for name in trials[0]]
        self._trials = trials
        self._chosen = [_chosen(begun, forms, trial, number) for number, trial in enumerate(trials)]
        self.columns = tuple(
            Column(effect.name, begun[i][0], begun[i][1], number)
            for number, kept in enumerate(self._chosen)
            for i in kept
        )
        self.values = np.array([begun[i][2] for kept in self._chosen for i in kept])
        self._neutral = np.array([value for _, _, value in begun])
        self._shapes = [np.tile(list(trial.values()), len(places)) for trial in trials]
        self._compile(whole, free, fixed, state_names, robot.cable_count)
        self._states = [self._begin(number)[0] for number in range(len(trials))]
        self.start = np.hstack([self._begin(number)[1][:, kept] for number, kept in enumerate(self._chosen)])

    def _compile(
        self,
        whole: Robot,
        free: Sequence[FreeParameter],
        fixed: Sequence[FreeParameter],
        state_names: Sequence[str],
        cable_count: int,
    ) -> None:
        model = symbolic_model(whole, [*free, *fixed], uncertain_numbers(whole))
        places = [model.state_names.index(name) for name in state_names]
        mine = [place for place in range(len(model.state_names)) if place not in places]
        z, theta, p = model.states[mine], model.parameters, model.parameters[: len(free)]
        later, step, shift = SX.sym("later", cable_count), SX.sym("step"), SX.sym("shift", 3 + cable_count)
        slopes = SX.sym("slopes", len(mine), len(free))
        shown = shown_late(model, cable_count, later, step, shift)
        given = [model.states[places], z, slopes, model.inputs, theta]

        def moved(expression: SX) -> SX:
            return casadi.densify(
                casadi.jacobian(expression, p) + casadi.mtimes(casadi.jacobian(expression, z), slopes)
            )

        self._own_count, self._free_count = len(mine), len(free)
        self._moved = Repeated(
            Function("moved", [*given, later, step, shift], [moved(model.rates[places]), moved(shown)])
        )
        rates = Function("rates", given, [casadi.densify(model.rates[mine]), moved(model.rates[mine])])
        self._advance = Repeated(
            _own_step(rates, len(places), len(mine), len(free), cable_count, theta.numel()), carried=2
        )
        begin = casadi.jacobian(model.start[places], p)
        self._start = Function("start", [theta], [casadi.densify(model.start[mine]), casadi.densify(begin)])
        self._inputs = model.inputs.numel()

    def _begin(self, number: int) -> tuple[tuple[Array, Array], Array]:
        own, start = self._start(self._theta(number))
        return (np.array(own), np.zeros((self._own_count, self._free_count))), np.array(start)

    def _theta(self, number: int) -> Array:
        theta: Array = np.append(self._neutral, self._shapes[number])
        return theta

    def through(self, run: Linearised) -> tuple[Array, Array]:
        """What moves along a stretch of the run, which has to follow the last one: B (K, n, p) and D (K, m, p)."""
        found = [self._trial_through(run, number) for number in range(len(self._trials))]
        by_rates, by_sensors = (np.concatenate(parts, axis=2) for parts in zip(*found, strict=True))
        return by_rates, by_sensors

    def _trial_through(self, run: Linearised, number: int) -> tuple[Array, Array]:
        """Taken along the predicted states, which the noise of what they predict has not touched."""
        theta, count = self._theta(number)[:, None], run.states.shape[1]
        inputs = np.vstack([run.speeds, np.zeros((self._inputs - len(run.speeds), count))])
        own, slopes = self._own_states(run, theta, number)
        moment = [_longer(column) for column in (run.speeds[:, 1:], run.step[None, :], run.shift)]
        found = self._moved(count, run.states, own, slopes, inputs, theta, *moment)
        rates, shown = (stacked(part, count)[:, :, self._chosen[number]] for part in found)
        begin, end = rates[:-1], rates[1:]
        by_rates = run.step[:, None, None] / 6.0 * (run.transition @ begin + 2.0 * run.half @ (begin + end) + end)
        return by_rates, shown[:-1]

    def _own_states(self, run: Linearised, theta: Array, number: int) -> tuple[Array, Array]:
        """The effect's states (own, K + 1) and their slopes (own, p x (K + 1))."""
        count, width = len(run.step), self._free_count
        if not self._own_count:
            return np.zeros((0, count + 1)), np.zeros((0, width * (count + 1)))
        ends = (run.states[:, :-1], run.states[:, 1:], run.speeds[:, :-1], run.speeds[:, 1:])
        own, slopes = self._advance(count, *self._states[number], *ends, run.step[None, :], theta)
        self._states[number] = (own[:, -1:], slopes[:, width * count :])
        return own, slopes


def _longer(columns: Array) -> Array:
    """With the last sample twice."""
    return np.hstack([columns, columns[:, -1:]])


def _chosen(
    begun: Sequence[tuple[tuple[int, ...], str, float]],
    forms: Sequence[tuple[str, ...]],
    trial: Mapping[str, float],
    number: int,
) -> list[int]:
    """Of the parameters, those that are not the same in every trial; in the first all."""
    moving = {name for form in forms if set(form) & set(trial) for name in form}
    return [i for i, (_, name, _) in enumerate(begun) if number == 0 or name in moving]


def _own_step(rates: Function, states: int, own: int, free: int, cable_count: int, parameters: int) -> Function:
    """The effect's states and their slopes over a sample, along the straight line between two states of the run."""
    z, slopes = SX.sym("z", own), SX.sym("slopes", own, free)
    begin, end = SX.sym("begin", states), SX.sym("end", states)
    speed, later = SX.sym("speed", cable_count), SX.sym("later", cable_count)
    step, theta = SX.sym("step"), SX.sym("theta", parameters)

    def at(share: float, own_states: SX, own_slopes: SX) -> list[SX]:
        state = begin + share * (end - begin)
        inputs = casadi.vertcat(speed + share * (later - speed), SX(3, 1))
        return list(rates(state, own_states, own_slopes, inputs, theta))

    after, moved = z, slopes
    part = step / SUBSTEPS
    for k in range(SUBSTEPS):
        first, middle, last = (k / SUBSTEPS, (k + 0.5) / SUBSTEPS, (k + 1.0) / SUBSTEPS)
        a = at(first, after, moved)
        b = at(middle, after + 0.5 * part * a[0], moved + 0.5 * part * a[1])
        c = at(middle, after + 0.5 * part * b[0], moved + 0.5 * part * b[1])
        d = at(last, after + part * c[0], moved + part * c[1])
        after = after + part / 6.0 * (a[0] + 2.0 * (b[0] + c[0]) + d[0])
        moved = moved + part / 6.0 * (a[1] + 2.0 * (b[1] + c[1]) + d[1])
    return Function("own_step", [z, slopes, begin, end, speed, later, step, theta], [after, moved])
