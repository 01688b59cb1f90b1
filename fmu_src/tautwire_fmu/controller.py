"""The sampled controller as an FMI slave: position and tensions in, winch speeds out, its path and matrices inside.

It samples its inputs itself, at the start and each period later. In between the speeds run on ramps; their rates are
discrete variables, which jump at the samples.
"""

from typing import Any, Dict, Iterator, List, Sequence, Tuple

from .description import Variable, vector
from .laws import sampled_control as law
from .slave import INPUT_TIME, Slave, read_resource

FIRST_SEEN = 1
# A sample so near that rounding may have missed it, in periods.
NEAR = 1e-6


class Controller(Slave):
    """A controller for one path of one robot."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "controller.json")
        self.plan = law.plan_of(data)
        self.cables = len(self.plan.compliances)
        self.designed_period = float(data["period"])
        self.sensors = slice(FIRST_SEEN, FIRST_SEEN + 3 + self.cables)
        self.first_output = self.sensors.stop
        first_state = self.first_output + 2 * self.cables
        self.sizes = (2, len(self.plan.gains[0].A), *(self.cables,) * 5, 3 + self.cables)
        super().__init__(
            data, _variables(data, self.sizes), slice(first_state, first_state + sum(self.sizes)), **kwargs
        )
        self.parameters_changed()

    def parameters_changed(self) -> None:
        period, *bounds = self.real[self.first_parameter :]
        self.limits = law.Limits(*bounds)
        self.refused = (
            ""
            if period == self.designed_period
            else f"period is {period!r} s, the controller is made for {self.designed_period!r} s: design another"
        )
        if not self.started:
            self._keep(law.first_sample(self.plan, self.limits), 0.0, self.real[self.sensors])

    def advance(self, step: float, ends: bool) -> None:
        """Sample the inputs at the begin of each period, and go on to the next sample at its end."""
        if self.refused:
            raise ValueError(self.refused)
        memory, phase, seen = self._kept()
        period, done = self.plan.period, 0.0
        while step - done > NEAR * period:
            if phase == 0.0:
                seen = self._seen(done / step, ends)
            if step - done < period - phase - NEAR * period:
                phase += step - done
                break
            done += period - phase
            memory, phase = law.next_sample(self.plan, self.limits, memory, seen), 0.0
        self._keep(memory, phase, seen)

    def refresh(self) -> None:
        memory, phase, _ = self._kept()
        rates = law.acceleration(self.plan, memory)
        speeds = [speed + phase * rate for speed, rate in zip(memory.begin, rates)]
        self.real[self.first_output : self.states.start] = [*speeds, *rates]

    def _seen(self, fraction: float, ends: bool) -> List[float]:
        """The inputs after a fraction of the step; on a straight line where they are known at both ends."""
        now = self.real[self.sensors]
        if not ends:
            return now
        assert self.earlier is not None
        return [a + fraction * (b - a) for a, b in zip(self.earlier[self.sensors], now)]

    def _kept(self) -> Tuple[law.Memory, float, List[float]]:
        """Memory, time since the sample, and what the sensors showed then."""
        (sample, phase), *remembered, seen = _parts(self.real[self.states], self.sizes)
        return law.Memory(int(sample), *remembered), phase, seen

    def _keep(self, memory: law.Memory, phase: float, seen: Sequence[float]) -> None:
        sample, *remembered = memory
        self.real[self.states] = [float(sample), phase, *(x for part in remembered for x in part), *seen]


def _parts(numbers: Sequence[float], sizes: Sequence[int]) -> Iterator[List[float]]:
    first = 0
    for size in sizes:
        yield list(numbers[first : first + size])
        first += size


def _variables(data: Dict[str, Any], sizes: Sequence[int]) -> Tuple[Variable, ...]:
    return (*_inputs(data), *_outputs(sizes[2]), *_states(sizes), *_parameters(data))


def _inputs(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    position, tensions = data["expected"][0][:3], data["expected"][0][3:]
    return (
        INPUT_TIME,
        *vector("position", "input", "m", "measured position of the platform", tuple(position)),
        *(
            Variable(f"tension_{i}", "input", "N", f"measured tension of cable {i}", float(tension), nominal=1e3)
            for i, tension in enumerate(tensions, start=1)
        ),
    )


def _outputs(cables: int) -> Tuple[Variable, ...]:
    numbers = range(1, cables + 1)
    asked, rate = "speed asked of winch {}, positive reels in", "rate of winch_speed_{}, which jumps at the samples"
    return (
        *(Variable(f"winch_speed_{i}", "output", "m/s", asked.format(i)) for i in numbers),
        *(Variable(f"winch_acceleration_{i}", "output", "m/s2", rate.format(i), discrete=True) for i in numbers),
    )


def _states(sizes: Sequence[int]) -> Tuple[Variable, ...]:
    _, states, cables, *_ = sizes

    def each(name: str, unit: str, count: int, meaning: str) -> Tuple[Variable, ...]:
        return tuple(Variable(f"{name}_{i}", "local", unit, f"state: {meaning}") for i in range(1, count + 1))

    return (
        Variable("sample", "local", "1", "state: samples passed"),
        Variable("since_sample", "local", "s", "state: time since the last sample"),
        *each("state", "1", states, "of the controller, in SI units"),
        *each("begin_speed", "m/s", cables, "speed at the last sample"),
        *each("end_speed", "m/s", cables, "speed at the next sample"),
        *each("last_tension", "N", cables, "tension one sample before"),
        *each("earlier_tension", "N", cables, "tension two samples before"),
        *each("scale", "1", cables, "tension at the start over the one expected"),
        *(Variable(f"seen_position.{axis}", "local", "m", "state: position at the last sample") for axis in "xyz"),
        *each("seen_tension", "N", cables, "tension at the last sample"),
    )


def _parameters(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    limits, period = data["limits"], float(data["period"])
    fixed = f"sample period; the matrices are made for {period!r} s"
    bounds = (
        ("speed", "m/s", "largest speed of the rope"),
        ("acceleration", "m/s2", "largest acceleration of the rope"),
        ("lowest_tension", "N", "tension below which a cable is not let out further"),
        ("highest_tension", "N", "tension above which a cable is not reeled in further"),
    )
    return (
        Variable("period", "parameter", "s", fixed, period, minimum=period, maximum=period),
        *(
            Variable(f"limit.{name}", "parameter", unit, meaning, float(limits[name]), True)
            for name, unit, meaning in bounds
        ),
    )
