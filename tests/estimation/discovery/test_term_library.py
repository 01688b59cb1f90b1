"""The terms that formulas are made of: each can be read, has a finite series, and none stands there twice."""

import casadi
import numpy as np

from tautwire.estimation.discovery.candidate_terms import SHAPE_PARAMETER, Term, candidate_terms, signal_ranges
from tautwire.estimation.discovery.formula_ports import PortSignals
from tautwire.robot.symbolic_equations import CASADI_MATHEMATICS
from tautwire_fmu.laws.expression import evaluate, parse_expression
from tautwire_fmu.laws.formula import CABLE_VARIABLES, FORCE_TARGETS, PLATFORM_VARIABLES, VARIABLES_BY_TARGET
from tests.support.robots import example

ROBOT = example("three")
RANDOM = np.random.default_rng(1)
RUN = PortSignals(
    {name: RANDOM.normal(size=50) for name in PLATFORM_VARIABLES},
    tuple({name: RANDOM.normal(size=50) for name in CABLE_VARIABLES} for _ in ROBOT.cables),
)
TERMS = candidate_terms(ROBOT, signal_ranges([RUN, RUN]), [10.7])


def texts(place: str) -> set[str]:
    return {term.text for term in TERMS if term.target == place}


def test_every_term_can_be_read_and_has_a_series() -> None:
    for term in TERMS:
        parse_expression(term.text.replace(SHAPE_PARAMETER, "2.5"), VARIABLES_BY_TARGET[term.target])
        series = term.series(RUN.ropes[0] if term.cables else RUN.platform)
        assert series.shape == (50,)
        assert np.all(np.isfinite(series))


def test_every_term_has_a_finite_slope_at_rest() -> None:
    for term in (term for term in TERMS if term.target in FORCE_TARGETS):
        names = {name: casadi.SX.sym(name) for name in PLATFORM_VARIABLES}
        tree = parse_expression(term.text.replace(SHAPE_PARAMETER, "2.5"), PLATFORM_VARIABLES)
        symbols = casadi.vertcat(*names.values())
        slope = casadi.Function(
            "slope", [symbols], [casadi.jacobian(evaluate(CASADI_MATHEMATICS, tree, names), symbols)]
        )
        assert np.all(np.isfinite(np.array(slope([28.86, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0]))))


def test_no_term_stands_there_twice() -> None:
    assert len(set(TERMS)) == len(TERMS)


def test_ropes_have_terms_together_and_each_alone() -> None:
    assert {term.cables for term in TERMS if term.target == "tension"} == {(1, 2, 3), (1,), (2,), (3,)}


def test_positions_are_counted_from_the_start() -> None:
    assert {"vx", "vx*vy", "(x - 28.86)*vz", "y**3", "1", "time*vz"} <= texts("force_y")
    assert f"sin({SHAPE_PARAMETER}*(z - 5))" in texts("force_x")


def test_rhythms_come_as_sine_and_cosine() -> None:
    results = [term for term in TERMS if term.family == "time" and term.target == "force_z"]
    assert [(term.text, term.shape) for term in results] == [
        (f"{f}({SHAPE_PARAMETER}*time)", 10.7) for f in ("sin", "cos")
    ]


def test_terms_of_known_effects_are_marked() -> None:
    marked = {term.text for term in TERMS if term.resembles_effect and term.cables == (1, 2, 3)}
    assert {"tension", "strain_rate", "time", "time**3", f"sin({SHAPE_PARAMETER}*travel)"} <= marked
    assert not {"tension**2", "tension*strain_rate", "winch_speed*abs(winch_speed)"} & marked
    assert Term("force_z", "1", resembles_effect=True) in TERMS
    assert Term("force_x", "vy") in TERMS
