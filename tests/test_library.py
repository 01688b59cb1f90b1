"""The terms that formulas are made of: each can be read, has a finite series, and none stands there twice."""

import casadi
import numpy as np

from tautwire.model.symbolic import CASADI
from tautwire.tracer.discovery.library import SHAPE, Term, library, reach_of
from tautwire.tracer.discovery.ports import Along
from tautwire_fmu.laws.expression import evaluate, read_expression
from tautwire_fmu.laws.formula import FORCES, IN_ROPE, ON_PLATFORM, PLACES
from tests.robots import example

ROBOT = example("three")
RANDOM = np.random.default_rng(1)
RUN = Along(
    {name: RANDOM.normal(size=50) for name in ON_PLATFORM},
    tuple({name: RANDOM.normal(size=50) for name in IN_ROPE} for _ in ROBOT.cables),
)
TERMS = library(ROBOT, reach_of([RUN, RUN]), [10.7])


def texts(place: str) -> set[str]:
    return {term.text for term in TERMS if term.place == place}


def test_every_term_can_be_read_and_has_a_series() -> None:
    for term in TERMS:
        read_expression(term.text.replace(SHAPE, "2.5"), PLACES[term.place])
        series = term.series(RUN.ropes[0] if term.cables else RUN.platform)
        assert series.shape == (50,)
        assert np.all(np.isfinite(series))


def test_every_term_has_a_finite_slope_at_rest() -> None:
    for term in (term for term in TERMS if term.place in FORCES):
        names = {name: casadi.SX.sym(name) for name in ON_PLATFORM}
        tree = read_expression(term.text.replace(SHAPE, "2.5"), ON_PLATFORM)
        symbols = casadi.vertcat(*names.values())
        slope = casadi.Function("slope", [symbols], [casadi.jacobian(evaluate(CASADI, tree, names), symbols)])
        assert np.all(np.isfinite(np.array(slope([28.86, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0]))))


def test_no_term_stands_there_twice() -> None:
    assert len(set(TERMS)) == len(TERMS)


def test_ropes_have_terms_together_and_each_alone() -> None:
    assert {term.cables for term in TERMS if term.place == "tension"} == {(1, 2, 3), (1,), (2,), (3,)}


def test_positions_are_counted_from_the_start() -> None:
    assert {"vx", "vx*vy", "(x - 28.86)*vz", "y**3", "1", "time*vz"} <= texts("force_y")
    assert f"sin({SHAPE}*(z - 5))" in texts("force_x")


def test_rhythms_come_as_sine_and_cosine() -> None:
    found = [term for term in TERMS if term.family == "time" and term.place == "force_z"]
    assert [(term.text, term.shape) for term in found] == [(f"{f}({SHAPE}*time)", 10.7) for f in ("sin", "cos")]


def test_terms_of_known_effects_are_marked() -> None:
    marked = {term.text for term in TERMS if term.listed and term.cables == (1, 2, 3)}
    assert {"tension", "strain_rate", "time", "time**3", f"sin({SHAPE}*travel)"} <= marked
    assert not {"tension**2", "tension*strain_rate", "winch_speed*abs(winch_speed)"} & marked
    assert Term("force_z", "1", listed=True) in TERMS
    assert Term("force_x", "vy") in TERMS
