"""Step rejection: a macro step whose iterations diverge, or that an FMU discards, is halved and tried again.

If a step is too long for its coupling, the iterations have no solution to converge to, and their last result is
arbitrary. The standard lets an FMU that discards a step roll back to a saved state and try a shorter one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .checkpoint import Checkpoint
from .component import ComponentError
from .coupling import Coupling

Array = NDArray[np.float64]
ExternalInputs = Callable[[float, float], tuple[Array, Array]]

MAX_HALVINGS = 4


def step_with_rejection(
    coupling: Coupling, time: float, step: float, external_inputs: ExternalInputs
) -> tuple[float, Checkpoint]:
    """A step from ``time``, halved until it does not diverge; returns its length and the checkpoint of its beginning.

    ``external_inputs(time, step)`` returns the external inputs at both ends. All FMUs have to support rollback; the
    checkpoint has to be released. The shortest step is accepted even if it diverges.

    Raises ComponentError where an FMU fails even in the shortest step: the first error, that of the whole step.
    """
    first_error: ComponentError | None = None
    for _ in range(MAX_HALVINGS):
        try:
            checkpoint = _attempt_step(coupling, time, step, external_inputs)
        except ComponentError as error:
            if not error.is_recoverable:
                raise
            first_error = first_error or error
        else:
            if not coupling.diverged:
                return step, checkpoint
            coupling.restore(checkpoint)
            coupling.release(checkpoint)
        step *= 0.5
    try:
        return step, _attempt_step(coupling, time, step, external_inputs)
    except ComponentError as error:
        raise first_error or error from error


def _attempt_step(coupling: Coupling, time: float, step: float, external_inputs: ExternalInputs) -> Checkpoint:
    checkpoint = coupling.attempt_step(time, step, *external_inputs(time, step))
    assert checkpoint is not None
    return checkpoint
