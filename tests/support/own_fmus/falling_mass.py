"""A platform as a user may write it with plain pythonfmu: no rates, no units, no saved states, no dependencies."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

MASS, GRAVITY = 300.0, 9.8


class FallingMass(Fmi2Slave):
    """A point mass under three forces that it holds over a step."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.place, self.speed = [28.86, 0.0, 5.0], [0.0, 0.0, 0.0]
        self.forces = [[0.0, 0.0, 0.0] for _ in range(3)]
        for axis, letter in enumerate("xyz"):
            self.port(f"position.{letter}", Fmi2Causality.output, self.place, axis)
            self.port(f"velocity.{letter}", Fmi2Causality.output, self.speed, axis)
            for number, force in enumerate(self.forces, 1):
                self.port(f"force_{number}.{letter}", Fmi2Causality.input, force, axis)

    def port(self, name, causality, values, axis):
        def put(value):
            values[axis] = value

        self.register_variable(Real(name, causality=causality, getter=lambda: values[axis], setter=put), nested=False)

    def do_step(self, current_time, step_size):
        for axis in range(3):
            acceleration = sum(force[axis] for force in self.forces) / MASS - (GRAVITY if axis == 2 else 0.0)
            self.place[axis] += step_size * (self.speed[axis] + 0.5 * step_size * acceleration)
            self.speed[axis] += step_size * acceleration
        return True
