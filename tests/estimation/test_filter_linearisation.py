"""A filter's run linearised: its innovations, what was not observed, and covariances that rounding has spoilt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tautwire.estimation.filter_linearisation import cholesky_factors, linearise_filter
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1).first(600)
NOISE = estimate_noise(ROBOT, RECORDING)
INTERVAL = float(RECORDING.time[1] - RECORDING.time[0])


def test_what_was_not_seen_moves_nothing() -> None:
    blind = replace(RECORDING, tension=RECORDING.tension.copy())
    blind.tension[100:300, 1] = np.nan
    likelihood = Likelihood(ROBOT, (), NOISE, INTERVAL)
    runs = list(linearise_filter(likelihood, [], blind))
    seen = np.concatenate([run.observed[run.is_recorded] for run in runs])
    assert np.array_equal(seen, np.isfinite(blind.measured()))
    whitening = np.concatenate([run.whitening[run.is_recorded] for run in runs])
    assert not np.any(whitening[~seen])


def test_the_run_has_the_innovations_of_the_filter() -> None:
    likelihood = Likelihood(ROBOT, (), NOISE, INTERVAL)
    values = np.concatenate([run.values[run.is_recorded] for run in linearise_filter(likelihood, [], RECORDING)])
    assert np.allclose(values, likelihood.innovations(RECORDING, []).values, atol=1e-12)


def test_a_covariance_that_rounding_left_indefinite_is_factorised_all_the_same() -> None:
    # Two outputs of one metre each that are equal but for rounding, and a third in newtons.
    indefinite = np.array([[1.0, 1.0 + 1e-15, 0.0], [1.0 + 1e-15, 1.0, 0.0], [0.0, 0.0, 1e8]])
    regular, broken = np.diag([1e-8, 1e-8, 1.0]), np.full((3, 3), np.nan)
    factors = cholesky_factors(np.array([indefinite, regular, broken]))
    np.testing.assert_allclose(factors[0] @ factors[0].T, indefinite, rtol=1e-9)
    np.testing.assert_allclose(factors[1] @ factors[1].T, regular, rtol=1e-15)
    assert np.all(np.isfinite(np.linalg.inv(factors[:2])))
    assert np.all(np.isnan(factors[2]))
    np.testing.assert_array_equal(cholesky_factors(regular[None])[0], np.linalg.cholesky(regular))
