"""What a term of a formula moves, against the filter's own sensitivities of the same formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.discovery.candidate_terms import Term
from tautwire.estimation.discovery.formula_ports import FormulaPorts, series_sensitivities
from tautwire.estimation.disturbance import OrnsteinUhlenbeck
from tautwire.estimation.filter_linearisation import linearise_filter
from tautwire.estimation.kalman_filter import Noise
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.robot.schema import Formula, Robot
from tautwire.robot.symbolic_model import FORMULA_INDEX, FreeParameter
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1).first(600)
NOISE = estimate_noise(ROBOT, RECORDING)
INTERVAL = float(RECORDING.time[1] - RECORDING.time[0])
LENGTHS = replace(NOISE, rope_lengths=(OrnsteinUhlenbeck(1e-5, 5.0),) * 3)
EVERYWHERE = (1, 2, 3)


def along(robot: Robot, term: Term, noise: Noise) -> np.ndarray:
    """Slopes of the innovations by a term's coefficient, (N, m)."""
    likelihood = Likelihood(robot, (), noise, INTERVAL)
    ports = FormulaPorts(robot, likelihood.model.state_names)
    slopes, parts, begun = np.zeros((len(likelihood.model.state_names), 1)), [], None
    for run in linearise_filter(likelihood, [], RECORDING):
        names = ports.signals(run)
        ropes = [names.ropes[cable - 1] for cable in term.cables] or [names.platform]
        series = np.array([term.series(rope) for rope in ropes])
        begun = series[:, 0] if begun is None else begun
        moved = series_sensitivities([term.site], [series], [begun], ports, run, names.platform["time"])
        slopes, found = run.propagate_sensitivities(slopes, *moved)
        parts.append(found[run.is_recorded, :, 0])
    return np.concatenate(parts)


def exact(robot: Robot, term: Term, noise: Noise) -> np.ndarray:
    """The same by the filter itself."""
    formula = Formula(term.target, f"c1*{term.text}", term.cables, {"c1": 0.0})
    opened = replace(robot, formulas=(*robot.formulas, formula))
    likelihood = Likelihood(opened, [FreeParameter(FORMULA_INDEX, "c1")], noise, INTERVAL)
    return likelihood.innovations(RECORDING, [0.0]).sensitivities[:, :, 0]


TERMS = (
    Term("force_x", "vy"),
    Term("force_z", "1"),
    Term("force_y", "time*(x - 28)**2"),
    Term("mass", "time"),
    Term("tension", "tension**2", EVERYWHERE),
    Term("tension", "strain_rate*abs(winch_speed)", (2,)),
    Term("tension", "travel*length", (1, 3)),
)


@pytest.mark.validate(but=["plain", "force_z 1", "strain_rate"])
@pytest.mark.parametrize("term", TERMS, ids=lambda term: f"{term.target} {term.text}")
@pytest.mark.parametrize(
    ("formulas", "noise"),
    [((), NOISE), ((Formula("force_x", "20*sin(3*time)*vx"),), NOISE), ((), LENGTHS)],
    ids=["plain", "with time", "errors of rope lengths"],
)
def test_a_term_moves_what_the_filter_says(term: Term, formulas: tuple[Formula, ...], noise: Noise) -> None:
    robot = replace(ROBOT, formulas=formulas)
    expected, found = exact(robot, term, noise), along(robot, term, noise)
    assert np.sum(expected**2) > 0.0
    alike = np.sum(found * expected) / np.sqrt(np.sum(found**2) * np.sum(expected**2))
    assert alike > 0.999
    assert np.sum(found**2) == pytest.approx(np.sum(expected**2), rel=0.02)
