"""Iterated update of an extended Kalman filter at a recording's first sample: where the filter is linearised there.

Where the start is known badly beside what the sensors show, outputs bend between its prior mean and what it is. With
the prior's mean ``m`` and covariance ``P``, measured outputs ``y``, their function ``h`` of the state ``x`` with slopes
``H``, and noise ``R``, Gauss-Newton steps

    x <- m + P H' (H P H' + R)^-1 (y - h - H (m - x))

end at the maximum of the posterior density. The first is the update of an ordinary extended Kalman filter.

Source: Bell and Cathey (1993), The iterated Kalman filter update as a Gauss-Newton method, IEEE Transactions on
Automatic Control 38(2), 294-297.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .compiled_filter import CompiledFilter, FilterInputs, FilterState

Array = NDArray[np.float64]

# Four are usual; at a kink, where a rope goes slack, they end beside it.
MAX_STEPS = 10
# Prior standard deviations, of the step after which none follows.
STEP_TOLERANCE = 1e-9


def with_iterated_update(functions: CompiledFilter, inputs: FilterInputs, prior: FilterState) -> FilterState:
    """The prior with its state where the first sample's outputs are to be linearised.

    They are linear in the states of a disturbance, which stay. The prior as it is where a step leads nowhere.
    """
    size = functions.model.states.numel()
    state, deviations = prior.state.copy(), np.sqrt(np.diag(prior.covariance)[:size])
    is_uncertain = deviations > 0.0
    for _ in range(MAX_STEPS):
        step = (_updated(functions, inputs, prior, state) - state)[:size]
        if not np.all(np.isfinite(step)):
            return prior
        state[:size] += step
        if np.all(np.abs(step[is_uncertain]) < STEP_TOLERANCE * deviations[is_uncertain]):
            break
    return replace(prior, state=state, prior_offset=prior.state - state)


def _updated(functions: CompiledFilter, inputs: FilterInputs, prior: FilterState, state: Array) -> Array:
    """The state after an update with outputs linearised at another one; NaN where an exact output is predicted so."""
    is_observed = inputs.columns[1][:, 0] > 0.0
    expected, by_state = (each[is_observed] for each in functions.first_outputs(state, inputs))
    error = inputs.columns[0][is_observed, 0] - expected - by_state @ (prior.state - state)
    cross = prior.covariance @ by_state.T
    variances = by_state @ cross + np.diag(inputs.white_variances[is_observed])
    try:
        updated: Array = prior.state + cross @ np.linalg.solve(variances, error)
    except np.linalg.LinAlgError:
        return np.full(len(prior.state), np.nan)
    return updated
