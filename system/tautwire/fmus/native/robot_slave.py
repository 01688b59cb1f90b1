"""FMI variables of a whole robot: winch speeds and an external load in, pose, tensions and rope lengths out.

Its platform, its cables and its winches have their states integrated together in adaptive steps, to the relative
tolerance of the experiment. Parameters and local variables have the name of their component in front.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tautwire_fmu.model_description import Variable
from tautwire_fmu.slave import INPUT_TIME, Slave

from .python_slaves import python_slave

# Outputs of each cable in the order of the slave's values; the last one is the rate of the first.
CABLE_OUTPUTS = ("tension", "length", "elongation", "strain", "pull", "tension_rate")
EXTERNAL_INPUTS = ("external_force", "external_force_rate", "external_moment", "external_moment_rate")
PLATFORM_OUTPUTS = ("position", "velocity", "acceleration", "angular_velocity", "angular_acceleration")
COMMANDS = ("speed_command", "speed_command_rate")
SPEEDS = ("winch_speed", "winch_acceleration")
INNER_STEP = Variable("inner_step", "local", "s", "length of the next step of the adaptive integration")


class WholeRobot(Slave):
    """Variables of a whole robot, by the slaves of its components; it runs as machine code only."""

    def __init__(self, data: Mapping[str, Any], components: Mapping[str, Slave]) -> None:
        variables = _Variables(components)
        self.component_states = {name: variables.states_of(name) for name in components}
        self.component_parameters = {name: variables.parameters_of(name) for name in components}
        inputs, states = variables.inputs(), variables.of_all(self.component_states)
        listed = (*inputs, *states, *variables.outputs(), INNER_STEP, *variables.of_all(self.component_parameters))
        span = slice(len(inputs), len(inputs) + len(states))
        super().__init__(dict(data), listed, span, instance_name=data["model_name"])

    def refresh(self) -> None:
        """Outputs have no start values that a description would show."""


def whole_robot_slave(data: Mapping[str, Any]) -> WholeRobot:
    """The slave of a whole robot's resource."""
    identity = {name: data[name] for name in ("model_name", "guid", "version")}
    platform = ("rigid_body", "RigidBody") if data["is_rigid"] else ("point_mass", "PointMass")
    parts: dict[str, tuple[str, str, Mapping[str, Any]]] = {"platform": (*platform, data["platform"])}
    parts |= {f"cable_{i}": ("cable", "Cable", each) for i, each in enumerate(data["cables"], start=1)}
    parts |= {f"winch_{i}": ("winch", "Winch", each) for i, each in enumerate(data["winches"], start=1)}
    slaves = {name: python_slave(kind, base, {**each, **identity}) for name, (kind, base, each) in parts.items()}
    return WholeRobot(data, slaves)


class _Variables:
    """Variables of a whole robot, from those of its components: ``platform``, ``cable_1`` ..., ``winch_1`` ..."""

    def __init__(self, components: Mapping[str, Slave]) -> None:
        self.components = components
        self.platform = components["platform"]
        self.numbers = range(1, sum(name.startswith("cable_") for name in components) + 1)
        self.has_winches = "winch_1" in components
        values = [name for name in EXTERNAL_INPUTS if not name.endswith("_rate")]
        self.loads = tuple(v.name for name in values for v in _vector(self.platform, name))

    def inputs(self) -> tuple[Variable, ...]:
        """Speeds, or commands of winches, each with its rate, then the external load, each vector with its rate."""
        kind, names = ("winch", COMMANDS) if self.has_winches else ("cable", SPEEDS)
        speeds = [self._numbered(kind, number, name) for number in self.numbers for name in names]
        loads = [variable for name in EXTERNAL_INPUTS for variable in _vector(self.platform, name)]
        return (INPUT_TIME, *speeds, *loads)

    def outputs(self) -> tuple[Variable, ...]:
        """Outputs that are no states: motion, measured position, then one quantity of the cables after the other."""
        slave, drivers = self.platform, () if self.has_winches else self._drivers(SPEEDS[:1])
        is_state = set(slave.variables[slave.states])
        motion = [v for name in PLATFORM_OUTPUTS for v in _vector(slave, name) if v not in is_state]
        motion = [v._replace(depends_on=(*drivers, *self.loads) if v.depends_on else ()) for v in motion]
        cables = [self._cable_output(number, name) for name in CABLE_OUTPUTS for number in self.numbers]
        return (*motion, *_vector(slave, "measured_position"), *cables)

    def states_of(self, component: str) -> tuple[Variable, ...]:
        """States of a component, of a platform with the time of its formulas."""
        slave = self.components[component]
        states = list(slave.variables[slave.states])
        states += [v for v in slave.variables if v.name.startswith("effect.") and v.causality == "local"]
        return tuple(self._shown_state(component, state) for state in dict.fromkeys(states))

    def parameters_of(self, component: str) -> tuple[Variable, ...]:
        """Parameters of a component."""
        slave = self.components[component]
        return tuple(_in_component(component, variable) for variable in slave.variables[slave.first_parameter :])

    def of_all(self, by_component: Mapping[str, Sequence[Variable]]) -> tuple[Variable, ...]:
        """Variables of all components, one after the other."""
        return tuple(variable for each in by_component.values() for variable in each)

    def _shown_state(self, component: str, state: Variable) -> Variable:
        if state.causality == "local":
            return _in_component(component, state)
        kind, _, number = component.partition("_")
        return self._numbered(kind, int(number), state.name) if number else state._replace(depends_on=())

    def _cable_output(self, number: int, name: str) -> Variable:
        drivers: tuple[str, ...] = ()
        if name == "tension_rate":
            own = self._drivers(COMMANDS[:1], number) if self.has_winches else self._drivers(SPEEDS)
            drivers = (*own, *self.loads)
        elif name in ("tension", "pull") and not self.has_winches:
            drivers = (f"{SPEEDS[0]}_{number}",)
        output = self._numbered("cable", number, name)._replace(depends_on=drivers)
        return output if output.rate_of is None else output._replace(rate_of=f"{output.rate_of}_{number}")

    def _drivers(self, names: Sequence[str], only: int | None = None) -> tuple[str, ...]:
        numbers = self.numbers if only is None else (only,)
        return tuple(f"{name}_{number}" for number in numbers for name in names)

    def _numbered(self, kind: str, number: int, name: str) -> Variable:
        variables = {variable.name: variable for variable in self.components[f"{kind}_{number}"].variables}
        variable = variables[name]
        return variable._replace(name=f"{name}_{number}", description=f"cable {number}: {variable.description}")


def _vector(slave: Slave, name: str) -> list[Variable]:
    """Components of a vector of a platform; none where it has no such vector."""
    return [variable for variable in slave.variables if variable.name.partition(".")[0] == name]


def _in_component(component: str, variable: Variable) -> Variable:
    text = f"{component.replace('_', ' ')}: {variable.description}"
    return variable._replace(name=f"{component}.{variable.name}", description=text)
