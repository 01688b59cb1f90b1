"""The linear plant of a wired system of FMUs that are black boxes: from saved states, small pulses and small steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from ..master import Port
from .experiments import DRIFT, KINK, IdentificationError, Make, Responses, on_bench
from .realisation import Signals
from .refinement import WORST, refine

Array = NDArray[np.float64]

STEP = 0.02
ERROR = 1e-6


@dataclass(frozen=True)
class BlackBoxPlant:
    """A wired system of FMUs linearised about rest; all signals are deviations from there.

    ``system`` is a continuous ``control.StateSpace`` with named signals. ``error`` is how much its matrices are off
    by estimate, relative, in the norm of :func:`linearise_fmus`; ``step`` (s) is the shortest macro step taken.
    ``state_sizes`` and ``pushes`` are the largest deviations of states and inputs in the experiments. ``notes`` tell
    of kinks, a line each.
    """

    system: Any
    step: float
    error: float
    state_sizes: Array
    pushes: Array
    notes: tuple[str, ...] = ()


def linearise_fmus(
    make: Make,
    inputs: Mapping[str, Port],
    outputs: Mapping[str, Port],
    states: Mapping[str, Port] | None = None,
    rest: Mapping[Port, float] | None = None,
    step: float = STEP,
    error: float = ERROR,
) -> BlackBoxPlant:
    """Linearise any wired system of FMUs about its start, where it rests, without looking inside.

    ``make()`` gives a context with the :class:`tautwire.master.Coupling` in initialization mode. ``inputs`` name some
    of its drives, ``outputs`` any variables of its FMUs, ``states`` those variables, outputs or locals, that are its
    states; without them the states are coordinates ``x_1`` ..., as few as the responses need. ``rest`` are the values
    of the drives at rest, zero where none is given. Drives that are rates of others are no inputs: they stay as they
    are.

    From the state at rest each input is pushed for one macro step, up and down, and the free motion afterwards gives
    the map from one step to the next; its logarithm over the step is A. That is repeated with half the step,
    beginning with ``step`` (s), and extrapolated to none, until the matrices change by less than ``error``. The norm
    is that of Frobenius for A, B, C and D in turn, each relative to itself, with every state, input and output in
    units of its largest deviation in the experiments; without named states, for the frequency response in these
    units, over three decades below a turn of half a radian a step.

    What an FMU must offer: its start is at rest; what it does over a step follows from its state and its inputs,
    without dead time. Saved states serve, where all FMUs have them; otherwise all start anew for each pulse. A state
    that no input moves or no output shows is not found, and not missed.

    Raises IdentificationError where the system is not at rest, or at a kink, the named states do not tell all, or no
    step is short enough; ComponentError where an FMU fails.
    """
    names = tuple(states or ())
    seen = list(dict.fromkeys([*outputs.values(), *(states or {}).values()]))
    signals = Signals(
        outputs=tuple(seen.index(port) for port in outputs.values()),
        states=None if states is None else tuple(seen.index(port) for port in states.values()),
        state_names=names,
    )
    with on_bench(make, rest or {}, list(inputs.values()), seen) as bench:
        found = refine(bench, signals, step, error)
    matrices = found.matrices
    if matrices.residual > WORST:
        raise IdentificationError(
            f"the states leave {matrices.residual:.2g} of the responses unexplained",
            "name all states, or none, so that they are found",
        )
    system = control.ss(
        *(getattr(matrices, name) for name in "ABCD"),
        states=list(names) or [f"x_{k}" for k in range(1, len(matrices.A) + 1)],
        inputs=list(inputs),
        outputs=list(outputs),
        name="black_box",
    )
    return BlackBoxPlant(
        system,
        found.step,
        found.error,
        matrices.sizes,
        found.responses.pushes,
        _notes(list(inputs), seen, found.responses),
    )


def _notes(inputs: Sequence[str], seen: Sequence[Port], responses: Responses) -> tuple[str, ...]:
    kinks = [
        f"a kink at rest: what {name} does upward and downward differs by {evenness:.0%}, however small the push"
        for name, evenness in zip(inputs, responses.evenness, strict=True)
        if evenness > KINK
    ]
    worst = int(np.argmax(responses.drifts))
    if responses.drifts[worst] > DRIFT:
        kinks.append(f"not quite at rest: {seen[worst]} moves by itself, and the plant is that about this motion")
    return tuple(kinks)
