"""FMI slave of a cable: the platform's motion and the winch speed in, tension and force out."""

from typing import Any, List, NamedTuple, Optional, Sequence, Tuple

from .cable_variables import cable_variables
from .delay_line import SignalSample, append_segment, delayed_value
from .dormand_prince import (
    MAX_RELATIVE_TOLERANCE,
    MIN_RELATIVE_TOLERANCE,
    RELATIVE_TOLERANCE,
    integrate_dormand_prince,
)
from .effect_variables import active_effects, effects_from_resource
from .hermite_quadrature import cubic_hermite, quintic_hermite, taylor_extrapolate
from .laws import cable as law
from .laws import effect_stages as stages
from .laws.mathematics import COMPLEX_STEP, REAL, all_with_rates, rate_of, rates_of, vector_with_rates, with_rate
from .slave import Slave, read_resource

POSITION, VELOCITY, ACCELERATION, WINCH_SPEED, WINCH_ACCELERATION, FIRST_MIDDLE_INPUT = 2, 5, 8, 11, 12, 13
FIRST_OUTPUT = 22
TENSION = 25
FIRST_RATE = 30
TENSION_RATE = 33
MIDDLE_FORCE = 34
FIRST_STATE = 40
# m: error scale of a length in the adaptive integration.
LENGTH_SCALE = 1e-3


class AppliedMotion(NamedTuple):
    """Motion of the platform end and the winch at an instant, with its rates."""

    position: Sequence[float]
    velocity: Sequence[float]
    acceleration: Sequence[float]
    winch_speed: float
    winch_acceleration: float


class Cable(Slave):
    """One cable: tension law, effects, and the rope speed of its winch."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "cable.json")
        self.listed_effects = effects_from_resource(data)
        self.tension_law = law.LAWS[data["law"]]
        self.swivel_axis = tuple(data["swivel_axis"])
        self.state_end = FIRST_STATE + 2 + sum(len(effect.states) for effect in self.listed_effects)
        effect_scales = (state.scale for effect in self.listed_effects for state in effect.states)
        self.scales = (LENGTH_SCALE, LENGTH_SCALE, *effect_scales)
        self.relative_tolerance = RELATIVE_TOLERANCE
        self.end_span: Optional[law.Span] = None
        # Keyed by the inputs at the start of a step, from which iterations after a rollback start too.
        self.start_length_cache: Tuple[Optional[Sequence[float]], float] = (None, 0.0)
        super().__init__(data, cable_variables(data), slice(FIRST_STATE, self.state_end), **kwargs)
        self.parameters_changed()

    def setup_experiment(self, start_time: float, stop_time: Optional[float], tolerance: Optional[float]) -> None:
        """Take the experiment's relative tolerance for the adaptive integration of effects' states."""
        if tolerance is not None and tolerance > 0.0:
            self.relative_tolerance = min(max(tolerance, MIN_RELATIVE_TOLERANCE), MAX_RELATIVE_TOLERANCE)

    def parameters_changed(self) -> None:
        self.start_length_cache = (None, 0.0)
        parameter_values = self.real[self.first_parameter :]
        anchor, start = tuple(parameter_values[0:3]), tuple(parameter_values[3:6])
        modulus, area, damping, start_tension, gravity = parameter_values[6:11]
        self.effects = active_effects(self.listed_effects, parameter_values[11:])
        self.tension_delay = stages.sensor_delays(REAL, self.effects)[0]
        start_route = stages.route(REAL, self.effects, anchor, start, self.swivel_axis)
        declared_constants = law.CableConstants(
            law=self.tension_law,
            anchor=anchor,
            modulus=modulus,
            area=area,
            damping=damping,
            start_length=start_route.length,
            start_tension=start_tension,
            start_direction=start_route.direction,
            gravity=gravity,
            swivel_axis=self.swivel_axis,
        )
        declared_constants = law.with_start_cell_tension(REAL, declared_constants, self.effects, start_route.chord)
        self.constants, self.effects = law.fold_constant_effects(REAL, declared_constants, self.effects)
        self.moves_states = stages.moves_states(REAL, self.effects) > 0.0
        if not self.started:
            state = law.start_state(self.constants, self.effects)
            self.real[FIRST_STATE : self.state_end] = _flat_state(state)

    def advance(self, step: float, inputs_at_end: bool) -> None:
        """Integrate the state under inputs on Hermite polynomials; compute the outputs in the middle of the step."""
        state = self.real[FIRST_STATE : self.state_end]
        middle_motion = self._motion_at(step, 0.5, inputs_at_end)
        if not self.effects:
            middle_span = self._span_with_rates(middle_motion)
            middle_state, end_state = self._step_without_effects(state, step, inputs_at_end, middle_motion, middle_span)
            middle_outputs = self._outputs_without_effects(
                middle_state, middle_motion.winch_speed, middle_motion.winch_acceleration, middle_span
            )
        else:
            line = self._span(middle_motion)
            if not self.moves_states:
                middle_state, end_state = self._runge_kutta_step(state, step, inputs_at_end, middle_motion, line)
            else:
                middle_state, end_state = self._adaptive_step(state, step, inputs_at_end)
            middle_outputs = self._outputs_with_rates(middle_state, middle_motion, line)
        if self.tension_delay > 0.0:
            self._record_tension(step, inputs_at_end, state, middle_outputs, end_state)
        self.real[MIDDLE_FORCE:FIRST_STATE] = _values_and_rates(middle_outputs.force)
        self.real[FIRST_STATE : self.state_end] = end_state

    def _step_without_effects(
        self, state: List[float], step: float, inputs_at_end: bool, middle: AppliedMotion, middle_span: law.Span
    ) -> Tuple[List[float], List[float]]:
        """As :meth:`_runge_kutta_step`, for a straight rope that follows the winch."""
        end = self._motion_at(step, 1.0, inputs_at_end)
        self.end_span = end_span = self._span_with_rates(end)
        slope, sixth, (unstrained, wound) = self.tension_law.unstrained_length_rate, step / 6.0, state
        start_speed, middle_speed, end_speed = self._speed_at_start(inputs_at_end), middle.winch_speed, end.winch_speed
        k1 = slope(REAL, start_speed, self._length_at_start(inputs_at_end), unstrained)
        k2 = slope(REAL, middle_speed, middle_span.length.real, unstrained + 0.5 * step * k1)
        k3 = slope(REAL, middle_speed, middle_span.length.real, unstrained + 0.5 * step * k2)
        k4 = slope(REAL, end_speed, end_span.length.real, unstrained + step * k3)
        end_unstrained = unstrained + sixth * (k1 + 2.0 * (k2 + k3) + k4)
        end_wound = wound + sixth * (start_speed + 2.0 * (middle_speed + middle_speed) + end_speed)
        eighth = 0.125 * step
        middle_state = [
            0.5 * (unstrained + end_unstrained) + eighth * (k1 - k4),
            0.5 * (wound + end_wound) + eighth * (start_speed - end_speed),
        ]
        return middle_state, [end_unstrained, end_wound]

    def _runge_kutta_step(
        self, state: List[float], step: float, inputs_at_end: bool, middle: AppliedMotion, middle_span: law.Span
    ) -> Tuple[List[float], List[float]]:
        """States in the middle and at the end by the classical Runge-Kutta method."""
        start, end = self._motion_at_start(inputs_at_end), self._motion_at(step, 1.0, inputs_at_end)
        start_span, end_span = self._span(start), self._span(end)
        k1 = self._rates(state, start_span, start.winch_speed)
        k2 = self._rates([s + 0.5 * step * k for s, k in zip(state, k1)], middle_span, middle.winch_speed)
        k3 = self._rates([s + 0.5 * step * k for s, k in zip(state, k2)], middle_span, middle.winch_speed)
        k4 = self._rates([s + step * k for s, k in zip(state, k3)], end_span, end.winch_speed)
        sixth = step / 6.0
        end_state = [s + sixth * (a + 2.0 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4)]
        return [0.5 * (s + e) + 0.125 * step * (a - d) for s, e, a, d in zip(state, end_state, k1, k4)], end_state

    def _adaptive_step(self, state: List[float], step: float, inputs_at_end: bool) -> Tuple[List[float], List[float]]:
        """States in the middle and at the end by adaptive inner steps, where effects have states of their own."""
        start = self._motion_at_start(inputs_at_end)

        def rates(fraction: float, states: List[float]) -> List[float]:
            motion_now = start if fraction == 0.0 else self._motion_at(step, fraction, inputs_at_end)
            return self._rates(states, self._span(motion_now), motion_now.winch_speed)

        return integrate_dormand_prince(rates, state, self.scales, step, self.relative_tolerance)

    def _record_tension(
        self,
        step: float,
        inputs_at_end: bool,
        start_state: List[float],
        middle_outputs: law.CableOutputs,
        end_state: List[float],
    ) -> None:
        """Append the tension of this step to the delay line of the load cell."""
        start, end = self._motion_at_start(inputs_at_end), self._motion_at(step, 1.0, inputs_at_end)
        start_outputs = self._outputs_with_rates(start_state, start, self._span(start))
        end_outputs = self._outputs_with_rates(end_state, end, self._span(end))
        delay_line = self.delay_lines[0] if self.delay_lines else ()
        outputs_at = zip((0.0, 0.5, 1.0), (start_outputs, middle_outputs, end_outputs))
        samples = [SignalSample(self.time + f * step, _value_and_rate(shown.tension)) for f, shown in outputs_at]
        self.delay_lines = (
            append_segment(
                append_segment(delay_line, samples[0], samples[1], self.tension_delay),
                samples[1],
                samples[2],
                self.tension_delay,
            ),
        )

    def refresh(self) -> None:
        real = self.real
        outputs = self._present_outputs(real[FIRST_STATE : self.state_end])
        values = (*outputs.force, outputs.tension, outputs.length, outputs.elongation, outputs.strain, outputs.pull)
        real[FIRST_OUTPUT:FIRST_RATE] = [value.real for value in values]
        real[FIRST_RATE:MIDDLE_FORCE] = (*rates_of(outputs.force), rate_of(outputs.tension))
        if self.tension_delay > 0.0 and self.delay_lines:
            real[TENSION], real[TENSION_RATE] = delayed_value(self.delay_lines[0], self.tension_delay)
        if not self.started:
            real[MIDDLE_FORCE:FIRST_STATE] = _values_and_rates(outputs.force)

    def _outputs_with_rates(self, states: List[float], motion_now: AppliedMotion, line: law.Span) -> law.CableOutputs:
        """Outputs and their rates by one complex step."""
        rates = self._rates(states, line, motion_now.winch_speed)
        inputs_with_rates = law.CableInputs(
            vector_with_rates(motion_now.position, motion_now.velocity),
            vector_with_rates(motion_now.velocity, motion_now.acceleration),
            with_rate(motion_now.winch_speed, motion_now.winch_acceleration),
        )
        state = self._state(all_with_rates(states, rates))
        motion = law.cable_motion(
            COMPLEX_STEP,
            self.constants,
            self.effects,
            state,
            law.span(COMPLEX_STEP, self.constants, inputs_with_rates, self.effects),
            inputs_with_rates.winch_speed,
        )
        return law.cable_outputs(COMPLEX_STEP, self.constants, self.effects, state, motion)

    def _present_outputs(self, states: List[float]) -> law.CableOutputs:
        if self.effects:
            motion_now = self._motion_at(self.elapsed, 1.0, False)
            return self._outputs_with_rates(states, motion_now, self._span(motion_now))
        line = self.end_span if self.inputs_unchanged else None
        if line is None:
            line = self._span_with_rates(self._motion_at(self.elapsed, 1.0, False))
        rate = self.real[WINCH_ACCELERATION]
        return self._outputs_without_effects(states, self.real[WINCH_SPEED] + self.elapsed * rate, rate, line)

    def _outputs_without_effects(
        self, states: List[float], speed: float, rate: float, line: law.Span
    ) -> law.CableOutputs:
        """As :meth:`_outputs_with_rates`, from a span that carries its rates, and the winch's speed and its rate."""
        unstrained, wound = states
        slope = self.tension_law.unstrained_length_rate(REAL, speed, line.length.real, unstrained)
        state = law.CableState(with_rate(unstrained, slope), with_rate(wound, speed), ())
        motion = law.cable_motion(COMPLEX_STEP, self.constants, (), state, line, with_rate(speed, rate))
        return law.cable_outputs(COMPLEX_STEP, self.constants, (), state, motion)

    def _span_with_rates(self, motion_now: AppliedMotion) -> law.Span:
        """Span without effects, as numbers that carry their rates."""
        position, velocity = (
            vector_with_rates(motion_now.position, motion_now.velocity),
            vector_with_rates(motion_now.velocity, motion_now.acceleration),
        )
        return law.span(COMPLEX_STEP, self.constants, law.CableInputs(position, velocity, 0.0))

    def _span(self, motion_now: AppliedMotion) -> law.Span:
        inputs = law.CableInputs(motion_now.position, motion_now.velocity, motion_now.winch_speed)
        return law.span(REAL, self.constants, inputs, self.effects)

    def _rates(self, states: List[float], line: law.Span, winch_speed: float) -> List[float]:
        state = self._state(states)
        motion = law.cable_motion(REAL, self.constants, self.effects, state, line, winch_speed)
        return _flat_state(law.state_rates(REAL, self.constants, self.effects, state, motion))

    def _state(self, states: List[Any]) -> law.CableState:
        if not self.effects:
            return law.CableState(states[0], states[1], ())
        effect_states = []
        first = 2
        for active in self.effects:
            count = len(active.effect.states)
            effect_states.append(tuple(states[first : first + count]))
            first += count
        return law.CableState(states[0], states[1], tuple(effect_states))

    def _motion_at_start(self, inputs_at_end: bool) -> AppliedMotion:
        return _motion(self._inputs_at_start(inputs_at_end))

    def _inputs_at_start(self, inputs_at_end: bool) -> Sequence[float]:
        return self.previous_inputs if inputs_at_end and self.previous_inputs is not None else self.real

    def _speed_at_start(self, inputs_at_end: bool) -> float:
        return self._inputs_at_start(inputs_at_end)[WINCH_SPEED]

    def _length_at_start(self, inputs_at_end: bool) -> float:
        """Length of the span at the start of a step, without effects."""
        inputs = self._inputs_at_start(inputs_at_end)
        if inputs is self.real or inputs != self.start_length_cache[0]:
            start = _motion(inputs)
            line = law.span(REAL, self.constants, law.CableInputs(start.position, start.velocity, start.winch_speed))
            self.start_length_cache = (inputs if inputs_at_end else None, line.length)
        return self.start_length_cache[1]

    def _motion_at(self, step: float, fraction: float, inputs_at_end: bool) -> AppliedMotion:
        """Motion that acts on the cable after a fraction of a step."""
        if inputs_at_end and fraction == 1.0:
            return _motion(self.real)
        if inputs_at_end:
            return self._interpolated_motion(step, fraction)
        s = step * fraction
        x0, x1, x2, v0, v1, v2, a0, a1, a2, speed, rate = self.real[POSITION:FIRST_MIDDLE_INPUT]
        return AppliedMotion(
            (taylor_extrapolate(x0, v0, a0, s), taylor_extrapolate(x1, v1, a1, s), taylor_extrapolate(x2, v2, a2, s)),
            (v0 + s * a0, v1 + s * a1, v2 + s * a2),
            (a0, a1, a2),
            speed + s * rate,
            rate,
        )

    def _interpolated_motion(self, step: float, fraction: float) -> AppliedMotion:
        end_inputs, start_inputs = self.real, self.previous_inputs
        assert start_inputs is not None
        speed, rate = cubic_hermite(
            start_inputs[WINCH_SPEED:FIRST_MIDDLE_INPUT], end_inputs[WINCH_SPEED:FIRST_MIDDLE_INPUT], step, fraction
        )
        if self.has_middle_inputs and fraction == 0.5:
            return AppliedMotion(
                end_inputs[FIRST_MIDDLE_INPUT : FIRST_MIDDLE_INPUT + 3],
                end_inputs[FIRST_MIDDLE_INPUT + 3 : FIRST_MIDDLE_INPUT + 6],
                end_inputs[FIRST_MIDDLE_INPUT + 6 : FIRST_OUTPUT],
                speed,
                rate,
            )
        path = [
            quintic_hermite(start_inputs[axis:WINCH_SPEED:3], end_inputs[axis:WINCH_SPEED:3], step, fraction)
            for axis in range(POSITION, VELOCITY)
        ]
        position, velocity, acceleration = zip(*path)
        return AppliedMotion(position, velocity, acceleration, speed, rate)


def _motion(inputs: Sequence[float]) -> AppliedMotion:
    return AppliedMotion(
        inputs[POSITION:VELOCITY],
        inputs[VELOCITY:ACCELERATION],
        inputs[ACCELERATION:WINCH_SPEED],
        inputs[WINCH_SPEED],
        inputs[WINCH_ACCELERATION],
    )


def _values_and_rates(vector_with_rates: Sequence[complex]) -> Tuple[float, ...]:
    x, y, z = vector_with_rates
    return (x.real, y.real, z.real, *rates_of(vector_with_rates))


def _value_and_rate(value: complex) -> Tuple[float, float]:
    return complex(value).real, rate_of(value)


def _flat_state(state: law.CableState) -> List[float]:
    if not state.effects:
        return [state.unstrained_length, state.wound_length]
    return [state.unstrained_length, state.wound_length, *(s for own in state.effects for s in own)]
