"""The cable as an FMI slave: the platform's motion and the winch speed in, tension and force out."""

from typing import Any, Dict, List, Sequence, Tuple

from .cable_variables import cable_variables
from .interpolation import cubic, extrapolate, quintic
from .laws import cable as law
from .laws.effects import BY_NAME
from .laws.mathematics import COMPLEX_STEP, REAL, along, rate_of
from .laws.vectors import norm, subtract
from .slave import Slave, active_effects, read_resource

POSITION, VELOCITY, ACCELERATION, WINCH_SPEED, WINCH_ACCELERATION = 1, 4, 7, 10, 11
FIRST_OUTPUT = 12
FIRST_RATE = 20
FIRST_STATE = 24
Motion = Tuple[Sequence[float], Sequence[float], float]


class Cable(Slave):
    """One cable with its tension law, its effects and its winch's rope speed."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "cable.json")
        self.settings: List[Dict[str, Any]] = data["effects"]
        self.tension_law = law.LAWS[data["law"]]
        self.end_of_state = FIRST_STATE + 2 + sum(len(BY_NAME[s["name"]].states) for s in self.settings)
        super().__init__(data, cable_variables(data), slice(FIRST_STATE, self.end_of_state), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        numbers = self.real[self.first_parameter :]
        anchor, start = tuple(numbers[0:3]), tuple(numbers[3:6])
        modulus, area, damping, start_tension = numbers[6:10]
        self.effects = active_effects(self.settings, numbers[10:])
        self.constants = law.CableConstants(
            law=self.tension_law,
            anchor=anchor,
            modulus=modulus,
            area=area,
            damping=damping,
            start_length=norm(REAL, subtract(anchor, start)),
            start_tension=start_tension,
        )
        if not self.started:
            state = law.start_state(self.constants, self.effects)
            self.real[FIRST_STATE : self.end_of_state] = _flat(state)

    def advance(self, step: float, ends: bool) -> None:
        """The classical Runge-Kutta method on the state, under inputs that move on polynomials."""
        start = law.CableInputs(*self._at_start(ends))
        middle = law.CableInputs(*self._moved(step, 0.5, ends))
        end = law.CableInputs(*self._moved(step, 1.0, ends))
        first, half, last = (law.span(REAL, self.constants, inputs) for inputs in (start, middle, end))
        state = self.real[FIRST_STATE : self.end_of_state]
        k1 = self._rates(state, first, start.winch_speed)
        k2 = self._rates([s + 0.5 * step * k for s, k in zip(state, k1)], half, middle.winch_speed)
        k3 = self._rates([s + 0.5 * step * k for s, k in zip(state, k2)], half, middle.winch_speed)
        k4 = self._rates([s + step * k for s, k in zip(state, k3)], last, end.winch_speed)
        sixth = step / 6.0
        self.real[FIRST_STATE : self.end_of_state] = [
            s + sixth * (a + 2.0 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4)
        ]

    def refresh(self) -> None:
        """One complex step gives the outputs and their rates."""
        real = self.real
        position, velocity, speed = self._moved(self.elapsed, 1.0, False)
        numbers = real[FIRST_STATE : self.end_of_state]
        line = law.span(REAL, self.constants, law.CableInputs(position, velocity, speed))
        rates = self._rates(numbers, line, speed)
        carried = law.CableInputs(
            tuple(map(along, position, velocity)),
            tuple(map(along, velocity, real[ACCELERATION:WINCH_SPEED])),
            along(speed, real[WINCH_ACCELERATION]),
        )
        state = self._state(list(map(along, numbers, rates)))
        moving = law.motion(
            COMPLEX_STEP,
            self.constants,
            self.effects,
            state,
            law.span(COMPLEX_STEP, self.constants, carried),
            carried.winch_speed,
        )
        shown = law.reading(COMPLEX_STEP, self.constants, self.effects, state, moving)
        values = (*shown.force, shown.tension, shown.length, shown.elongation, shown.strain, shown.pull)
        real[FIRST_OUTPUT:FIRST_RATE] = [complex(value).real for value in values]
        real[FIRST_RATE:FIRST_STATE] = [*map(rate_of, shown.force), rate_of(shown.tension)]

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
        inputs = self.earlier if ends and self.earlier is not None else self.real
        return inputs[POSITION:VELOCITY], inputs[VELOCITY:ACCELERATION], inputs[WINCH_SPEED]

    def _moved(self, step: float, fraction: float, ends: bool) -> Motion:
        """Position, velocity and winch speed after a fraction of a step."""
        real = self.real
        if ends and fraction == 1.0:
            return real[POSITION:VELOCITY], real[VELOCITY:ACCELERATION], real[WINCH_SPEED]
        if ends:
            return self._between(step, fraction)
        s = step * fraction
        x0, x1, x2, v0, v1, v2, a0, a1, a2, speed, rate = real[POSITION:FIRST_OUTPUT]
        return (
            (extrapolate(x0, v0, a0, s), extrapolate(x1, v1, a1, s), extrapolate(x2, v2, a2, s)),
            (v0 + s * a0, v1 + s * a1, v2 + s * a2),
            speed + s * rate,
        )

    def _between(self, step: float, fraction: float) -> Motion:
        now, then = self.real, self.earlier
        assert then is not None
        path = [
            quintic(
                (then[axis], then[axis + 3], then[axis + 6]),
                (now[axis], now[axis + 3], now[axis + 6]),
                step,
                fraction,
            )
            for axis in range(POSITION, VELOCITY)
        ]
        speed = cubic(
            then[WINCH_SPEED],
            then[WINCH_ACCELERATION],
            now[WINCH_SPEED],
            now[WINCH_ACCELERATION],
            step,
            fraction,
        )
        return [p[0] for p in path], [p[1] for p in path], speed


def _flat(state: law.CableState) -> List[float]:
    if not state.effects:
        return [state.unstrained_length, state.wound_length]
    return [state.unstrained_length, state.wound_length, *(s for own in state.effects for s in own)]
