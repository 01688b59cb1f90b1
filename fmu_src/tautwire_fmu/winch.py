"""The winch as an FMI slave: a commanded rope speed in, the speed of rope and motor out."""

import math
from typing import Any, Callable, Dict, Sequence, Tuple

from .description import Variable
from .interpolation import cubic
from .laws import winch_drive as law
from .laws.mathematics import REAL
from .slave import INPUT_TIME, Slave, read_resource

COMMAND, FIRST_OUTPUT, FIRST_STATE, END_OF_STATE = 1, 3, 8, 10
# Inner steps are at most this long in time constants of the loop.
INNER_STEP = 0.2
MOST_CORNERS = 12
BISECTIONS = 44
MOST_INNER_STEPS = 1_000_000
Command = Callable[[float], float]
Margins = Tuple[Any, ...]


class Winch(Slave):
    """A motor, its speed loop with limits, gear and drum."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "winch.json")
        super().__init__(data, _variables(data), slice(FIRST_STATE, END_OF_STATE), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        radius, turns, bandwidth, ratio, speed_limit, acceleration_limit = self.real[self.first_parameter :]
        frequency = 2.0 * math.pi * bandwidth
        self.constants = law.DriveConstants(frequency, ratio, speed_limit, acceleration_limit)
        self.motor_turn = turns / radius if radius else math.nan
        self.fastest = frequency * max(1.0, 2.0 * ratio, 0.5 / ratio if ratio else math.inf)

    def advance(self, step: float, ends: bool) -> None:
        """The classical Runge-Kutta method in inner steps, cut at the kinks of the law."""
        command = self._commanded(step, ends)
        state = law.DriveState(*self.real[FIRST_STATE:END_OF_STATE])
        count = max(1, math.ceil(step * self.fastest / INNER_STEP))
        if count > MOST_INNER_STEPS:
            raise ValueError(f"the speed loop is too fast for this step, it takes {count} inner steps")
        margins = self._margins(command, 0.0, state)
        for k in range(count):
            state, margins = self._across(command, step * k / count, step * (k + 1) / count, state, margins)
        self.real[FIRST_STATE:END_OF_STATE] = state

    def refresh(self) -> None:
        value, rate = self.real[COMMAND:FIRST_OUTPUT]
        command = value + self.elapsed * rate
        state = law.DriveState(*self.real[FIRST_STATE:END_OF_STATE])
        self.real[FIRST_OUTPUT:FIRST_STATE] = [
            self.motor_turn * state.speed,
            law.acceleration(REAL, self.constants, state, command),
            *law.margins(REAL, self.constants, state, command),
        ]

    def _commanded(self, step: float, ends: bool) -> Command:
        """The command over the step, by the time since its begin."""
        now = self.real[COMMAND:FIRST_OUTPUT]
        if not ends:
            return lambda elapsed: now[0] + elapsed * now[1]
        assert self.earlier is not None
        then = self.earlier[COMMAND:FIRST_OUTPUT]
        return lambda elapsed: cubic(then, now, step, elapsed / step)[0]

    def _across(
        self, command: Command, begin: float, end: float, state: law.DriveState, here: Margins
    ) -> Tuple[law.DriveState, Margins]:
        """From ``begin`` to ``end``, one step from kink to kink; ``here`` are the margins at the begin."""
        for _ in range(MOST_CORNERS):
            ahead = self._inner_step(command, begin, end, state)
            there = self._margins(command, end, ahead)
            if not _changed(here, there):
                break
            begin, state, here = self._to_kink(command, begin, end, state, here)
        else:
            ahead = self._inner_step(command, begin, end, state)
            there = self._margins(command, end, ahead)
        return ahead, there

    def _to_kink(
        self, command: Command, begin: float, end: float, state: law.DriveState, here: Margins
    ) -> Tuple[float, law.DriveState, Margins]:
        """Just beyond the first kink: when, state and margins."""
        low, high = begin, end
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            there = self._inner_step(command, begin, middle, state)
            if _changed(here, self._margins(command, middle, there)):
                high = middle
            else:
                low = middle
        there = self._inner_step(command, begin, high, state)
        return high, there, self._margins(command, high, there)

    def _inner_step(self, command: Command, begin: float, end: float, state: law.DriveState) -> law.DriveState:
        step = end - begin
        middle = command(begin + 0.5 * step)
        k1 = self._rates(state, command(begin))
        k2 = self._rates(_moved(state, 0.5 * step, k1), middle)
        k3 = self._rates(_moved(state, 0.5 * step, k2), middle)
        k4 = self._rates(_moved(state, step, k3), command(end))
        sixth = step / 6.0
        moved = [s + sixth * (a + 2.0 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4)]
        return law.DriveState(*moved)

    def _rates(self, state: law.DriveState, command: float) -> law.DriveState:
        return law.state_rates(REAL, self.constants, state, command)

    def _margins(self, command: Command, elapsed: float, state: law.DriveState) -> Margins:
        return law.margins(REAL, self.constants, state, command(elapsed))


def _moved(state: law.DriveState, step: float, rates: law.DriveState) -> law.DriveState:
    return law.DriveState(state.speed + step * rates.speed, state.integral + step * rates.integral)


def _changed(before: Margins, after: Margins) -> bool:
    """Whether some margin has another sign."""
    return any((a > 0.0) != (b > 0.0) for a, b in zip(before, after))


def _variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    return (*_inputs(), *_outputs(data), *_parameters(data))


def _inputs() -> Sequence[Variable]:
    return (
        INPUT_TIME,
        Variable("speed_command", "input", "m/s", "rope speed asked for, positive reels in"),
        Variable("speed_command_rate", "input", "m/s2", "rate of speed_command"),
    )


def _outputs(data: Dict[str, Any]) -> Sequence[Variable]:
    command = ("speed_command",)
    turns = float(data["gear"]) / float(data["drum_radius"])
    kink = "; at a change of sign winch_acceleration has a kink"
    return (
        Variable("motor_speed", "output", "rad/s", "angular speed of the motor", nominal=turns),
        Variable("winch_acceleration", "output", "m/s2", "rate of winch_speed", depends_on=command),
        Variable("command_margin", "output", "m/s", f"limit of speed less speed asked for{kink}", depends_on=command),
        Variable(
            "acceleration_margin",
            "output",
            "m/s2",
            f"limit of acceleration less acceleration asked for{kink}",
            depends_on=command,
        ),
        Variable("speed_margin", "output", "m/s", f"speed to where another limit bounds the acceleration{kink}"),
        Variable("winch_speed", "output", "m/s", "rope speed by the winch encoder, positive reels in"),
        Variable("integral", "local", "m/s2", "state: integral part of the speed loop, as acceleration of the rope"),
    )


def _parameters(data: Dict[str, Any]) -> Sequence[Variable]:
    def parameter(name: str, unit: str, description: str, minimum: float = 0.0) -> Variable:
        value = float(data[name])
        return Variable(name, "parameter", unit, description, value, minimum=minimum, nominal=value)

    none = f"; {law.NO_LIMIT:g} where there is none"
    return (
        parameter("drum_radius", "m", "radius at which rope lies on the drum"),
        parameter("gear", "1", "turns of the motor for one turn of the drum"),
        parameter("bandwidth", "Hz", "natural frequency of the speed loop"),
        parameter("damping_ratio", "1", "damping ratio of the speed loop"),
        parameter("speed_limit", "m/s", f"largest speed of the rope{none}"),
        parameter("acceleration_limit", "m/s2", f"largest acceleration of the rope{none}"),
    )
