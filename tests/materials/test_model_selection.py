"""Which terms a table is said to ask for, on tables whose terms are known."""

import numpy as np
import pytest

from tautwire.materials.model_selection import CONSTANT_PAIR as PAIR
from tautwire.materials.model_selection import likelihood_ratio_p_value, select_model
from tautwire.materials.viscoelastic_model import Material, MaxwellBranch, ModelStructure
from tests.support.materials import CONSTANT, observed

FREQUENCY = np.geomspace(0.1, 20.0, 8)
BRANCH = (MaxwellBranch(25e9, 0.4),)


@pytest.mark.validate
def test_constant_pairs_are_left_alone() -> None:
    for seed in range(8):
        assert select_model(observed(CONSTANT, FREQUENCY, 0.02, seed), 0.01).chosen == PAIR


@pytest.mark.validate
@pytest.mark.parametrize(
    ("material", "effects"),
    [
        (Material(100e9, 0.4e9, BRANCH), {"damping", "relaxation"}),
        (Material(100e9, 0.4e9, loss_modulus=10e9), {"damping", "hysteresis"}),
        (Material(100e9, 0.4e9, BRANCH, loss_modulus=10e9), {"damping", "relaxation", "hysteresis"}),
    ],
)
def test_terms_that_are_there_are_found(material: Material, effects: set[str]) -> None:
    for seed in range(3):
        assert select_model(observed(material, FREQUENCY, 0.02, seed), 0.01).chosen.effects == effects


@pytest.mark.validate
def test_the_number_of_branches_is_found() -> None:
    two = Material(100e9, 0.05e9, (MaxwellBranch(25e9, 0.03), MaxwellBranch(25e9, 1.0)))
    result = select_model(observed(two, np.geomspace(0.05, 50.0, 16), 0.01, seed=1), 0.01)
    assert result.fit.structure == ModelStructure(damping=True, branches=2)
    assert result.evidence("relaxation") > 100.0


@pytest.mark.validate
def test_a_delay_of_the_channels_is_a_rival_of_damping() -> None:
    # Below the rope's own frequencies the two differ only in a storage modulus that falls by a cosine.
    late = Material(100e9, delay=1e-3)
    result = select_model(observed(late, FREQUENCY, 0.02, seed=2), 0.01)
    assert result.chosen == PAIR
    assert ModelStructure(delay=True) in result.confusable_models(0.01)


@pytest.mark.validate
def test_amplitudes_identify_friction_of_one_stress() -> None:
    dry = Material(100e9, 0.1e9, friction_stress=3e6)
    amplitude = np.geomspace(6e-4, 1e-4, 8)
    rng = np.random.default_rng(4)
    seen = observed(dry, FREQUENCY, 0.02, seed=3, amplitude=rng.permutation(amplitude))
    assert select_model(seen, 0.01).chosen == ModelStructure(damping=True, hysteresis="stress")
    blind = observed(dry, FREQUENCY, 0.02, seed=3)
    assert not any(family.hysteresis == "stress" for family in select_model(blind, 0.01).best_fits)


def test_chance_is_that_of_the_likelihood_ratio() -> None:
    seen = observed(CONSTANT, FREQUENCY, 0.02, seed=6)
    best = select_model(seen, 0.01).best_fits
    pair, loss = best[PAIR], best[ModelStructure(damping=True, hysteresis="modulus")]
    gain = pair.chi_squared - loss.chi_squared
    # One parameter: the tail of a squared normal variable, by counting.
    drawn = np.random.default_rng(0).standard_normal(400_000) ** 2
    assert likelihood_ratio_p_value(loss, pair) == pytest.approx(np.mean(drawn > gain), abs=0.004)
