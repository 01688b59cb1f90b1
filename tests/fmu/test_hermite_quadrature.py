import numpy as np
import pytest

from tautwire_fmu.hermite_quadrature import cubic_hermite, quintic_hermite, taylor_extrapolate

FRACTIONS = (0.0, 0.2, 0.5, 0.9, 1.0)


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_cubic_is_exact_for_cubics(fraction: float) -> None:
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0])
    rate = polynomial.deriv()
    step = 0.7
    value, slope = cubic_hermite((polynomial(0.0), rate(0.0)), (polynomial(step), rate(step)), step, fraction)
    assert value == pytest.approx(polynomial(fraction * step), abs=1e-14)
    assert slope == pytest.approx(rate(fraction * step), abs=1e-13)


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_quintic_is_exact_for_quintics_and_their_rates(fraction: float) -> None:
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
    rate, curvature = polynomial.deriv(), polynomial.deriv(2)
    step = 0.7
    start = (polynomial(0.0), rate(0.0), curvature(0.0))
    end = (polynomial(step), rate(step), curvature(step))
    value, slope, bend = quintic_hermite(start, end, step, fraction)
    assert value == pytest.approx(polynomial(fraction * step), abs=1e-13)
    assert slope == pytest.approx(rate(fraction * step), abs=1e-12)
    assert bend == pytest.approx(curvature(fraction * step), abs=1e-11)


def test_extrapolation_is_the_taylor_polynomial() -> None:
    assert taylor_extrapolate(1.0, 2.0, 3.0, 0.1) == pytest.approx(1.0 + 0.2 + 0.015)
