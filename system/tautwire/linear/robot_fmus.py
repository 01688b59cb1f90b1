"""Linearisation of a robot's FMUs as one black box, with the signals of the plant from the laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tautwire_fmu.laws import formula
from tautwire_fmu.laws.effects import BY_NAME

from ..errors import InputError
from ..fmus.packaging import RobotFmus
from ..master import Port
from ..master.archive import read_model_description
from ..runs.cosimulation import instantiate_robot, wire_fmus
from ..runs.wiring import AXES, PLATFORM, cable_name, winch_name
from .black_box import DEFAULT_STEP, DEFAULT_TOLERANCE, BlackBoxPlant, linearise_fmus

INPUT_VARIABLES = ("winch_speed", "speed_command")
OUTPUT_VARIABLES = ("position", "measured_position", "velocity", "tension", "length", "winch_speed")
EFFECT_PREFIX = "effect."
MEASURED_PREFIX = "measured_"


@dataclass(frozen=True)
class RobotSignals:
    """Ports of a robot's FMUs by the plant's signal names; ``states`` is None if a cable is a user's FMU.

    States are those of :func:`tautwire.linear.linearise` and of the winches; of a user's platform its motion, of a
    user's winch its speed.
    """

    inputs: dict[str, Port]
    outputs: dict[str, Port]
    states: dict[str, Port] | None


def robot_signals(fmus: RobotFmus) -> RobotSignals:
    """The signals of :func:`tautwire.linear.linearise` in a robot's FMUs.

    Winch FMUs have the input ``speed_command_i`` and the output ``winch_speed_i``; an external force is an input if
    the platform has one. Outputs that an FMU lacks are left out.
    """
    wiring = wire_fmus(fmus)
    platform = read_model_description(fmus.platform)
    variable_names = {variable.name for variable in platform.modelVariables}
    force_ports = [Port(PLATFORM, f"external_force.{axis}") for axis in AXES]
    inputs = [port for port in wiring.external_inputs if port.variable in INPUT_VARIABLES] + [
        p for p in force_ports if p.variable in variable_names
    ]
    outputs = [port for port in wiring.outputs if port.variable.partition(".")[0] in OUTPUT_VARIABLES]
    return RobotSignals(
        inputs={_signal_name(port): port for port in inputs},
        outputs={_signal_name(port): port for port in outputs},
        states=None if any(cable in fmus.user_start_values for cable in _cable_names(fmus)) else _state_ports(fmus),
    )


def linearise_robot_fmus(
    fmus: RobotFmus,
    states: Sequence[str] | None = None,
    step: float = DEFAULT_STEP,
    tolerance: float = DEFAULT_TOLERANCE,
) -> BlackBoxPlant:
    """Linearises a robot's FMUs about their start, where they rest; see :func:`linearise_fmus`.

    ``states`` selects by name among those of :func:`robot_signals`, such as the ``state_labels`` of the plant from the
    laws; by default all. With ``()`` the states are coordinates of their own, as needed for a user's FMU with hidden
    states.

    Raises InputError where a state is unknown, and what :func:`linearise_fmus` raises.
    """
    signals = robot_signals(fmus)
    force_ports = [port for port in signals.inputs.values() if port.component == PLATFORM]
    selected_states = signals.states if states is None else _select_states(states, signals.states or {})
    make_coupling = partial(instantiate_robot, fmus, external_inputs=force_ports)
    return linearise_fmus(
        make_coupling, signals.inputs, signals.outputs, selected_states or None, step=step, tolerance=tolerance
    )


def _select_states(names: Sequence[str], known: dict[str, Port]) -> dict[str, Port]:
    for name in names:
        if name not in known:
            raise InputError("states", f"no FMU shows a state {name!r}", f"choose among {', '.join(known)}")
    return {name: known[name] for name in names}


def _cable_names(fmus: RobotFmus) -> list[str]:
    return [cable_name(index) for index in range(1, len(fmus.cables) + 1)]


def _state_ports(fmus: RobotFmus) -> dict[str, Port]:
    motion = [Port(PLATFORM, f"{name}.{axis}") for name in ("position", "velocity") for axis in AXES]
    ropes = [Port(cable, "unstrained_length") for cable in _cable_names(fmus)]
    parts = {name: path for name, path in fmus.by_component.items() if name in (*_cable_names(fmus), PLATFORM)}
    effects = [Port(name, local) for name, path in parts.items() for local in _effect_states(path)]
    speeds = [Port(winch_name(i), "winch_speed") for i in fmus.winch_numbers]
    integrators = [
        Port(winch_name(i), "integral") for i in fmus.winch_numbers if winch_name(i) not in fmus.user_start_values
    ]
    return {_signal_name(port): port for port in (*motion, *ropes, *effects, *speeds, *integrators)}


def _effect_states(path: Path) -> list[str]:
    """The effect states of an FMU that have an equilibrium."""
    variables = read_model_description(path).modelVariables
    states = [(effect.name, state) for effect in BY_NAME.values() for state in effect.states]
    states += [(formula.FORMULA_EFFECT_NAME, state) for state in (formula.ENCODER_TRAVEL, formula.ELAPSED_TIME)]
    drifting = {f"{EFFECT_PREFIX}{name}.{state.name}" for name, state in states if state.drifts}
    locals_ = [v.name for v in variables if v.causality == "local" and v.name.startswith(EFFECT_PREFIX)]
    return [name for name in locals_ if name not in drifting]


def _signal_name(port: Port) -> str:
    """The name of a port's signal in the plant: ``cable_2.effect.relaxation.strain`` is ``relaxation_strain_2``."""
    _, _, number = port.component.partition("_")
    name = port.variable.removeprefix(EFFECT_PREFIX).removeprefix(MEASURED_PREFIX).replace(".", "_")
    return f"{name}_{number}" if number else name
