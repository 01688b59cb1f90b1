"""FMI slave of the winch: a commanded rope speed in, the speed of rope and motor out."""

import math
from typing import Any, Callable, Dict, Sequence, Tuple

from .hermite_quadrature import cubic_hermite
from .laws import winch_drive as law
from .laws.mathematics import REAL
from .model_description import Variable
from .slave import INPUT_TIME, Slave, read_resource

COMMAND, FIRST_OUTPUT, FIRST_STATE, STATE_END = 1, 3, 8, 10
# Longest inner step in time constants of the speed loop.
MAX_INNER_STEP = 0.2
MAX_EVENTS_PER_INNER_STEP = 12
BISECTION_COUNT = 44
MAX_INNER_STEPS = 1_000_000
SpeedCommand = Callable[[float], float]
Margins = Tuple[Any, ...]


class Winch(Slave):
    """Winch: motor, its speed loop with limits, gear and drum."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "winch.json")
        super().__init__(data, _variables(data), slice(FIRST_STATE, STATE_END), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        radius, turns, bandwidth, ratio, speed_limit, acceleration_limit = self.real[self.first_parameter :]
        frequency = 2.0 * math.pi * bandwidth
        self.constants = law.DriveConstants(frequency, ratio, speed_limit, acceleration_limit)
        self.motor_radians_per_metre = turns / radius if radius else math.nan
        self.fastest_rate = frequency * max(1.0, 2.0 * ratio, 0.5 / ratio if ratio else math.inf)

    def advance(self, step: float, inputs_at_end: bool) -> None:
        """Integrate by the classical Runge-Kutta method in inner steps, which end at the state events of the law."""
        command = self._speed_command(step, inputs_at_end)
        state = law.DriveState(*self.real[FIRST_STATE:STATE_END])
        count = max(1, math.ceil(step * self.fastest_rate / MAX_INNER_STEP))
        if count > MAX_INNER_STEPS:
            raise ValueError(f"the speed loop is too fast for this step, it takes {count} inner steps")
        margins = self._margins(command, 0.0, state)
        for k in range(count):
            state, margins = self._step_across_events(command, step * k / count, step * (k + 1) / count, state, margins)
        self.real[FIRST_STATE:STATE_END] = state

    def refresh(self) -> None:
        value, rate = self.real[COMMAND:FIRST_OUTPUT]
        command = value + self.elapsed * rate
        state = law.DriveState(*self.real[FIRST_STATE:STATE_END])
        self.real[FIRST_OUTPUT:FIRST_STATE] = [
            self.motor_radians_per_metre * state.speed,
            law.acceleration(REAL, self.constants, state, command),
            *law.limit_margins(REAL, self.constants, state, command),
        ]

    def _speed_command(self, step: float, inputs_at_end: bool) -> SpeedCommand:
        """Commanded speed as a function of the time since the start of the step."""
        end_command = self.real[COMMAND:FIRST_OUTPUT]
        if not inputs_at_end:
            return lambda elapsed: end_command[0] + elapsed * end_command[1]
        assert self.previous_inputs is not None
        start_command = self.previous_inputs[COMMAND:FIRST_OUTPUT]
        return lambda elapsed: cubic_hermite(start_command, end_command, step, elapsed / step)[0]

    def _step_across_events(
        self, command: SpeedCommand, start: float, end: float, state: law.DriveState, start_margins: Margins
    ) -> Tuple[law.DriveState, Margins]:
        """Integrate from ``start`` to ``end``, one step from event to event; ``start_margins`` hold at the start."""
        for _ in range(MAX_EVENTS_PER_INNER_STEP):
            end_state = self._inner_step(command, start, end, state)
            end_margins = self._margins(command, end, end_state)
            if not _sign_changed(start_margins, end_margins):
                break
            start, state, start_margins = self._locate_event(command, start, end, state, start_margins)
        else:
            end_state = self._inner_step(command, start, end, state)
            end_margins = self._margins(command, end, end_state)
        return end_state, end_margins

    def _locate_event(
        self, command: SpeedCommand, start: float, end: float, state: law.DriveState, start_margins: Margins
    ) -> Tuple[float, law.DriveState, Margins]:
        """Locate the first state event by bisection; returns time, state and margins just after it."""
        low, high = start, end
        for _ in range(BISECTION_COUNT):
            middle = 0.5 * (low + high)
            event_state = self._inner_step(command, start, middle, state)
            if _sign_changed(start_margins, self._margins(command, middle, event_state)):
                high = middle
            else:
                low = middle
        event_state = self._inner_step(command, start, high, state)
        return high, event_state, self._margins(command, high, event_state)

    def _inner_step(self, command: SpeedCommand, start: float, end: float, state: law.DriveState) -> law.DriveState:
        step = end - start
        middle = command(start + 0.5 * step)
        k1 = self._rates(state, command(start))
        k2 = self._rates(_euler_step(state, 0.5 * step, k1), middle)
        k3 = self._rates(_euler_step(state, 0.5 * step, k2), middle)
        k4 = self._rates(_euler_step(state, step, k3), command(end))
        sixth = step / 6.0
        end_state = [s + sixth * (a + 2.0 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4)]
        return law.DriveState(*end_state)

    def _rates(self, state: law.DriveState, command: float) -> law.DriveState:
        return law.state_rates(REAL, self.constants, state, command)

    def _margins(self, command: SpeedCommand, elapsed: float, state: law.DriveState) -> Margins:
        return law.limit_margins(REAL, self.constants, state, command(elapsed))


def _euler_step(state: law.DriveState, step: float, rates: law.DriveState) -> law.DriveState:
    return law.DriveState(state.speed + step * rates.speed, state.integral + step * rates.integral)


def _sign_changed(before: Margins, after: Margins) -> bool:
    """Whether some margin changed its sign: a zero crossing."""
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
    motor_radians_per_metre = float(data["gear"]) / float(data["drum_radius"])
    event_text = "; at a change of sign winch_acceleration has a kink"
    return (
        Variable("motor_speed", "output", "rad/s", "angular speed of the motor", nominal=motor_radians_per_metre),
        Variable("winch_acceleration", "output", "m/s2", "rate of winch_speed", depends_on=command),
        Variable(
            "command_margin", "output", "m/s", f"limit of speed less speed asked for{event_text}", depends_on=command
        ),
        Variable(
            "acceleration_margin",
            "output",
            "m/s2",
            f"limit of acceleration less acceleration asked for{event_text}",
            depends_on=command,
        ),
        Variable(
            "speed_margin",
            "output",
            "m/s",
            f"speed to where another limit bounds the acceleration{event_text}",
            depends_on=command,
        ),
        Variable("winch_speed", "output", "m/s", "rope speed by the winch encoder, positive reels in"),
        Variable("integral", "local", "m/s2", "state: integral part of the speed loop, as acceleration of the rope"),
    )


def _parameters(data: Dict[str, Any]) -> Sequence[Variable]:
    def parameter(name: str, unit: str, description: str, minimum: float = 0.0) -> Variable:
        value = float(data[name])
        return Variable(name, "parameter", unit, description, value, minimum=minimum, nominal=value)

    no_limit_text = f"; {law.NO_LIMIT:g} where there is none"
    return (
        parameter("drum_radius", "m", "radius at which rope lies on the drum"),
        parameter("gear", "1", "turns of the motor for one turn of the drum"),
        parameter("bandwidth", "Hz", "natural frequency of the speed loop"),
        parameter("damping_ratio", "1", "damping ratio of the speed loop"),
        parameter("speed_limit", "m/s", f"largest speed of the rope{no_limit_text}"),
        parameter("acceleration_limit", "m/s2", f"largest acceleration of the rope{no_limit_text}"),
    )
