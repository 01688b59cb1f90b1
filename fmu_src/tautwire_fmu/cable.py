"""The cable as an FMI slave: the platform's motion and the winch speed in, tension and force out."""

from typing import Any, Dict, List, Tuple

from .description import Variable, axes, vector
from .interpolation import cubic, extrapolate, quintic
from .laws import cable as law
from .laws.effects import BY_NAME
from .laws.mathematics import COMPLEX_STEP, REAL, along, rate_of
from .laws.vectors import norm, subtract
from .slave import INPUT_TIME, Slave, active_effects, effect_variables, read_resource

POSITION, VELOCITY, ACCELERATION, WINCH_SPEED, WINCH_ACCELERATION = 1, 4, 7, 10, 11
FIRST_OUTPUT = 12
FIRST_RATE = 19
FIRST_STATE = 23
MOTION = axes("position", "velocity")


class Cable(Slave):
    """One cable with its tension law, its effects and its winch's rope speed."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "cable.json")
        self.settings: List[Dict[str, Any]] = data["effects"]
        self.tension_law = law.LAWS[data["law"]]
        self.state_count = 2 + sum(len(BY_NAME[s["name"]].states) for s in self.settings)
        super().__init__(_variables(data), **kwargs)
        self.modelName = data["model_name"]
        self.description = data["description"]
        self.guid = data["guid"]
        self.rates_stale = True
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
            self.real[FIRST_STATE : FIRST_STATE + self.state_count] = _flat(state)

    def advance(self, step: float, ends: bool) -> None:
        """The classical Runge-Kutta method on the state, under inputs that move on polynomials."""
        state = self.real[FIRST_STATE : FIRST_STATE + self.state_count]
        at_start = self._inputs(step, 0.0, ends)
        at_middle = self._inputs(step, 0.5, ends)
        at_end = self._inputs(step, 1.0, ends)
        k1 = self._rates(state, at_start)
        k2 = self._rates([s + 0.5 * step * k for s, k in zip(state, k1)], at_middle)
        k3 = self._rates([s + 0.5 * step * k for s, k in zip(state, k2)], at_middle)
        k4 = self._rates([s + step * k for s, k in zip(state, k3)], at_end)
        self.real[FIRST_STATE : FIRST_STATE + self.state_count] = [
            s + step / 6.0 * (a + 2.0 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4)
        ]

    def refresh(self) -> None:
        inputs = self._inputs(self.elapsed, 1.0, False)
        state = self._state(self.real[FIRST_STATE : FIRST_STATE + self.state_count])
        moving = law.motion(REAL, self.constants, self.effects, state, inputs)
        shown = law.reading(REAL, self.constants, self.effects, state, moving)
        self.real[FIRST_OUTPUT:FIRST_RATE] = [
            *shown.force,
            shown.tension,
            shown.length,
            shown.elongation,
            shown.strain,
        ]
        self.rates_stale = True

    def get_real(self, vrs: Any) -> List[float]:
        if (self.stale or self.rates_stale) and any(FIRST_RATE <= reference < FIRST_STATE for reference in vrs):
            super().get_real(vrs)
            self.attempt(self._refresh_rates)
            self.rates_stale = False
        return super().get_real(vrs)

    def _refresh_rates(self) -> None:
        inputs = self._inputs(self.elapsed, 1.0, False)
        numbers = self.real[FIRST_STATE : FIRST_STATE + self.state_count]
        rates = self._rates(numbers, inputs)
        acceleration = self.real[ACCELERATION : ACCELERATION + 3]
        carried = law.CableInputs(
            tuple(map(along, inputs.position, inputs.velocity)),
            tuple(map(along, inputs.velocity, acceleration)),
            along(inputs.winch_speed, self.real[WINCH_ACCELERATION]),
        )
        state = self._state(list(map(along, numbers, rates)))
        moving = law.motion(COMPLEX_STEP, self.constants, self.effects, state, carried)
        shown = law.reading(COMPLEX_STEP, self.constants, self.effects, state, moving)
        self.real[FIRST_RATE:FIRST_STATE] = [*map(rate_of, shown.force), rate_of(shown.tension)]

    def _rates(self, numbers: List[float], inputs: law.CableInputs) -> List[float]:
        state = self._state(numbers)
        moving = law.motion(REAL, self.constants, self.effects, state, inputs)
        return _flat(law.state_rates(REAL, self.constants, self.effects, state, moving))

    def _state(self, numbers: List[Any]) -> law.CableState:
        own = []
        first = 2
        for active in self.effects:
            count = len(active.effect.states)
            own.append(tuple(numbers[first : first + count]))
            first += count
        return law.CableState(numbers[0], numbers[1], tuple(own))

    def _inputs(self, step: float, fraction: float, ends: bool) -> law.CableInputs:
        if ends:
            return self._inputs_between(step, fraction)
        real = self.real
        s = step * fraction
        position, velocity, acceleration = real[1:4], real[4:7], real[7:10]
        return law.CableInputs(
            tuple(extrapolate(x, v, a, s) for x, v, a in zip(position, velocity, acceleration)),
            tuple(v + s * a for v, a in zip(velocity, acceleration)),
            real[WINCH_SPEED] + s * real[WINCH_ACCELERATION],
        )

    def _inputs_between(self, step: float, fraction: float) -> law.CableInputs:
        now = self.real
        then = self.earlier
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
        return law.CableInputs(tuple(p[0] for p in path), tuple(p[1] for p in path), speed)


def _flat(state: law.CableState) -> List[float]:
    return [state.unstrained_length, state.wound_length, *(s for own in state.effects for s in own)]


def _variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    start = tuple(data["start"])
    tension = float(data["start_tension"])
    length = float(data["start_length"])
    rated = (*MOTION, *axes("acceleration"), "winch_speed", "winch_acceleration")
    return (
        INPUT_TIME,
        *vector("position", "input", "m", "position of the platform", start, nominal=length),
        *vector("velocity", "input", "m/s", "velocity of the platform, the rate of position"),
        *vector("acceleration", "input", "m/s2", "acceleration of the platform, the rate of velocity"),
        Variable("winch_speed", "input", "m/s", "rope speed by the winch encoder, positive reels in"),
        Variable("winch_acceleration", "input", "m/s2", "rate of winch_speed"),
        *vector(
            "force",
            "output",
            "N",
            "force on the platform",
            nominal=tension,
            depends_on=(*MOTION, "winch_speed"),
        ),
        Variable(
            "tension",
            "output",
            "N",
            "tension at the load cell, between winch and exit point",
            minimum=0.0,
            nominal=tension,
            depends_on=(*MOTION, "winch_speed"),
        ),
        Variable(
            "length",
            "output",
            "m",
            "distance from exit point to platform",
            nominal=length,
            depends_on=axes("position"),
        ),
        Variable(
            "elongation",
            "output",
            "m",
            "length less start length and rope let out",
            depends_on=axes("position"),
        ),
        Variable("strain", "output", "1", "strain by the tension law", nominal=1e-3, depends_on=axes("position")),
        *vector("force_rate", "output", "N/s", "rate of force", nominal=tension, depends_on=rated),
        Variable("tension_rate", "output", "N/s", "rate of tension", nominal=tension, depends_on=rated),
        Variable("unstrained_length", "local", "m", "state: rope in the span if it were unloaded", nominal=length),
        Variable("wound_length", "local", "m", "state: rope reeled in since the start", nominal=length),
        *(
            Variable(f"effect.{s['name']}.{state.name}", "local", state.unit, f"state: {state.description}")
            for s in data["effects"]
            for state in BY_NAME[s["name"]].states
        ),
        *vector("anchor", "parameter", "m", "exit point on the frame", tuple(data["anchor"])),
        *vector("start", "parameter", "m", "position of the platform at the start, in static equilibrium", start),
        Variable("modulus", "parameter", "Pa", "modulus of elasticity", data["modulus"], True, 0.0, nominal=1e11),
        Variable(
            "area",
            "parameter",
            "m2",
            "area that the modulus refers to",
            data["area"],
            True,
            0.0,
            nominal=1e-5,
        ),
        Variable("damping", "parameter", "Pa s", "viscosity of the rope", data["damping"], True, 0.0, nominal=1e9),
        Variable("start_tension", "parameter", "N", "tension at the start", tension, False, 0.0, nominal=1e3),
        *effect_variables(data["effects"]),
    )
