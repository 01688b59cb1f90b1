"""The point-mass platform as an FMI slave: cable forces in, motion out."""

from typing import Any, Dict, List, Sequence, Tuple

from .acting import active_effects, effect_states, effect_variables, effects_of
from .description import Variable, axes, vector
from .interpolation import cubic
from .laws import point_mass as law
from .laws import stages
from .laws.effects import Effect
from .laws.mathematics import COMPLEX_STEP, REAL, Mathematics, along, rates_of, vector_along
from .laws.vectors import Vector
from .past import Seen, remember, seen
from .quadrature import CUBIC_END, CUBIC_MIDDLE, QUINTIC_END, QUINTIC_MIDDLE, Node, Place, integrate
from .slave import INPUT_TIME, MIDDLE_TIME, Slave, read_resource

FIRST_FORCE = 2
SWEEPS = 8
TOLERANCE = 1e-15


class PointMass(Slave):
    """A mass under the forces of its cables, an external force and its weight."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "point_mass.json")
        self.acting = effects_of(data)
        self.force_count = len(data["start_forces"]) + 1
        self.first_middle = FIRST_FORCE + 6 * self.force_count
        self.first_output = self.first_middle + 6 * (self.force_count - 1)
        self.measures = _is_measured(self.acting)
        # Of the effects, formulas alone have states on the platform: the time since the start.
        self.clock = self.first_output + (21 if self.measures else 18)
        self.start_velocity: Tuple[float, ...] = tuple(data.get("start_velocity", (0.0, 0.0, 0.0)))
        self.couples = any(effect.wrench is not None for effect in self.acting)
        self.end_acceleration: Vector = ()
        # Of the inputs at a step's start, from which redos begin too.
        self.begun: Tuple[Sequence[float], Tuple[Vector, Vector], Node] = ((), ((), ()), Node((), ()))
        super().__init__(data, _variables(data), slice(self.first_output, self.first_output + 6), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        self.begun = ((), ((), ()), Node((), ()))
        numbers = self.real[self.first_parameter :]
        self.effects = active_effects(self.acting, numbers[5:])
        self.constants = law.PointMassConstants(mass=numbers[0], gravity=numbers[1])
        self.timed = any(active.effect.states for active in self.effects)
        self.gain, self.lag = stages.gains(REAL, self.effects)[1], stages.delays(REAL, self.effects)[1]
        if not self.started:
            self.real[self.first_output : self.first_output + 6] = [*numbers[2:5], *self.start_velocity]

    def advance(self, step: float, ends: bool) -> None:
        """Exact integral of the polynomial through acceleration and its rate at both ends, and in the middle if known.

        Where a wrench depends on the motion the later nodes are found by sweeping; otherwise one sweep is exact.
        """
        first = self.first_output
        now = self._time()
        start = Place(self.real[first : first + 3], self.real[first + 3 : first + 6], ())
        begun, known = self._begin(start, now, ends)
        pushes = [begun, *self._later_pushes(begun, step, ends)]
        to_middle, to_end = (QUINTIC_MIDDLE, QUINTIC_END) if len(pushes) == 3 else (CUBIC_MIDDLE, CUBIC_END)
        times = (now, now + step) if len(pushes) == 2 else (now, now + 0.5 * step, now + step)
        nodes = [known, *(self._node(start, push, time) for push, time in zip(pushes[1:], times[1:]))]
        middle, end = integrate(start, nodes, step, to_middle), integrate(start, nodes, step, to_end)
        for _ in range(SWEEPS if self.couples else 0):
            before = end.position
            places = (start, end) if len(pushes) == 2 else (start, middle, end)
            nodes = [self._node(place, push, time) for place, push, time in zip(places, pushes, times)]
            middle, end = integrate(start, nodes, step, to_middle), integrate(start, nodes, step, to_end)
            if all(abs(p - q) <= TOLERANCE * abs(p) for p, q in zip(end.position, before)):
                break
        if self.lag > 0.0:
            self._remember(step, start, nodes, end)
        self.end_acceleration = end.acceleration
        self.real[first : first + 6] = [*end.position, *end.velocity]
        self.real[first + 9 : first + 18] = [*middle.position, *middle.velocity, *middle.acceleration]
        if self.timed:
            self.real[self.clock] = now + step

    def refresh(self) -> None:
        first = self.first_output
        ended = self.untouched and not self.couples
        self.real[first + 6 : first + 9] = self.end_acceleration if ended else self._present_acceleration()
        if not self.started:
            self.real[first + 9 : first + 18] = self.real[first : first + 9]
        if self.measures:
            past = [seen(pieces, self.lag)[0] for pieces in self.pasts] if self.lag > 0.0 else []
            self.real[first + 18 : first + 21] = [self.gain * x for x in past or self.real[first : first + 3]]

    def _present_acceleration(self) -> Vector:
        """Under the forces as they are now."""
        first = self.first_output
        force, rate = self._force(self.real)
        force = tuple(f + self.elapsed * r for f, r in zip(force, rate))
        place, velocity = tuple(self.real[first : first + 3]), tuple(self.real[first + 3 : first + 6])
        return self._acceleration(REAL, place, velocity, force, self._time())

    def _remember(self, step: float, start: Place, nodes: Sequence[Node], end: Place) -> None:
        """Keep the path of this step for the sensor of the position, which lags."""
        pasts = self.pasts or ((), (), ())
        columns = zip(start.position, start.velocity, nodes[0].acceleration)
        begun = [Seen(self.time, numbers) for numbers in columns]
        ended = [Seen(self.time + step, numbers) for numbers in zip(end.position, end.velocity, nodes[-1].acceleration)]
        self.pasts = tuple(remember(past, b, e, self.lag) for past, b, e in zip(pasts, begun, ended))

    def _begin(self, start: Place, time: float, ends: bool) -> Tuple[Tuple[Vector, Vector], Node]:
        """Summed force and its rate at the start of a step, and the node there."""
        inputs = self.earlier if ends and self.earlier is not None else self.real[: self.input_count]
        moves = self.couples or self.timed
        if moves or self.begun[0] != inputs:
            push = self._force(inputs)
            self.begun = (inputs, push, self._node(start, push, time))
        return self.begun[1:]

    def _later_pushes(self, begun: Tuple[Vector, Vector], step: float, ends: bool) -> List[Tuple[Vector, Vector]]:
        """Summed force and its rate in the middle where it is known, and at the end."""
        if not ends:
            force, rate = begun
            return [(tuple(f + step * r for f, r in zip(force, rate)), rate)]
        assert self.earlier is not None
        between = [self._middle_force(self.earlier, step)] if self.middle_given else []
        return [*between, self._force(self.real)]

    def _force(self, inputs: Any) -> Tuple[Vector, Vector]:
        x, y, z, rx, ry, rz = [sum(inputs[FIRST_FORCE + k : self.first_middle : 6]) for k in range(6)]
        return (x, y, z), (rx, ry, rz)

    def _middle_force(self, then: Sequence[float], step: float) -> Tuple[Vector, Vector]:
        """The cables' forces as given, and the external force between its values at both ends."""
        now, outside = self.real, self.first_middle - 6
        sums = [sum(now[self.first_middle + k : self.first_output : 6]) for k in range(6)]
        if not (any(then[outside : outside + 6]) or any(now[outside : outside + 6])):
            return sums[:3], sums[3:]
        pushed = [cubic(then[outside + k :: 3][:2], now[outside + k :: 3][:2], step, 0.5) for k in range(3)]
        force = tuple(f + value for f, (value, _) in zip(sums[:3], pushed))
        return force, tuple(r + rate for r, (_, rate) in zip(sums[3:], pushed))

    def _time(self) -> float:
        return self.real[self.clock] if self.timed else 0.0

    def _states(self, time: Any) -> Tuple[Tuple[Any, ...], ...]:
        return tuple((time,) if active.effect.states else () for active in self.effects)

    def _node(self, place: Place, push: Tuple[Vector, Vector], time: float) -> Node:
        force, rate = push
        position: Vector = place.position
        velocity: Vector = place.velocity
        if self.couples:
            # Only a wrench makes the acceleration's rate depend on the motion, and on the acceleration itself.
            acceleration = self._acceleration(REAL, position, velocity, force, time)
            position = vector_along(position, velocity)
            velocity = vector_along(velocity, acceleration)
        forced = vector_along(force, rate)
        carried = self._acceleration(COMPLEX_STEP, position, velocity, forced, along(time, 1.0))
        x, y, z = carried
        return Node((x.real, y.real, z.real), rates_of(carried))

    def _acceleration(self, m: Mathematics, position: Vector, velocity: Vector, force: Vector, time: Any) -> Vector:
        return law.acceleration(m, self.constants, self.effects, self._states(time), position, velocity, force)


def _is_measured(effects: Sequence[Effect]) -> bool:
    """Whether some effect parts what the sensor shows from what is."""
    return any(effect.gain is not None or effect.delay is not None for effect in effects)


def _variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    start = tuple(data["start"])
    weight = float(data["mass"]) * float(data["gravity"])
    named = [
        (f"force_{number}", f"force_rate_{number}", f"force of cable {number}", tuple(force))
        for number, force in enumerate(data["start_forces"], start=1)
    ]
    named.append(("external_force", "external_force_rate", "external force", (0.0, 0.0, 0.0)))
    inputs: Tuple[Variable, ...] = ()
    for name, rate, meaning, force in named:
        inputs += vector(name, "input", "N", meaning, force, nominal=weight)
        inputs += vector(rate, "input", "N/s", f"rate of the {meaning}", nominal=weight)
    middle: Tuple[Variable, ...] = ()
    for name, rate, meaning, force in named[:-1]:
        within = f"{meaning} in the middle of a step"
        middle += vector(f"middle_{name}", "input", "N", within, force, nominal=weight)
        middle += vector(f"middle_{rate}", "input", "N/s", f"rate of the {within}", nominal=weight)
    measured = vector("measured_position", "output", "m", "position as its sensor shows it", start)
    if not _is_measured(effects_of(data)):
        measured = ()
    return (
        INPUT_TIME,
        MIDDLE_TIME,
        *inputs,
        *middle,
        *vector("position", "output", "m", "position of the point mass", start),
        *vector("velocity", "output", "m/s", "velocity of the point mass", rate_of="position"),
        *vector(
            "acceleration",
            "output",
            "m/s2",
            "acceleration of the point mass",
            nominal=float(data["gravity"]) or None,
            depends_on=axes(*(name for name, *_ in named)),
            rate_of="velocity",
        ),
        *vector("middle_position", "output", "m", "position in the middle of the last step", start),
        *vector(
            "middle_velocity", "output", "m/s", "velocity in the middle of the last step", rate_of="middle_position"
        ),
        *vector(
            "middle_acceleration",
            "output",
            "m/s2",
            "acceleration in the middle of the last step",
            nominal=float(data["gravity"]) or None,
            rate_of="middle_velocity",
        ),
        *measured,
        *effect_states(data),
        Variable("mass", "parameter", "kg", "mass of the platform", data["mass"], True, 0.0, nominal=data["mass"]),
        Variable("gravity", "parameter", "m/s2", "gravity, along -z", data["gravity"], True),
        *vector("start", "parameter", "m", "position at the start, at rest", start),
        *effect_variables(data["effects"]),
    )
