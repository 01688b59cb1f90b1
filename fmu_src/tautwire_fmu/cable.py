"""The cable as an FMI slave: the platform's motion and the winch speed in, tension and force out."""

from typing import Any, List, NamedTuple, Optional, Sequence, Tuple

from .acting import active_effects, effects_of
from .cable_variables import cable_variables
from .inner_steps import integrate
from .interpolation import cubic, extrapolate, quintic
from .laws import cable as law
from .laws import stages
from .laws.mathematics import COMPLEX_STEP, REAL, all_along, along, rate_of, rates_of, vector_along
from .past import Seen, remember, seen
from .slave import Slave, read_resource

POSITION, VELOCITY, ACCELERATION, WINCH_SPEED, WINCH_ACCELERATION, MIDDLE = 2, 5, 8, 11, 12, 13
FIRST_OUTPUT = 22
TENSION = 25
FIRST_RATE = 30
TENSION_RATE = 33
MIDDLE_FORCE = 34
FIRST_STATE = 40
# m: what of a length is felt, for the inner steps.
LENGTH_SCALE = 1e-3


class Motion(NamedTuple):
    """What acts on a cable at an instant, with its rates."""

    position: Sequence[float]
    velocity: Sequence[float]
    acceleration: Sequence[float]
    winch_speed: float
    winch_acceleration: float


class Cable(Slave):
    """One cable with its tension law, its effects and its winch's rope speed."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "cable.json")
        self.acting = effects_of(data)
        self.tension_law = law.LAWS[data["law"]]
        self.end_of_state = FIRST_STATE + 2 + sum(len(effect.states) for effect in self.acting)
        own = (state.scale for effect in self.acting for state in effect.states)
        self.scales = (LENGTH_SCALE, LENGTH_SCALE, *own)
        self.end_line: Optional[law.Span] = None
        # Of the inputs at a step's start, from which redos begin too.
        self.begun: Tuple[Optional[Sequence[float]], float] = (None, 0.0)
        super().__init__(data, cable_variables(data), slice(FIRST_STATE, self.end_of_state), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        self.begun = (None, 0.0)
        numbers = self.real[self.first_parameter :]
        anchor, start = tuple(numbers[0:3]), tuple(numbers[3:6])
        modulus, area, damping, start_tension, gravity = numbers[6:11]
        self.effects = active_effects(self.acting, numbers[11:])
        self.lag = stages.delays(REAL, self.effects)[0]
        line = stages.route(REAL, self.effects, anchor, start)
        declared = law.CableConstants(
            law=self.tension_law,
            anchor=anchor,
            modulus=modulus,
            area=area,
            damping=damping,
            start_length=line.length,
            start_tension=start_tension,
            start_direction=line.direction,
            gravity=gravity,
        )
        self.constants, self.effects = law.simplified(REAL, declared, self.effects)
        if not self.started:
            state = law.start_state(self.constants, self.effects)
            self.real[FIRST_STATE : self.end_of_state] = _flat(state)

    def advance(self, step: float, ends: bool) -> None:
        """The state under inputs that move on polynomials, and what the cable shows in the middle of the step."""
        state = self.real[FIRST_STATE : self.end_of_state]
        middle = self._moved(step, 0.5, ends)
        if not self.effects:
            half = self._carried_line(middle)
            between, after = self._without_effects(state, step, ends, middle, half)
            shown = self._show_without_effects(between, middle.winch_speed, middle.winch_acceleration, half)
        else:
            line = self._line(middle)
            if len(state) == 2:
                between, after = self._in_one_step(state, step, ends, middle, line)
            else:
                between, after = self._in_inner_steps(state, step, ends)
            shown = self._show(between, middle, line)
        if self.lag > 0.0:
            self._remember(step, ends, state, shown, after)
        self.real[MIDDLE_FORCE:FIRST_STATE] = _values_and_rates(shown.force)
        self.real[FIRST_STATE : self.end_of_state] = after

    def _without_effects(
        self, state: List[float], step: float, ends: bool, middle: Motion, half: law.Span
    ) -> Tuple[List[float], List[float]]:
        """As :meth:`_in_one_step`, where the rope is straight and follows the winch."""
        end = self._moved(step, 1.0, ends)
        self.end_line = last = self._carried_line(end)
        slope, sixth, (unstrained, wound) = self.tension_law.unstrained_length_rate, step / 6.0, state
        begin, there, away = self._speed_at_start(ends), middle.winch_speed, end.winch_speed
        k1 = slope(REAL, begin, self._length_at_start(ends), unstrained)
        k2 = slope(REAL, there, half.length.real, unstrained + 0.5 * step * k1)
        k3 = slope(REAL, there, half.length.real, unstrained + 0.5 * step * k2)
        k4 = slope(REAL, away, last.length.real, unstrained + step * k3)
        reeled = unstrained + sixth * (k1 + 2.0 * (k2 + k3) + k4)
        turned = wound + sixth * (begin + 2.0 * (there + there) + away)
        eighth = 0.125 * step
        between = [
            0.5 * (unstrained + reeled) + eighth * (k1 - k4),
            0.5 * (wound + turned) + eighth * (begin - away),
        ]
        return between, [reeled, turned]

    def _in_one_step(
        self, state: List[float], step: float, ends: bool, middle: Motion, half: law.Span
    ) -> Tuple[List[float], List[float]]:
        """Middle and end by the classical Runge-Kutta method."""
        start, end = self._at_start(ends), self._moved(step, 1.0, ends)
        first, last = self._line(start), self._line(end)
        k1 = self._rates(state, first, start.winch_speed)
        k2 = self._rates([s + 0.5 * step * k for s, k in zip(state, k1)], half, middle.winch_speed)
        k3 = self._rates([s + 0.5 * step * k for s, k in zip(state, k2)], half, middle.winch_speed)
        k4 = self._rates([s + step * k for s, k in zip(state, k3)], last, end.winch_speed)
        sixth = step / 6.0
        after = [s + sixth * (a + 2.0 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4)]
        return [0.5 * (s + e) + 0.125 * step * (a - d) for s, e, a, d in zip(state, after, k1, k4)], after

    def _in_inner_steps(self, state: List[float], step: float, ends: bool) -> Tuple[List[float], List[float]]:
        """Middle and end, where effects have states of their own."""
        start = self._at_start(ends)

        def rates(fraction: float, numbers: List[float]) -> List[float]:
            now = start if fraction == 0.0 else self._moved(step, fraction, ends)
            return self._rates(numbers, self._line(now), now.winch_speed)

        return integrate(rates, state, self.scales, step)

    def _remember(
        self, step: float, ends: bool, begun: List[float], middle: law.CableReading, after: List[float]
    ) -> None:
        """Keep the tension of this step for the load cell, which lags."""
        start, end = self._at_start(ends), self._moved(step, 1.0, ends)
        first = self._show(begun, start, self._line(start))
        last = self._show(after, end, self._line(end))
        past = self.pasts[0] if self.pasts else ()
        readings = zip((0.0, 0.5, 1.0), (first, middle, last))
        told = [Seen(self.time + f * step, _value_and_rate(shown.tension)) for f, shown in readings]
        self.pasts = (remember(remember(past, told[0], told[1], self.lag), told[1], told[2], self.lag),)

    def refresh(self) -> None:
        real = self.real
        shown = self._show_now(real[FIRST_STATE : self.end_of_state])
        values = (*shown.force, shown.tension, shown.length, shown.elongation, shown.strain, shown.pull)
        real[FIRST_OUTPUT:FIRST_RATE] = [value.real for value in values]
        real[FIRST_RATE:MIDDLE_FORCE] = (*rates_of(shown.force), rate_of(shown.tension))
        if self.lag > 0.0 and self.pasts:
            real[TENSION], real[TENSION_RATE] = seen(self.pasts[0], self.lag)
        if not self.started:
            real[MIDDLE_FORCE:FIRST_STATE] = _values_and_rates(shown.force)

    def _show(self, numbers: List[float], now: Motion, line: law.Span) -> law.CableReading:
        """One complex step gives the outputs and their rates."""
        rates = self._rates(numbers, line, now.winch_speed)
        carried = law.CableInputs(
            vector_along(now.position, now.velocity),
            vector_along(now.velocity, now.acceleration),
            along(now.winch_speed, now.winch_acceleration),
        )
        state = self._state(all_along(numbers, rates))
        moving = law.motion(
            COMPLEX_STEP,
            self.constants,
            self.effects,
            state,
            law.span(COMPLEX_STEP, self.constants, carried, self.effects),
            carried.winch_speed,
        )
        return law.reading(COMPLEX_STEP, self.constants, self.effects, state, moving)

    def _show_now(self, numbers: List[float]) -> law.CableReading:
        if self.effects:
            now = self._moved(self.elapsed, 1.0, False)
            return self._show(numbers, now, self._line(now))
        line = self.end_line if self.untouched else None
        if line is None:
            line = self._carried_line(self._moved(self.elapsed, 1.0, False))
        rate = self.real[WINCH_ACCELERATION]
        return self._show_without_effects(numbers, self.real[WINCH_SPEED] + self.elapsed * rate, rate, line)

    def _show_without_effects(
        self, numbers: List[float], speed: float, rate: float, line: law.Span
    ) -> law.CableReading:
        """As :meth:`_show`, on a line that carries its rates and with the winch's speed and its rate."""
        unstrained, wound = numbers
        slope = self.tension_law.unstrained_length_rate(REAL, speed, line.length.real, unstrained)
        state = law.CableState(along(unstrained, slope), along(wound, speed), ())
        moving = law.motion(COMPLEX_STEP, self.constants, (), state, line, along(speed, rate))
        return law.reading(COMPLEX_STEP, self.constants, (), state, moving)

    def _carried_line(self, now: Motion) -> law.Span:
        """Without effects, numbers that carry their rates."""
        place, motion = vector_along(now.position, now.velocity), vector_along(now.velocity, now.acceleration)
        return law.span(COMPLEX_STEP, self.constants, law.CableInputs(place, motion, 0.0))

    def _line(self, now: Motion) -> law.Span:
        inputs = law.CableInputs(now.position, now.velocity, now.winch_speed)
        return law.span(REAL, self.constants, inputs, self.effects)

    def _rates(self, numbers: List[float], line: law.Span, winch_speed: float) -> List[float]:
        state = self._state(numbers)
        moving = law.motion(REAL, self.constants, self.effects, state, line, winch_speed)
        return _flat(law.state_rates(REAL, self.constants, self.effects, state, moving))

    def _state(self, numbers: List[Any]) -> law.CableState:
        if not self.effects:
            return law.CableState(numbers[0], numbers[1], ())
        own = []
        first = 2
        for active in self.effects:
            count = len(active.effect.states)
            own.append(tuple(numbers[first : first + count]))
            first += count
        return law.CableState(numbers[0], numbers[1], tuple(own))

    def _at_start(self, ends: bool) -> Motion:
        return _motion(self._inputs_at_start(ends))

    def _inputs_at_start(self, ends: bool) -> Sequence[float]:
        return self.earlier if ends and self.earlier is not None else self.real

    def _speed_at_start(self, ends: bool) -> float:
        return self._inputs_at_start(ends)[WINCH_SPEED]

    def _length_at_start(self, ends: bool) -> float:
        """Without effects."""
        inputs = self._inputs_at_start(ends)
        if inputs is self.real or inputs != self.begun[0]:
            start = _motion(inputs)
            line = law.span(REAL, self.constants, law.CableInputs(start.position, start.velocity, start.winch_speed))
            self.begun = (inputs if ends else None, line.length)
        return self.begun[1]

    def _moved(self, step: float, fraction: float, ends: bool) -> Motion:
        """What acts on the cable after a fraction of a step."""
        if ends and fraction == 1.0:
            return _motion(self.real)
        if ends:
            return self._between(step, fraction)
        s = step * fraction
        x0, x1, x2, v0, v1, v2, a0, a1, a2, speed, rate = self.real[POSITION:MIDDLE]
        return Motion(
            (extrapolate(x0, v0, a0, s), extrapolate(x1, v1, a1, s), extrapolate(x2, v2, a2, s)),
            (v0 + s * a0, v1 + s * a1, v2 + s * a2),
            (a0, a1, a2),
            speed + s * rate,
            rate,
        )

    def _between(self, step: float, fraction: float) -> Motion:
        now, then = self.real, self.earlier
        assert then is not None
        speed, rate = cubic(then[WINCH_SPEED:MIDDLE], now[WINCH_SPEED:MIDDLE], step, fraction)
        if self.middle_given and fraction == 0.5:
            return Motion(
                now[MIDDLE : MIDDLE + 3], now[MIDDLE + 3 : MIDDLE + 6], now[MIDDLE + 6 : FIRST_OUTPUT], speed, rate
            )
        path = [
            quintic(then[axis:WINCH_SPEED:3], now[axis:WINCH_SPEED:3], step, fraction)
            for axis in range(POSITION, VELOCITY)
        ]
        position, velocity, acceleration = zip(*path)
        return Motion(position, velocity, acceleration, speed, rate)


def _motion(inputs: Sequence[float]) -> Motion:
    return Motion(
        inputs[POSITION:VELOCITY],
        inputs[VELOCITY:ACCELERATION],
        inputs[ACCELERATION:WINCH_SPEED],
        inputs[WINCH_SPEED],
        inputs[WINCH_ACCELERATION],
    )


def _values_and_rates(vector: Sequence[complex]) -> Tuple[float, ...]:
    x, y, z = vector
    return (x.real, y.real, z.real, *rates_of(vector))


def _value_and_rate(number: complex) -> Tuple[float, float]:
    return complex(number).real, rate_of(number)


def _flat(state: law.CableState) -> List[float]:
    if not state.effects:
        return [state.unstrained_length, state.wound_length]
    return [state.unstrained_length, state.wound_length, *(s for own in state.effects for s in own)]
