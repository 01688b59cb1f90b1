"""What a sensor has seen, as far back as it lags: pieces of polynomials between communication points."""

from typing import NamedTuple, Sequence, Tuple

from .interpolation import cubic, quintic

Pieces = Tuple[Tuple[float, ...], ...]


class Seen(NamedTuple):
    """Of one signal at an instant: value and rate, or value, rate and curvature."""

    time: float
    numbers: Sequence[float]


def remember(past: Pieces, begin: Seen, end: Seen, lag: float) -> Pieces:
    """The past with one more piece, without those that have lagged out."""
    piece = (begin.time, end.time, *begin.numbers, *end.numbers)
    return (*(old for old in past if old[1] >= end.time - lag), piece)


def seen(past: Pieces, lag: float) -> Tuple[float, float]:
    """Value and rate of the signal a lag (s) before the end of its past; before its begin it rests."""
    time = past[-1][1] - lag
    begin, end, *numbers = next((piece for piece in past if time <= piece[1]), past[-1])
    count = len(numbers) // 2
    if time < begin:
        return numbers[0], 0.0
    polynomial = cubic if count == 2 else quintic
    value, rate, *_ = polynomial(numbers[:count], numbers[count:], end - begin, (time - begin) / (end - begin))
    return value, rate
