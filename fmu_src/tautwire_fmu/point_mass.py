"""The point-mass platform as an FMI slave: cable forces in, motion out."""

from typing import Any, Dict, List, Tuple

from .description import Variable, axes, vector
from .laws import point_mass as law
from .laws.effects import BY_NAME
from .laws.mathematics import COMPLEX_STEP, REAL, along, rate_of
from .laws.vectors import Vector
from .slave import INPUT_TIME, Slave, active_effects, effect_variables, read_resource

SWEEPS = 8
TOLERANCE = 1e-15


class PointMass(Slave):
    """A mass under the forces of its cables, an external force and its weight."""

    def __init__(self, **kwargs: Any) -> None:
        data = read_resource(kwargs["resources"], "point_mass.json")
        self.settings: List[Dict[str, Any]] = data["effects"]
        self.force_count = len(data["start_forces"]) + 1
        self.first_output = 1 + 6 * self.force_count
        self.couples = any(BY_NAME[s["name"]].wrench is not None for s in self.settings)
        super().__init__(data, _variables(data), slice(self.first_output, self.first_output + 6), **kwargs)
        self.parameters_changed()

    def parameters_changed(self) -> None:
        numbers = self.real[self.first_parameter :]
        self.effects = active_effects(self.settings, numbers[5:])
        self.constants = law.PointMassConstants(mass=numbers[0], gravity=numbers[1])
        self.effect_states: Tuple[Tuple[float, ...], ...] = tuple(() for _ in self.effects)
        if not self.started:
            self.real[self.first_output : self.first_output + 6] = [*numbers[2:5], 0.0, 0.0, 0.0]

    def advance(self, step: float, ends: bool) -> None:
        """Exact integral of the cubic through acceleration and its rate at both ends.

        Where a wrench depends on the motion the end values are found by sweeping; otherwise one sweep is exact.
        """
        first = self.first_output
        x0: Vector = tuple(self.real[first : first + 3])
        v0: Vector = tuple(self.real[first + 3 : first + 6])
        now = self._force(self.real)
        if ends:
            assert self.earlier is not None
            force0, rate0 = self._force(self.earlier)
            force1, rate1 = now
        else:
            force0, rate0 = now
            force1 = tuple(f + step * r for f, r in zip(force0, rate0))
            rate1 = rate0
        a0, j0 = self._acceleration_and_jerk(x0, v0, force0, rate0)
        x1, v1, a1, j1 = x0, v0, a0, j0
        for _ in range(SWEEPS if self.couples else 1):
            a1, j1 = self._acceleration_and_jerk(x1, v1, force1, rate1)
            before = x1
            x1, v1 = _integrate_cubic(x0, v0, (a0, j0), (a1, j1), step)
            if all(abs(p - q) <= TOLERANCE * abs(p) for p, q in zip(x1, before)):
                break
        self.real[first : first + 6] = [*x1, *v1]

    def refresh(self) -> None:
        first = self.first_output
        force, rate = self._force(self.real)
        force = tuple(f + self.elapsed * r for f, r in zip(force, rate))
        self.real[first + 6 : first + 9] = law.acceleration(
            REAL,
            self.constants,
            self.effects,
            self.effect_states,
            tuple(self.real[first : first + 3]),
            tuple(self.real[first + 3 : first + 6]),
            force,
        )

    def _force(self, inputs: Any) -> Tuple[Vector, Vector]:
        end = self.first_output
        force = tuple(sum(inputs[1 + axis : end : 6]) for axis in range(3))
        rate = tuple(sum(inputs[4 + axis : end : 6]) for axis in range(3))
        return force, rate

    def _acceleration_and_jerk(
        self, position: Vector, velocity: Vector, force: Vector, rate: Vector
    ) -> Tuple[Vector, Vector]:
        acceleration = law.acceleration(
            REAL, self.constants, self.effects, self.effect_states, position, velocity, force
        )
        carried = law.acceleration(
            COMPLEX_STEP,
            self.constants,
            self.effects,
            self.effect_states,
            tuple(map(along, position, velocity)),
            tuple(map(along, velocity, acceleration)),
            tuple(map(along, force, rate)),
        )
        return acceleration, tuple(map(rate_of, carried))


def _integrate_cubic(
    x0: Vector, v0: Vector, start: Tuple[Vector, Vector], end: Tuple[Vector, Vector], step: float
) -> Tuple[Vector, Vector]:
    position = tuple(
        x + step * v + step * step * (0.35 * a0 + 0.15 * a1 + step * (j0 / 20.0 - j1 / 30.0))
        for x, v, a0, j0, a1, j1 in zip(x0, v0, *start, *end)
    )
    velocity = tuple(
        v + step * (0.5 * (a0 + a1) + step / 12.0 * (j0 - j1)) for v, a0, j0, a1, j1 in zip(v0, *start, *end)
    )
    return position, velocity


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
    return (
        INPUT_TIME,
        *inputs,
        *vector("position", "output", "m", "position of the point mass", start),
        *vector("velocity", "output", "m/s", "velocity of the point mass"),
        *vector(
            "acceleration",
            "output",
            "m/s2",
            "acceleration of the point mass",
            nominal=float(data["gravity"]) or None,
            depends_on=axes(*(name for name, *_ in named)),
        ),
        Variable("mass", "parameter", "kg", "mass of the platform", data["mass"], True, 0.0, nominal=data["mass"]),
        Variable("gravity", "parameter", "m/s2", "gravity, along -z", data["gravity"], True),
        *vector("start", "parameter", "m", "position at the start, at rest", start),
        *effect_variables(data["effects"]),
    )
