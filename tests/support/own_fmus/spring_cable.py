"""A cable as a user may write it with plain pythonfmu: the linear law, cable 2 of the paper's robot, force only."""

from math import sqrt

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

ANCHOR = (0.0, -50.0, 50.0)
STIFFNESS = 134.8e9 * 3.141592653589793 * 0.002**2


class SpringCable(Fmi2Slave):
    """A spring whose rest length the winch changes, with the start position as a parameter."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.place, self.speed, self.pull = [28.86, 0.0, 5.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.start, self.winch, self.tension, self.wound = [28.86, 0.0, 5.0], [0.0], [0.0], 0.0
        for axis, letter in enumerate("xyz"):
            self.port(f"position.{letter}", Fmi2Causality.input, self.place, axis)
            self.port(f"velocity.{letter}", Fmi2Causality.input, self.speed, axis)
            self.port(f"force.{letter}", Fmi2Causality.output, self.pull, axis)
            self.port(f"start.{letter}", Fmi2Causality.parameter, self.start, axis)
        self.port("winch_speed", Fmi2Causality.input, self.winch, 0)
        self.port("start_tension", Fmi2Causality.parameter, self.tension, 0)

    def port(self, name, causality, values, axis):
        def put(value):
            values[axis] = value

        def get():
            self.refresh()
            return values[axis]

        kind = Fmi2Variability.fixed if causality == Fmi2Causality.parameter else Fmi2Variability.continuous
        self.register_variable(Real(name, causality=causality, variability=kind, getter=get, setter=put), nested=False)

    def refresh(self):
        span = [a - p for a, p in zip(ANCHOR, self.place, strict=True)]
        length = sqrt(sum(s * s for s in span))
        rest = sqrt(sum((a - s) ** 2 for a, s in zip(ANCHOR, self.start, strict=True))) - self.wound
        tension = STIFFNESS * (length - rest) / length + self.tension[0]
        self.pull[:] = [tension * s / length for s in span]

    def do_step(self, current_time, step_size):
        self.wound += step_size * self.winch[0]
        return True
