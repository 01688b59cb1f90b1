"""One macro step with step rejection and with state events located as zero crossings.

If a step is too long for its coupling, the iterations have no solution to converge to, and their last result is
arbitrary. The standard lets an FMU that discards a step roll back to a saved state and try a shorter one.

Between events outputs are smooth and a step has its full order. A step over an event has only order two, however it is
iterated: the polynomial through value and derivative at both ends has no kink.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ..fmus.component import ComponentError
from .coupling_solver import CouplingSolver
from .coupling_state import Checkpoint

Array = NDArray[np.float64]
ExternalInputs = Callable[[float, float], tuple[Array, Array]]

MAX_HALVINGS = 4


def step_with_rejection(
    coupling: CouplingSolver, time: float, step: float, external_inputs: ExternalInputs
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
            if not coupling.state.diverged:
                return step, checkpoint
            coupling.restore(checkpoint)
            coupling.release(checkpoint)
        step *= 0.5
    try:
        return step, _attempt_step(coupling, time, step, external_inputs)
    except ComponentError as error:
        raise first_error or error from error


def _attempt_step(coupling: CouplingSolver, time: float, step: float, external_inputs: ExternalInputs) -> Checkpoint:
    checkpoint = coupling.attempt_step(time, step, *external_inputs(time, step))
    assert checkpoint is not None
    return checkpoint


# An event nearer than this (s) is stepped over; the error is of second order in it.
EVENT_WIDTH = 1e-6
EVENT_LOCATION_TOLERANCE = 0.2 * EVENT_WIDTH
MAX_SUBSTEPS = 40
# Relative to the remaining step: no substep leaves less.
MIN_REMAINING_SHARE = 1e-6
LANDING_RTOL = 1e-3


def step_with_events(coupling: CouplingSolver, time: float, step: float, external_inputs: ExternalInputs) -> float:
    """One macro step from ``time``, split at events and where it is rejected, if FMUs support rollback.

    ``external_inputs(time, step)`` returns the external inputs at both ends. Two zero crossings of one indicator within
    a step are not seen. The step that lands at an event, and what remains after ``MAX_SUBSTEPS``, are never rejected.
    Returns the length of the first substep: ``step`` where it was not split.
    """
    if not (coupling.graph.supports_rollback and coupling.graph.supports_variable_step):
        coupling.step(time, step, *external_inputs(time, step))
        return step
    elapsed, first_length, max_substep = 0.0, step, step
    for _ in range(MAX_SUBSTEPS):
        remaining = step - elapsed
        substep = remaining if max_substep > (1.0 - MIN_REMAINING_SHARE) * remaining else max_substep
        advanced, rejected = _step_to_event(coupling, time + elapsed, substep, external_inputs)
        first_length = first_length if elapsed else advanced
        if advanced == remaining:
            return first_length
        elapsed += advanced
        max_substep = advanced if rejected else 2.0 * max_substep
    coupling.step(time + elapsed, step - elapsed, *external_inputs(time + elapsed, step - elapsed))
    return first_length


def _step_to_event(
    coupling: CouplingSolver, time: float, step: float, external_inputs: ExternalInputs
) -> tuple[float, bool]:
    """Step to just before the first event, or over a near one; returns the length, and whether a step was rejected."""
    signs = np.sign(coupling.event_indicators())
    accepted_step, checkpoint = step_with_rejection(coupling, time, step, external_inputs)
    rejected, step = accepted_step < step, accepted_step
    try:
        end_indicators = coupling.event_indicators()
        changed = np.flatnonzero(np.sign(end_indicators) != signs)
        if not len(changed) or step <= 2.0 * EVENT_WIDTH:
            return step, rejected

        def indicators_after(span: float) -> Array:
            coupling.restore(checkpoint)
            coupling.step(time, span, *external_inputs(time, span))
            return coupling.event_indicators()

        step_before_event = _land_before_event(indicators_after, step, signs, end_indicators, changed)
        if step_before_event > EVENT_WIDTH:
            return step_before_event, rejected
        indicators_after(2.0 * EVENT_WIDTH)
        coupling.reset_history(time + 2.0 * EVENT_WIDTH)
        return 2.0 * EVENT_WIDTH, rejected
    finally:
        coupling.release(checkpoint)


def _land_before_event(
    indicators_after: Callable[[float], Array],
    step: float,
    signs: Array,
    end_indicators: Array,
    changed: NDArray[np.intp],
) -> float:
    """Step to just before the first event; returns the length, zero where that is less than ``EVENT_WIDTH``.

    Near an event a step can have two solutions, one on either side; hence the retreat from the zero crossing.
    """
    begin_indicators = indicators_after(EVENT_WIDTH)
    if np.any(np.sign(begin_indicators) != signs):
        return 0.0
    step_end, retreat = step, 0.0
    while True:
        xtol = max(LANDING_RTOL * step_end, EVENT_LOCATION_TOLERANCE)
        if step_end - EVENT_WIDTH <= xtol:
            indicators_after(EVENT_WIDTH)
            return 0.0
        known_indicators = {EVENT_WIDTH: begin_indicators, step_end: end_indicators}
        crossing = min(_zero_crossing(indicators_after, known_indicators, int(index), xtol) for index in changed)
        # Never further back than half of the remaining span, so that the loop terminates.
        retreat = max(xtol, 4.0 * retreat)
        step_end = max(crossing - retreat, 0.5 * (EVENT_WIDTH + crossing))
        end_indicators = indicators_after(step_end)
        changed = np.flatnonzero(np.sign(end_indicators) != signs)
        if not len(changed):
            return step_end


def _zero_crossing(
    indicators_after: Callable[[float], Array], known_indicators: Mapping[float, Array], index: int, xtol: float
) -> float:
    """Locates a zero crossing of the indicator at ``index`` to ``xtol`` (s), between two spans at which it is known."""

    def indicator(span: float) -> float:
        return float((known_indicators[span] if span in known_indicators else indicators_after(span))[index])

    return float(brentq(indicator, min(known_indicators), max(known_indicators), xtol=xtol))
