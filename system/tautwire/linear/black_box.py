"""Linearisation of black-box FMUs by pulse experiments, of any wired system and of a robot's FMUs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import formula
from tautwire_fmu.laws.effects import BY_NAME

from ..cosimulation import Port
from ..cosimulation.robot_cosimulation import AdditionalComponents, instantiate_robot, wire_fmus
from ..cosimulation.robot_wiring import PLATFORM, cable_name, winch_name
from ..errors import InputError
from ..fmus.fmu_archive import read_model_description
from ..fmus.packaging import RobotFmus
from ..robot.schema import AXES
from .pulse_experiments import (
    DRIFT_NOTE_LEVEL,
    NONSMOOTH_NOTE_LEVEL,
    CouplingFactory,
    IdentificationError,
    Responses,
    pulse_experiment,
)
from .realisation import SignalIndices, StateSpaceMatrices
from .step_refinement import MAX_RELATIVE_ERROR, refine_step

Array = NDArray[np.float64]

DEFAULT_STEP = 0.02
DEFAULT_TOLERANCE = 1e-6
INPUT_VARIABLES = ("winch_speed", "speed_command")
OUTPUT_VARIABLES = ("position", "measured_position", "velocity", "angular_velocity", "tension", "length", "winch_speed")
EXTERNAL_VARIABLES = ("external_force", "external_moment")
EFFECT_PREFIX = "effect."
MEASURED_PREFIX = "measured_"


@dataclass(frozen=True)
class BlackBoxPlant:
    """A system of FMUs linearised about its operating point; all signals are deviations from there.

    ``system`` is a continuous ``control.StateSpace`` with named signals. ``error`` is the estimated relative
    error of its matrices, in the norm of :func:`linearise_fmus`; ``step`` (s) is the shortest macro step taken.
    ``state_amplitudes`` and ``input_amplitudes`` are the largest deviations of states and inputs in the experiments.
    ``notes`` describe nonsmooth behaviour, one line each.
    """

    system: Any
    step: float
    error: float
    state_amplitudes: Array
    input_amplitudes: Array
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlantSignals:
    """Ports of a system of FMUs by the plant's signal names.

    ``inputs`` are some of its external inputs, ``outputs`` any variables of its FMUs, ``states`` those variables,
    outputs or locals, that are its states, None where they are not shown.
    """

    inputs: Mapping[str, Port]
    outputs: Mapping[str, Port]
    states: Mapping[str, Port] | None = None


def linearise_fmus(
    make_coupling: CouplingFactory,
    signals: PlantSignals,
    rest_inputs: Mapping[Port, float] | None = None,
    step: float = DEFAULT_STEP,
    tolerance: float = DEFAULT_TOLERANCE,
) -> BlackBoxPlant:
    """Linearises any coupled system of black-box FMUs about its start, where it rests, by pulse experiments.

    ``make_coupling()`` returns a context with the :class:`tautwire.cosimulation.CouplingGraph` of FMUs in
    initialization mode. Without states in ``signals`` they are coordinates ``x_1`` ..., as few as the responses need.
    ``rest_inputs`` are the external inputs at rest, zero by default. External inputs that are rates of others are not
    inputs here: they stay constant.

    From the state at rest each input gets a pulse of one macro step, up and down, and the free response afterwards
    gives the transition matrix of one step; its logarithm over the step is A. That is repeated with half the step,
    beginning with ``step`` (s), and extrapolated to zero, until the matrices change by less than ``tolerance``. The
    norm is that of Frobenius for A, B, C and D in turn, each relative to itself, with every state, input and output in
    units of its largest deviation in the experiments; without named states, for the frequency response in these
    units, over three decades below a turn of half a radian a step.

    Requirements on an FMU: its start is at rest, and its behaviour over a step follows from its state and its inputs,
    without dead time. Saved states are used if all FMUs support them and steps of any length; otherwise all restart for
    each pulse, and take steps of one length until the next.
    Uncontrollable and unobservable states are not identified.

    Raises IdentificationError where the system is not at rest, or is not smooth there, the named states are
    incomplete, or no step is short enough; ComponentError where an FMU fails.
    """
    observed_ports, indices = _observed_signals(signals)
    input_ports = list(signals.inputs.values())
    with pulse_experiment(make_coupling, rest_inputs or {}, input_ports, observed_ports) as experiment:
        refined = refine_step(experiment, indices, step, tolerance)
    matrices = refined.matrices
    if matrices.residual > MAX_RELATIVE_ERROR:
        raise IdentificationError(
            f"the states leave {matrices.residual:.2g} of the responses unexplained",
            "name all states, or none, so that they are found",
        )
    return BlackBoxPlant(
        _state_space(matrices, signals),
        refined.step,
        refined.error,
        matrices.state_scales,
        refined.responses.amplitudes,
        _operating_point_notes(list(signals.inputs), observed_ports, refined.responses),
    )


def _observed_signals(signals: PlantSignals) -> tuple[list[Port], SignalIndices]:
    """The ports to record, each once, and where the plant's outputs and states are among them."""
    states = signals.states or {}
    observed_ports = list(dict.fromkeys([*signals.outputs.values(), *states.values()]))
    return observed_ports, SignalIndices(
        outputs=tuple(observed_ports.index(port) for port in signals.outputs.values()),
        states=tuple(observed_ports.index(port) for port in states.values()) or None,
        state_names=tuple(states),
    )


def _state_space(matrices: StateSpaceMatrices, signals: PlantSignals) -> Any:
    """The plant as ``control.StateSpace`` with named signals; unnamed states are ``x_1`` ..."""
    return control.ss(
        *(getattr(matrices, name) for name in "ABCD"),
        states=list(signals.states or {}) or [f"x_{k}" for k in range(1, len(matrices.A) + 1)],
        inputs=list(signals.inputs),
        outputs=list(signals.outputs),
        name="black_box",
    )


def _operating_point_notes(
    inputs: Sequence[str], observed_ports: Sequence[Port], responses: Responses
) -> tuple[str, ...]:
    notes = [
        f"nonsmooth at rest: responses to pulses of {name} up and down differ by {evenness:.0%}, however small"
        for name, evenness in zip(inputs, responses.nonlinearity, strict=True)
        if evenness > NONSMOOTH_NOTE_LEVEL
    ]
    worst = int(np.argmax(responses.drifts))
    if responses.drifts[worst] > DRIFT_NOTE_LEVEL:
        notes.append(f"not quite at rest: {observed_ports[worst]} drifts, and the plant is linearised about this drift")
    return tuple(notes)


def robot_signals(fmus: RobotFmus) -> PlantSignals:
    """The signals of :func:`tautwire.linear.linearise` in a robot's FMUs, and the states of the winches.

    Of a user's platform the states are its motion, of a user's winch its speed; there are none if a cable is a user's
    FMU, or the platform a rigid body, whose quaternion has one number too many. Winch FMUs have the input
    ``speed_command_i`` and the output ``winch_speed_i``; an external force and moment are inputs if the platform has
    them. Outputs that an FMU lacks are left out.
    """
    wiring = wire_fmus(fmus)
    platform = read_model_description(fmus.platform)
    variable_names = {variable.name for variable in platform.modelVariables}
    wrench_ports = [Port(PLATFORM, f"{name}.{axis}") for name in EXTERNAL_VARIABLES for axis in AXES]
    inputs = [port for port in wiring.external_inputs if port.variable in INPUT_VARIABLES] + [
        p for p in wrench_ports if p.variable in variable_names
    ]
    outputs = [port for port in wiring.outputs if port.variable.partition(".")[0] in OUTPUT_VARIABLES]
    has_hidden_states = fmus.is_rigid or any(cable in fmus.user_start_values for cable in _cable_names(fmus))
    return PlantSignals(
        inputs={_signal_name(port): port for port in inputs},
        outputs={_signal_name(port): port for port in outputs},
        states=None if has_hidden_states else _state_ports(fmus),
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
    force_ports = tuple(port for port in signals.inputs.values() if port.component == PLATFORM)
    if states is not None:
        signals = replace(signals, states=_select_states(states, signals.states or {}))
    make_coupling = partial(instantiate_robot, fmus, additional=AdditionalComponents(external_inputs=force_ports))
    return linearise_fmus(make_coupling, signals, step=step, tolerance=tolerance)


def _select_states(names: Sequence[str], known: Mapping[str, Port]) -> dict[str, Port]:
    for name in names:
        if name not in known:
            raise InputError("states", f"no FMU outputs a state {name!r}", f"choose among {', '.join(known)}")
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
