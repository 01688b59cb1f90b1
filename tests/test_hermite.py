"""Polynomials through values and rates, and which outputs are rates of which."""

import numpy as np
import pytest

from tautwire.fmus.packaging import RobotFmus
from tautwire.master import Port
from tautwire.master.hermite import Chain, chains_of, scaled, shares
from tautwire.runs.cosimulation import instantiated

NAMES = ("position", "velocity", "acceleration")


def test_a_polynomial_is_continued_exactly() -> None:
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0, -1.0, 2.0])
    unit, times, at = 0.3, (-2.0, -0.5, 0.0), (0.5, 1.0)

    def known(time: float) -> list[float]:
        return [polynomial.deriv(k)(unit * time) for k in range(2)]

    weights = scaled(shares(times, 2, at), unit).reshape(4, 6)
    found = weights @ np.concatenate([known(time) for time in times])
    assert found == pytest.approx(np.concatenate([known(time) for time in at]), rel=1e-11)


def test_fmus_tell_which_output_is_the_rate_of_which(three_fmus: RobotFmus) -> None:
    shown = [Port("platform", f"{middle}{name}.x") for middle in ("", "middle_") for name in NAMES]
    shown += [Port("cable_1", name) for name in ("force_rate.y", "force.y", "tension")]
    with instantiated(three_fmus) as coupling:
        wanted = range(len(shown))
        assert chains_of(coupling.components, shown, wanted) == [
            Chain((0, 1, 2), (3, 4, 5)),
            Chain((7, 6), None),
            Chain((8,), None),
        ]
        assert chains_of(coupling.components, shown, (4,)) == [Chain((0, 1, 2), (3, 4, 5))]
