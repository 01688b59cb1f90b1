"""Units and sizes of variables as FMUs state them."""

import pytest
from fmpy.model_description import ScalarVariable, SimpleType

from tautwire.fmus.variable_units import nominal_of, unit_of
from tautwire_fmu.cable_variables import cable_variables
from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.platform_variables import force_variables

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


def test_a_platform_without_weight_states_no_nominal_value_of_zero() -> None:
    data = {"mass": 20.0, "gravity": 0.0, "start_forces": [[0.0, 0.0, 5.0]]}
    assert all(variable.nominal is None or variable.nominal > 0.0 for variable in force_variables(data))


@pytest.mark.parametrize(("effect", "minimum"), [("sensor_offset", None), ("friction", 0.0)])
def test_a_load_cell_with_a_zero_of_its_own_may_show_less_than_none(effect: str, minimum: float | None) -> None:
    values = {parameter.name: parameter.neutral or 0.0 for parameter in BY_NAME[effect].parameters}
    data = {**SLACK, "effects": [{"name": effect, "values": values}]}
    (tension,) = (variable for variable in cable_variables(data) if variable.name == "tension")
    assert tension.minimum == minimum
