"""Units and sizes of variables as FMUs state them."""

import pytest
from fmpy.model_description import ScalarVariable, SimpleType

from tautwire.fmus.variable_units import nominal_of, unit_of
from tautwire_fmu.cable_variables import cable_variables

FORCE = SimpleType("Force", "Real", unit="N", nominal="300")
SLACK = {
    "start": [0.0, 0.0, 0.0],
    "anchor": [0.0, 0.0, 10.0],
    "start_length": 10.0,
    "start_tension": 0.0,
    "modulus": 1e11,
    "area": 1e-5,
    "damping": 0.0,
    "gravity": 9.81,
    "effects": [],
}


@pytest.mark.parametrize(("stated", "size"), [("20", 20.0), ("-5.0", 5.0), ("0.0", 1.0), (None, 1.0)])
def test_a_nominal_value_is_a_size_and_never_zero(stated: str | None, size: float) -> None:
    assert nominal_of(ScalarVariable("force", 1, type="Real", nominal=stated)) == size


def test_a_type_may_state_unit_and_size() -> None:
    variable = ScalarVariable("force", 1, type="Real", declaredType=FORCE)
    assert unit_of(variable) == "N"
    assert nominal_of(variable) == 300.0


def test_a_cable_that_starts_slack_states_no_nominal_value_of_zero() -> None:
    assert all(variable.nominal is None or variable.nominal > 0.0 for variable in cable_variables(SLACK))
