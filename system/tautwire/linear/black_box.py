"""Linearisation of a system of black-box FMUs: pulse responses from saved states with small macro steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..master import Port
from .experiments import (
    DRIFT_NOTE_LEVEL,
    NONSMOOTH_NOTE_LEVEL,
    CouplingFactory,
    IdentificationError,
    Responses,
    pulse_experiment,
)
from .realisation import SignalIndices
from .refinement import MAX_RELATIVE_ERROR, refine_step

Array = NDArray[np.float64]

DEFAULT_STEP = 0.02
DEFAULT_TOLERANCE = 1e-6


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


def linearise_fmus(
    make_coupling: CouplingFactory,
    inputs: Mapping[str, Port],
    outputs: Mapping[str, Port],
    states: Mapping[str, Port] | None = None,
    rest_inputs: Mapping[Port, float] | None = None,
    step: float = DEFAULT_STEP,
    tolerance: float = DEFAULT_TOLERANCE,
) -> BlackBoxPlant:
    """Linearises any coupled system of black-box FMUs about its start, where it rests, by pulse experiments.

    ``make_coupling()`` returns a context with the :class:`tautwire.cosimulation.Coupling` in initialization mode.
    ``inputs`` name some of its external inputs, ``outputs`` any variables of its FMUs, ``states`` those variables,
    outputs or locals, that are its states; without them the states are coordinates ``x_1`` ..., as few as the
    responses need. ``rest_inputs`` are the external inputs at rest, zero by default. External inputs that are rates of
    others are not inputs here: they stay constant.

    From the state at rest each input gets a pulse of one macro step, up and down, and the free response afterwards
    gives the transition matrix of one step; its logarithm over the step is A. That is repeated with half the step,
    beginning with ``step`` (s), and extrapolated to zero, until the matrices change by less than ``tolerance``. The
    norm is that of Frobenius for A, B, C and D in turn, each relative to itself, with every state, input and output in
    units of its largest deviation in the experiments; without named states, for the frequency response in these
    units, over three decades below a turn of half a radian a step.

    Requirements on an FMU: its start is at rest, and its behaviour over a step follows from its state and its inputs,
    without dead time. Saved states are used if all FMUs support them; otherwise all restart for each pulse.
    Uncontrollable and unobservable states are not identified.

    Raises IdentificationError where the system is not at rest, or is not smooth there, the named states are
    incomplete, or no step is short enough; ComponentError where an FMU fails.
    """
    state_names = tuple(states or ())
    observed_ports = list(dict.fromkeys([*outputs.values(), *(states or {}).values()]))
    signals = SignalIndices(
        outputs=tuple(observed_ports.index(port) for port in outputs.values()),
        states=None if states is None else tuple(observed_ports.index(port) for port in states.values()),
        state_names=state_names,
    )
    with pulse_experiment(make_coupling, rest_inputs or {}, list(inputs.values()), observed_ports) as experiment:
        refined = refine_step(experiment, signals, step, tolerance)
    matrices = refined.matrices
    if matrices.residual > MAX_RELATIVE_ERROR:
        raise IdentificationError(
            f"the states leave {matrices.residual:.2g} of the responses unexplained",
            "name all states, or none, so that they are found",
        )
    system = control.ss(
        *(getattr(matrices, name) for name in "ABCD"),
        states=list(state_names) or [f"x_{k}" for k in range(1, len(matrices.A) + 1)],
        inputs=list(inputs),
        outputs=list(outputs),
        name="black_box",
    )
    return BlackBoxPlant(
        system,
        refined.step,
        refined.error,
        matrices.state_scales,
        refined.responses.amplitudes,
        _operating_point_notes(list(inputs), observed_ports, refined.responses),
    )


def _operating_point_notes(
    inputs: Sequence[str], observed_ports: Sequence[Port], responses: Responses
) -> tuple[str, ...]:
    notes = [
        f"a kink at rest: what {name} does upward and downward differs by {evenness:.0%}, however small the push"
        for name, evenness in zip(inputs, responses.nonlinearity, strict=True)
        if evenness > NONSMOOTH_NOTE_LEVEL
    ]
    worst = int(np.argmax(responses.drifts))
    if responses.drifts[worst] > DRIFT_NOTE_LEVEL:
        notes.append(
            f"not quite at rest: {observed_ports[worst]} moves by itself, and the plant is that about this motion"
        )
    return tuple(notes)
