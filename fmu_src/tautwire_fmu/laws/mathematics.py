"""Mathematical functions handed to the laws, for one kind of number: floats or complex steps.

A law calls ``m.log(x)``, never ``math.log(x)``, so the same source runs on floats inside an FMU, on complex
numbers for exact rates, and on arrays or symbols outside. Nonsmooth functions are written with ``m.maximum``,
``m.absolute`` and ``m.where`` for the same reason.
"""

import cmath
import math
from typing import Any, Callable, List, NamedTuple, Sequence, Tuple


class Mathematics(NamedTuple):
    """Functions that a law may use, for one kind of number.

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
    """Complex logarithm with the domain of the real one: a rope reeled in past its end has no strain."""
    if not a.real > 0.0:
        raise ValueError(f"the logarithm of {a.real} is not a real number")
    return cmath.log(a)


def _complex_sqrt(a: complex) -> complex:
    if a.real < 0.0:
        raise ValueError(f"the square root of {a.real} is not a real number")
    return cmath.sqrt(a)


def _complex_atan2(y: complex, x: complex) -> complex:
    """Complex atan2 to first order in the imaginary parts, all that a complex step needs."""
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

COMPLEX_STEP_SIZE = 1e-30
IMAGINARY_STEP = complex(0.0, COMPLEX_STEP_SIZE)


def with_rate(value: float, rate: float) -> complex:
    """Complex-step number: a value that carries its rate of change through a law.

    ``f(with_rate(x, dx)).imag / COMPLEX_STEP_SIZE`` is ``f'(x) dx`` without truncation or cancellation
    (complex-step derivative).
    Not a Taylor step: ``f(with_rate(x, dx)).real`` is ``f(x)`` itself.

    Source: Martins, Sturdza and Alonso (2003), ACM Transactions on Mathematical Software 29(3), 245-262.
    """
    return complex(value, COMPLEX_STEP_SIZE * rate)


def all_with_rates(values: Sequence[float], rates: Sequence[float]) -> List[complex]:
    """As :func:`with_rate`, number by number."""
    return [value + rate * IMAGINARY_STEP for value, rate in zip(values, rates)]


def vector_with_rates(values: Sequence[float], rates: Sequence[float]) -> Tuple[complex, complex, complex]:
    """As :func:`with_rate`, for the three numbers of a vector."""
    x, y, z = values
    dx, dy, dz = rates
    return (x + dx * IMAGINARY_STEP, y + dy * IMAGINARY_STEP, z + dz * IMAGINARY_STEP)


def rates_of(vector: Sequence[complex]) -> Tuple[float, float, float]:
    """As :func:`rate_of`, for the three numbers of a vector."""
    x, y, z = vector
    return (x.imag / COMPLEX_STEP_SIZE, y.imag / COMPLEX_STEP_SIZE, z.imag / COMPLEX_STEP_SIZE)


def rate_of(value: complex) -> float:
    """Rate of change carried by a complex-step number, see :func:`with_rate`."""
    return value.imag / COMPLEX_STEP_SIZE
