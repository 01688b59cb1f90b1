"""The mathematics that the laws are handed: the functions of one kind of number.

A law calls ``m.log(x)``, never ``math.log(x)``, so the same source runs on floats inside an FMU, on complex
numbers for exact rates, and on arrays or symbols outside. Kinks are written with ``m.maximum``, ``m.absolute`` and
``m.where`` for the same reason.
"""

import cmath
import math
from typing import Any, Callable, List, NamedTuple, Sequence, Tuple


class Mathematics(NamedTuple):
    """The functions that a law may use, for one kind of number.

    ``where(condition, a, b)`` takes ``condition`` as a number: positive chooses ``a``.
    """

    log: Callable[[Any], Any]
    exp: Callable[[Any], Any]
    sqrt: Callable[[Any], Any]
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    tanh: Callable[[Any], Any]
    atan2: Callable[[Any, Any], Any]
    absolute: Callable[[Any], Any]
    maximum: Callable[[Any, Any], Any]
    where: Callable[[Any, Any, Any], Any]


def _real_where(condition: float, a: float, b: float) -> float:
    return a if condition > 0.0 else b


def _complex_log(a: complex) -> complex:
    """Refuses what the real one refuses: a rope reeled in past its end has no strain."""
    if not a.real > 0.0:
        raise ValueError(f"the logarithm of {a.real} is not a real number")
    return cmath.log(a)


def _complex_sqrt(a: complex) -> complex:
    if a.real < 0.0:
        raise ValueError(f"the square root of {a.real} is not a real number")
    return cmath.sqrt(a)


def _complex_atan2(y: complex, x: complex) -> complex:
    """To first order in the imaginary parts, which is all that a complex step has."""
    a, b = complex(y), complex(x)
    slope = (b.real * a.imag - a.real * b.imag) / (a.real * a.real + b.real * b.real)
    return complex(math.atan2(a.real, b.real), slope)


def _complex_absolute(a: complex) -> complex:
    return -a if a.real < 0.0 else a


def _complex_maximum(a: complex, b: complex) -> complex:
    return a if a.real >= b.real else b


def _complex_where(condition: complex, a: complex, b: complex) -> complex:
    return a if condition.real > 0.0 else b


REAL = Mathematics(
    log=math.log,
    exp=math.exp,
    sqrt=math.sqrt,
    sin=math.sin,
    cos=math.cos,
    tanh=math.tanh,
    atan2=math.atan2,
    absolute=abs,
    maximum=max,
    where=_real_where,
)

COMPLEX_STEP = Mathematics(
    log=_complex_log,
    exp=cmath.exp,
    sqrt=_complex_sqrt,
    sin=cmath.sin,
    cos=cmath.cos,
    tanh=cmath.tanh,
    atan2=_complex_atan2,
    absolute=_complex_absolute,
    maximum=_complex_maximum,
    where=_complex_where,
)

STEP = 1e-30
UNIT = complex(0.0, STEP)


def along(value: float, rate: float) -> complex:
    """A number that carries its rate of change through a law.

    ``f(along(x, dx)).imag / STEP`` is ``f'(x) dx`` without truncation or cancellation (complex-step derivative).
    Not a Taylor step: ``f(along(x, dx)).real`` is ``f(x)`` itself.

    Source: Martins, Sturdza and Alonso (2003), ACM Transactions on Mathematical Software 29(3), 245-262.
    """
    return complex(value, STEP * rate)


def all_along(values: Sequence[float], rates: Sequence[float]) -> List[complex]:
    """As :func:`along`, number by number."""
    return [value + rate * UNIT for value, rate in zip(values, rates)]


def vector_along(values: Sequence[float], rates: Sequence[float]) -> Tuple[complex, complex, complex]:
    """As :func:`along`, for the three numbers of a vector."""
    x, y, z = values
    dx, dy, dz = rates
    return (x + dx * UNIT, y + dy * UNIT, z + dz * UNIT)


def rates_of(vector: Sequence[complex]) -> Tuple[float, float, float]:
    """As :func:`rate_of`, for the three numbers of a vector."""
    x, y, z = vector
    return (x.imag / STEP, y.imag / STEP, z.imag / STEP)


def rate_of(value: complex) -> float:
    """The rate that a law passed on, see :func:`along`."""
    return value.imag / STEP
