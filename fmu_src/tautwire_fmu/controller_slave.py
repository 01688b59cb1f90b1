"""FMI slave of the sampled controller: measured pose and tensions in, winch speeds out.

It samples its inputs itself, at the start and every period after. Between samples the speeds are ramps; their rates are
discrete variables, which jump at the samples.
"""

from typing import Any, Dict, Iterator, List, Sequence, Tuple

from .laws import sampled_control as law
from .model_description import Variable, vector_variables
from .slave import INPUT_TIME, Slave, read_resource

FIRST_MEASUREMENT = 1
# In periods: a sample nearer than this counts as reached, whatever rounding did.
SAMPLE_TIME_TOLERANCE = 1e-6
ORIENTATION_TEXT = "measured orientation, unit quaternion, platform to world"


class Controller(Slave):
    """Sampled controller for one path of one robot."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "controller.json")
        self.plan = law.plan_from_resource(data)
        self.cable_count = len(self.plan.compliances)
        sensor_count = self.plan.pose_size + self.cable_count
        self.sensors = slice(FIRST_MEASUREMENT, FIRST_MEASUREMENT + sensor_count)
        self.first_output = self.sensors.stop
        first_state = self.first_output + 2 * self.cable_count
        self.state_sizes = (2, len(self.plan.gains[0].A), *(self.cable_count,) * 5, sensor_count)
        super().__init__(
            data, _variables(data, self.state_sizes), slice(first_state, first_state + sum(self.state_sizes)), **kwargs
        )
        self.parameters_changed()

    def parameters_changed(self) -> None:
        _period, *bounds = self.real[self.first_parameter :]
        self.limits = law.Limits(*bounds)
        if not self.started:
            self._store_state(law.initial_controller_state(self.plan, self.limits), 0.0, self.real[self.sensors])

    def advance(self, step: float, inputs_at_end: bool) -> None:
        """Sample the inputs at the start of each period, and update the controller state at its end."""
        state, phase, measured = self._load_state()
        period, elapsed = self.plan.period, 0.0
        while step - elapsed > SAMPLE_TIME_TOLERANCE * period:
            if phase == 0.0:
                measured = self._measurements_at(elapsed / step, inputs_at_end)
            if step - elapsed < period - phase - SAMPLE_TIME_TOLERANCE * period:
                phase += step - elapsed
                break
            elapsed += period - phase
            state, phase = law.next_controller_state(self.plan, self.limits, state, measured), 0.0
        self._store_state(state, phase, measured)

    def refresh(self) -> None:
        state, phase, _ = self._load_state()
        rates = law.acceleration(self.plan, state)
        speeds = [speed + phase * rate for speed, rate in zip(state.begin, rates)]
        self.real[self.first_output : self.states.start] = [*speeds, *rates]

    def _measurements_at(self, fraction: float, inputs_at_end: bool) -> List[float]:
        """Measured inputs after a fraction of the step; interpolated linearly where they are known at both ends."""
        end_measurements = self.real[self.sensors]
        if not inputs_at_end:
            return end_measurements
        assert self.previous_inputs is not None
        return [a + fraction * (b - a) for a, b in zip(self.previous_inputs[self.sensors], end_measurements)]

    def _load_state(self) -> Tuple[law.ControllerState, float, List[float]]:
        """Controller state, time since the last sample, and the measurements of that sample."""
        (sample, phase), *controller_state, measured = _split_by_size(self.real[self.states], self.state_sizes)
        return law.ControllerState(int(sample), *controller_state), phase, measured

    def _store_state(self, state: law.ControllerState, phase: float, measured: Sequence[float]) -> None:
        sample, *controller_state = state
        self.real[self.states] = [float(sample), phase, *(x for part in controller_state for x in part), *measured]


def _split_by_size(values: Sequence[float], sizes: Sequence[int]) -> Iterator[List[float]]:
    first = 0
    for size in sizes:
        yield list(values[first : first + size])
        first += size


def _variables(data: Dict[str, Any], sizes: Sequence[int]) -> Tuple[Variable, ...]:
    return (*_inputs(data), *_outputs(sizes[2]), *_states(sizes), *_parameters(data))


def _inputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    expected, size = data["expected"][0], len(data["expected"][0]) - len(data["compliances"])
    position, orientation, tensions = expected[:3], expected[3:size], expected[size:]
    return (
        INPUT_TIME,
        *vector_variables(Variable("position", "input", "m", "measured position of the platform"), tuple(position)),
        *(
            Variable(f"orientation.{part}", "input", "1", f"{ORIENTATION_TEXT}, {part} part", float(value))
            for part, value in zip("wxyz", orientation)
        ),
        *(
            Variable(f"tension_{i}", "input", "N", f"measured tension of cable {i}", float(tension), nominal=1e3)
            for i, tension in enumerate(tensions, start=1)
        ),
    )


def _outputs(cables: int) -> Tuple[Variable, ...]:
    numbers = range(1, cables + 1)
    command_text, rate_text = (
        "speed asked of winch {}, positive reels in",
        "rate of winch_speed_{}, which jumps at the samples",
    )
    return (
        *(Variable(f"winch_speed_{i}", "output", "m/s", command_text.format(i)) for i in numbers),
        *(Variable(f"winch_acceleration_{i}", "output", "m/s2", rate_text.format(i), discrete=True) for i in numbers),
    )


def _states(sizes: Sequence[int]) -> Tuple[Variable, ...]:
    _, states, cables, *_, sensors = sizes

    def numbered_states(name: str, unit: str, count: int, description: str) -> Tuple[Variable, ...]:
        return tuple(Variable(f"{name}_{i}", "local", unit, f"state: {description}") for i in range(1, count + 1))

    return (
        Variable("sample", "local", "1", "state: samples passed"),
        Variable("since_sample", "local", "s", "state: time since the last sample"),
        *numbered_states("state", "1", states, "of the controller, in SI units"),
        *numbered_states("begin_speed", "m/s", cables, "speed at the last sample"),
        *numbered_states("end_speed", "m/s", cables, "speed at the next sample"),
        *numbered_states("last_tension", "N", cables, "tension one sample before"),
        *numbered_states("earlier_tension", "N", cables, "tension two samples before"),
        *numbered_states("scale", "1", cables, "tension at the start over the one expected"),
        *(Variable(f"seen_position.{axis}", "local", "m", "state: position at the last sample") for axis in "xyz"),
        *(
            Variable(f"seen_orientation.{part}", "local", "1", "state: orientation at the last sample")
            for part in "wxyz"[: sensors - 3 - cables]
        ),
        *numbered_states("seen_tension", "N", cables, "tension at the last sample"),
    )


def _parameters(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    limits, period = data["limits"], float(data["period"])
    period_text = f"sample period; the matrices are made for {period!r} s"
    limit_variables = (
        ("speed", "m/s", "largest speed of the rope"),
        ("acceleration", "m/s2", "largest acceleration of the rope"),
        ("lowest_tension", "N", "tension below which a cable is not let out further"),
        ("highest_tension", "N", "tension above which a cable is not reeled in further"),
    )
    return (
        Variable("period", "parameter", "s", period_text, period, minimum=period, maximum=period),
        *(
            Variable(f"limit.{name}", "parameter", unit, meaning, float(limits[name]), True)
            for name, unit, meaning in limit_variables
        ),
    )
