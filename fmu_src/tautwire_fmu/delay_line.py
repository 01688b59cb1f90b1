"""Delay line of a sensor signal: Hermite segments between communication points, as far back as the sensor lags."""

from typing import NamedTuple, Sequence, Tuple

from .hermite_quadrature import cubic_hermite, quintic_hermite

DelayLine = Tuple[Tuple[float, ...], ...]


class SignalSample(NamedTuple):
    """One sample of a signal: value and rate, or value, rate and curvature, at an instant."""

    time: float
    derivatives: Sequence[float]


def append_segment(delay_line: DelayLine, start: SignalSample, end: SignalSample, lag: float) -> DelayLine:
    """Delay line with one more segment, without those older than the lag."""
    segment = (start.time, end.time, *start.derivatives, *end.derivatives)
    return (*(old for old in delay_line if old[1] >= end.time - lag), segment)


def delayed_value(delay_line: DelayLine, lag: float) -> Tuple[float, float]:
    """Value and rate of the signal a lag (s) before the end of its delay line; constant before its start."""
    time = delay_line[-1][1] - lag
    start, end, *derivatives = next((piece for piece in delay_line if time <= piece[1]), delay_line[-1])
    count = len(derivatives) // 2
    if time < start:
        return derivatives[0], 0.0
    polynomial = cubic_hermite if count == 2 else quintic_hermite
    value, rate, *_ = polynomial(derivatives[:count], derivatives[count:], end - start, (time - start) / (end - start))
    return value, rate
