"""Integration within a macro step, in inner steps as short as the states ask for.

States of effects may be fast (relaxation in milliseconds) or bend (strands that stick again), so the steps are chosen
by an estimate of their error. What comes out depends on nothing but the arguments: a redo gives the same bits.

Source: Dormand and Prince (1980), A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6(1), 19-26.
"""

from typing import Callable, List, Sequence, Tuple

from .interpolation import cubic

Rates = Callable[[float, List[float]], List[float]]

NODES = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)
WEIGHTS = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
)
LAST = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)

# Shares of a state's scale, and of the macro step.
TOLERANCE = 1e-9
SHORTEST = 1e-6
SAFETY, SLOWEST, FASTEST = 0.9, 0.1, 5.0


def integrate(
    rates: Rates, start: Sequence[float], scales: Sequence[float], step: float
) -> Tuple[List[float], List[float]]:
    """States in the middle of a step and at its end.

    ``rates(fraction, states)`` gives the rates after a fraction of the step, in 1/s of each state's unit; ``scales``
    are sizes of the states of which the estimated error of an inner step is less than a billionth, except in inner
    steps of a millionth of ``step`` (s). The middle lies on the cubic of its inner step.
    """
    state, slope = list(start), rates(0.0, list(start))
    middle = state
    done, width = 0.0, 1.0
    while done < 1.0:
        width = min(width, 1.0 - done)
        after, slope_after, error = _attempt(rates, state, slope, scales, step, done, width)
        if error > 1.0 and width > SHORTEST:
            width = max(SHORTEST, width * max(SLOWEST, SAFETY * error**-0.2))
            continue
        ends = done + width if width < 1.0 - done else 1.0
        if done < 0.5 <= ends:
            share = (0.5 - done) / width
            pairs = zip(zip(state, slope), zip(after, slope_after))
            middle = [cubic(begin, end, width * step, share)[0] for begin, end in pairs]
        state, slope, done = after, slope_after, ends
        width *= FASTEST if error == 0.0 else min(FASTEST, SAFETY * error**-0.2)
    return middle, state


def _attempt(
    rates: Rates,
    state: List[float],
    slope: List[float],
    scales: Sequence[float],
    step: float,
    done: float,
    width: float,
) -> Tuple[List[float], List[float], float]:
    """States and rates after one inner step, and its error in units of the tolerance."""
    h = width * step
    slopes = [slope]
    for node, weights in zip(NODES, WEIGHTS):
        slopes.append(rates(done + node * width, _moved(state, slopes, weights, h)))
    after = _moved(state, slopes, LAST, h)
    slopes.append(rates(done + width, after))
    errors = _moved([0.0] * len(state), slopes, ERROR, h)
    worst = max(abs(e) / scale for e, scale in zip(errors, scales)) / TOLERANCE
    return after, slopes[-1], worst


def _moved(state: List[float], slopes: Sequence[List[float]], weights: Sequence[float], h: float) -> List[float]:
    return [s + h * sum(w * k for w, k in zip(weights, column)) for s, column in zip(state, zip(*slopes))]
