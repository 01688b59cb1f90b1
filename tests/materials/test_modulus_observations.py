"""Both parts of the modulus from a table, with propagated errors."""

from pathlib import Path

import numpy as np
import pytest

from tautwire.materials.material_table import PAPER_TABLE, read_material_table
from tautwire.materials.modulus_observations import observations_from_table
from tests.support.materials import CONSTANT, observed, written

TABLE = read_material_table(PAPER_TABLE)
POLAR, FACTOR = TABLE.modulus_pairs()


@pytest.mark.parametrize("pair", [POLAR, FACTOR])
def test_the_covariance_is_what_sampling_gives(pair: tuple[str, str]) -> None:
    seen = observations_from_table(TABLE, pair, shared_variance=0.3)
    random = np.random.default_rng(1)
    draws = []
    for name in pair:
        quantities = [row.quantities[name] for row in TABLE.rows]
        value = np.array([quantity.value for quantity in quantities])
        # A tenth of the errors keeps the sampled moduli within first order.
        sigma = 0.1 * np.array([quantity.uncertainty for quantity in quantities], dtype=float)
        common = np.sqrt(0.3) * random.standard_normal((40000, 1))
        own = np.sqrt(0.7) * random.standard_normal((40000, len(value)))
        draws.append(value + sigma * (common + own))
    modulus = draws[0] * np.exp(1j * draws[1]) if pair == POLAR else draws[0] * (1.0 + 1j * draws[1])
    sampled = 100.0 * np.cov(np.hstack([modulus.real, modulus.imag]).T)
    scale = np.sqrt(np.outer(np.diag(seen.covariance), np.diag(seen.covariance)))
    assert np.max(np.abs(sampled - seen.covariance) / scale) < 0.03


def test_damping_pairs_are_loss_moduli_over_omega(tmp_path: Path) -> None:
    seen = observed(CONSTANT, np.array([0.1, 1.0, 5.0, 20.0]))
    text = written(tmp_path / "loss.csv", seen).read_text(encoding="utf-8")
    lines = [line.split(",") for line in text.splitlines()]
    omega = 2.0 * np.pi * seen.frequency
    for place, line in enumerate(lines[1:]):
        line[3:] = [repr(float(float(cell) / omega[place])) for cell in line[3:]]
    lines[0] = [name.replace("loss_modulus", "damping") for name in lines[0]]
    (tmp_path / "damping.csv").write_text("\n".join(",".join(line) for line in lines), encoding="utf-8")
    both = []
    for name in ("loss.csv", "damping.csv"):
        table = read_material_table(tmp_path / name)
        both.append(observations_from_table(table, table.modulus_pairs()[0]))
    assert both[1].loss == pytest.approx(both[0].loss)
    assert both[1].covariance == pytest.approx(both[0].covariance)


def test_whitened_errors_have_unit_covariance() -> None:
    seen = observations_from_table(TABLE, POLAR, shared_variance=0.5)
    white = seen.whitener @ seen.covariance @ seen.whitener.T
    assert white == pytest.approx(np.eye(12), abs=1e-9)


def test_rows_that_are_taken_keep_their_numbers() -> None:
    seen = observations_from_table(TABLE, POLAR, shared_variance=0.5)
    part = seen.select_rows([4, 1])
    assert list(part.frequency) == [10.0, 1.0]
    assert part.covariance[0, 1] == seen.covariance[4, 1]
    assert part.covariance[2, 1] == seen.covariance[10, 1]
    assert part.amplitude[1] == seen.amplitude[1]


def test_two_standard_deviations_are_halved() -> None:
    one, two = (observations_from_table(TABLE, POLAR, coverage_factor=coverage) for coverage in (1.0, 2.0))
    assert two.covariance == pytest.approx(one.covariance / 4.0)


def test_static_rows_are_added_on_request() -> None:
    seen = observations_from_table(TABLE, POLAR)
    assert seen.measurement_count == 12
    with_static = seen.with_static_rows(TABLE)
    assert with_static.measurement_count == 13
    assert (with_static.static_modulus[0], with_static.static_modulus_uncertainty[0]) == (102.2e9, 2.2e9)


def test_static_rows_are_covered_by_as_many_deviations_as_the_others() -> None:
    once, twice = (observations_from_table(TABLE, POLAR).with_static_rows(TABLE, factor) for factor in (1.0, 2.0))
    assert twice.static_modulus_uncertainty == pytest.approx(0.5 * once.static_modulus_uncertainty)
