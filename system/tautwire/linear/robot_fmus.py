"""A robot's FMUs as one black box, with the signals of the plant that is made from the laws."""

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
from ..master.archive import description_of
from ..runs.cosimulation import instantiated, wired
from ..runs.wiring import AXES, PLATFORM, cable_name, winch_name
from .black_box import ERROR, STEP, BlackBoxPlant, linearise_fmus

DRIVEN = ("winch_speed", "speed_command")
SHOWN = ("position", "measured_position", "velocity", "tension", "length", "winch_speed")
EFFECT = "effect."
MEASURED = "measured_"


@dataclass(frozen=True)
class RobotSignals:
    """Ports of a robot's FMUs by the names of the plant's signals; ``states`` are None where a cable is the user's.

    States are those of :func:`tautwire.linear.linearise`, and those of winches; of a user's platform its motion, of a
    user's winch its speed.
    """

    inputs: dict[str, Port]
    outputs: dict[str, Port]
    states: dict[str, Port] | None


def robot_signals(fmus: RobotFmus) -> RobotSignals:
    """The signals of :func:`tautwire.linear.linearise` in a robot's FMUs.

    Winches that are FMUs are driven by ``speed_command_i`` and show ``winch_speed_i``; an external force is there if
    the platform takes one. Outputs that an FMU does not show are left out.
    """
    wiring = wired(fmus)
    platform = description_of(fmus.platform)
    there = {variable.name for variable in platform.modelVariables}
    pushed = [Port(PLATFORM, f"external_force.{axis}") for axis in AXES]
    inputs = [port for port in wiring.drives if port.variable in DRIVEN] + [p for p in pushed if p.variable in there]
    outputs = [port for port in wiring.shown if port.variable.partition(".")[0] in SHOWN]
    return RobotSignals(
        inputs={_signal(port): port for port in inputs},
        outputs={_signal(port): port for port in outputs},
        states=None if any(cable in fmus.own for cable in _cables(fmus)) else _states(fmus),
    )


def linearise_robot_fmus(
    fmus: RobotFmus, states: Sequence[str] | None = None, step: float = STEP, error: float = ERROR
) -> BlackBoxPlant:
    """Linearise a robot's FMUs about their start, where they rest; see :func:`linearise_fmus`.

    ``states`` choose by name among those of :func:`robot_signals`, such as the ``state_labels`` of the plant from the
    laws; by default all. None at all, ``()``, gives the states coordinates of their own, which a user's FMU with
    states that it does not show needs.

    Raises InputError where a state is unknown, and what :func:`linearise_fmus` raises.
    """
    signals = robot_signals(fmus)
    also = [port for port in signals.inputs.values() if port.component == PLATFORM]
    chosen = signals.states if states is None else _chosen(states, signals.states or {})
    make = partial(instantiated, fmus, also=also)
    return linearise_fmus(make, signals.inputs, signals.outputs, chosen or None, step=step, error=error)


def _chosen(names: Sequence[str], known: dict[str, Port]) -> dict[str, Port]:
    for name in names:
        if name not in known:
            raise InputError("states", f"no FMU shows a state {name!r}", f"choose among {', '.join(known)}")
    return {name: known[name] for name in names}


def _cables(fmus: RobotFmus) -> list[str]:
    return [cable_name(index) for index in range(1, len(fmus.cables) + 1)]


def _states(fmus: RobotFmus) -> dict[str, Port]:
    motion = [Port(PLATFORM, f"{name}.{axis}") for name in ("position", "velocity") for axis in AXES]
    ropes = [Port(cable, "unstrained_length") for cable in _cables(fmus)]
    parts = {name: path for name, path in fmus.parts.items() if name in (*_cables(fmus), PLATFORM)}
    effects = [Port(name, local) for name, path in parts.items() for local in _effect_states(path)]
    speeds = [Port(winch_name(i), "winch_speed") for i in fmus.winch_numbers]
    loops = [Port(winch_name(i), "integral") for i in fmus.winch_numbers if winch_name(i) not in fmus.own]
    return {_signal(port): port for port in (*motion, *ropes, *effects, *speeds, *loops)}


def _effect_states(path: Path) -> list[str]:
    """The states of effects in an FMU that settle where the robot rests."""
    variables = description_of(path).modelVariables
    states = [(effect.name, state) for effect in BY_NAME.values() for state in effect.states]
    states += [(formula.NAME, state) for state in (formula.TRAVEL, formula.TIME)]
    drifting = {f"{EFFECT}{name}.{state.name}" for name, state in states if state.drifts}
    locals_ = [v.name for v in variables if v.causality == "local" and v.name.startswith(EFFECT)]
    return [name for name in locals_ if name not in drifting]


def _signal(port: Port) -> str:
    """The name of a port's signal in the plant: ``cable_2.effect.relaxation.strain`` is ``relaxation_strain_2``."""
    _, _, number = port.component.partition("_")
    name = port.variable.removeprefix(EFFECT).removeprefix(MEASURED).replace(".", "_")
    return f"{name}_{number}" if number else name
