"""Adaptive Runge-Kutta integration (Dormand and Prince) within a macro step.

States of effects may be stiff (relaxation in milliseconds) or nonsmooth (strands that stick again), so the inner steps
are chosen by an estimate of their error. The result depends on the arguments alone: a repeated step gives the same
bits.

Source: Dormand and Prince (1980), A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6(1), 19-26.
"""

from typing import Callable, List, Sequence, Tuple

from .hermite_quadrature import cubic_hermite

StateDerivative = Callable[[float, List[float]], List[float]]

STAGE_TIMES = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)
STAGE_WEIGHTS = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
)
SOLUTION_WEIGHTS = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
ERROR_WEIGHTS = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)

# RELATIVE_TOLERANCE and the bounds of one are in units of a state's scale, MIN_STEP_FRACTION in macro steps.
RELATIVE_TOLERANCE = 1e-9
MIN_RELATIVE_TOLERANCE, MAX_RELATIVE_TOLERANCE = 1e-12, 1e-4
MIN_STEP_FRACTION = 1e-6
SAFETY_FACTOR, MIN_STEP_FACTOR, MAX_STEP_FACTOR = 0.9, 0.1, 5.0


def integrate_dormand_prince(
    rates: StateDerivative,
    start: Sequence[float],
    scales: Sequence[float],
    step: float,
    relative_tolerance: float = RELATIVE_TOLERANCE,
) -> Tuple[List[float], List[float]]:
    """Integrate over a macro step; returns the states in the middle of the step and at its end.

    ``rates(fraction, states)`` gives the rates after a fraction of the step, in 1/s of each state's unit; ``scales``
    are sizes of the states: the estimated error of an inner step is less than ``relative_tolerance`` times them, except
    in inner steps of a millionth of ``step`` (s). The middle is interpolated by the Hermite cubic of its inner step.
    """
    state, slope = list(start), rates(0.0, list(start))
    middle = state
    completed_fraction, step_fraction = 0.0, 1.0
    while completed_fraction < 1.0:
        step_fraction = min(step_fraction, 1.0 - completed_fraction)
        next_state, next_slope, errors = _trial_step(rates, state, slope, step, completed_fraction, step_fraction)
        error = max(abs(e) / scale for e, scale in zip(errors, scales)) / relative_tolerance
        if error > 1.0 and step_fraction > MIN_STEP_FRACTION:
            step_fraction = max(MIN_STEP_FRACTION, step_fraction * max(MIN_STEP_FACTOR, SAFETY_FACTOR * error**-0.2))
            continue
        next_fraction = completed_fraction + step_fraction if step_fraction < 1.0 - completed_fraction else 1.0
        if completed_fraction < 0.5 <= next_fraction:
            middle_fraction = (0.5 - completed_fraction) / step_fraction
            pairs = zip(zip(state, slope), zip(next_state, next_slope))
            middle = [cubic_hermite(begin, end, step_fraction * step, middle_fraction)[0] for begin, end in pairs]
        state, slope, completed_fraction = next_state, next_slope, next_fraction
        step_fraction *= MAX_STEP_FACTOR if error == 0.0 else min(MAX_STEP_FACTOR, SAFETY_FACTOR * error**-0.2)
    return middle, state


def _trial_step(
    rates: StateDerivative,
    state: List[float],
    slope: List[float],
    step: float,
    completed_fraction: float,
    step_fraction: float,
) -> Tuple[List[float], List[float], List[float]]:
    """One trial step: states and rates after it, and the estimated errors of the states."""
    h = step_fraction * step
    slopes = [slope]
    for node, weights in zip(STAGE_TIMES, STAGE_WEIGHTS):
        slopes.append(rates(completed_fraction + node * step_fraction, _weighted_sum(state, slopes, weights, h)))
    next_state = _weighted_sum(state, slopes, SOLUTION_WEIGHTS, h)
    slopes.append(rates(completed_fraction + step_fraction, next_state))
    return next_state, slopes[-1], _weighted_sum([0.0] * len(state), slopes, ERROR_WEIGHTS, h)


def _weighted_sum(state: List[float], slopes: Sequence[List[float]], weights: Sequence[float], h: float) -> List[float]:
    return [s + h * sum(w * k for w, k in zip(weights, column)) for s, column in zip(state, zip(*slopes))]
