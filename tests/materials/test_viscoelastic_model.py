"""The complex modulus against stresses that were integrated or summed in time."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tautwire.materials.viscoelastic_model import (
    Material,
    MaxwellBranch,
    complex_modulus,
    loss_factor,
    loss_modulus,
    storage_modulus,
    viscous_damping,
)
from tautwire_fmu.laws.effects.relaxation import Values, state_rates, stiffness
from tautwire_fmu.laws.mathematics import REAL

AMPLITUDE = 3e-4
ROPE = Material(modulus=105e9, damping=0.46e9, branches=(MaxwellBranch(12e9, 0.02), MaxwellBranch(29e9, 1.56)))


def driven(material: Material, frequency: float) -> complex:
    """First harmonic of stress over strain once transients have died, dashpots integrated in time."""
    omega = 2.0 * np.pi * frequency
    times = np.array([branch.relaxation_time for branch in material.branches])
    moduli = np.array([branch.modulus for branch in material.branches])

    def rates(time: float, dashpots: np.ndarray) -> np.ndarray:
        return (AMPLITUDE * np.sin(omega * time) - dashpots) / times

    period = 1.0 / frequency
    begin = period * np.ceil(18.0 * times.max() / period)
    sampled = begin + period * np.arange(64) / 64.0
    path = solve_ivp(
        rates, (0.0, sampled[-1]), np.zeros(len(times)), t_eval=sampled, method="DOP853", rtol=1e-9, atol=1e-14
    )
    strain, rate = AMPLITUDE * np.sin(omega * sampled), AMPLITUDE * omega * np.cos(omega * sampled)
    stress = material.modulus * strain + material.damping * rate + moduli @ (strain - path.y)
    in_phase, ahead = 2.0 * np.mean(stress * np.sin(omega * sampled)), 2.0 * np.mean(stress * np.cos(omega * sampled))
    return complex(in_phase, ahead) / AMPLITUDE


@pytest.mark.parametrize("frequency", [0.1, 1.0, 7.0])
def test_branches_and_damping_answer_as_they_do_in_time(frequency: float) -> None:
    assert complex_modulus(ROPE, frequency) == pytest.approx(driven(ROPE, frequency), rel=1e-6)


@pytest.mark.parametrize("frequency", [0.1, 2.0, 20.0])
def test_branches_answer_as_the_relaxation_effect_of_robot_files(frequency: float) -> None:
    turn = 2j * np.pi * frequency
    (first, second), third = ROPE.branches, MaxwellBranch(0.0, 1.0)
    values = Values(*first, *second, *third)
    dashpots = tuple(1.0 / (1.0 + turn * branch.relaxation_time) for branch in (first, second, third))

    class Moving:
        strain = 1.0

    rates = state_rates(REAL, values, dashpots, None, Moving())
    assert rates == pytest.approx([turn * dashpot for dashpot in dashpots])
    slope, held = stiffness(REAL, values, dashpots, None)
    alone = Material(0.0, branches=ROPE.branches)
    assert complex_modulus(alone, frequency) == pytest.approx(slope + held, rel=1e-12)


def test_dry_friction_has_the_first_harmonic_of_its_loop() -> None:
    angle = 2.0 * np.pi * (np.arange(4096) + 0.5) / 4096.0
    stress = 7e6 * np.sign(np.cos(angle))
    ahead = 2.0 * np.mean(stress * np.cos(angle)) / AMPLITUDE
    material = Material(100e9, friction_stress=7e6)
    assert loss_modulus(material, 3.0, AMPLITUDE) == pytest.approx(ahead, rel=1e-6)
    assert storage_modulus(material, 3.0, AMPLITUDE) == 100e9
    assert loss_modulus(material, 3.0) == 0.0


def test_a_delay_turns_the_modulus_and_keeps_its_size() -> None:
    late = Material(ROPE.modulus, ROPE.damping, ROPE.branches, delay=2e-3)
    frequency = np.array([0.5, 5.0, 20.0])
    ratio = complex_modulus(late, frequency) / complex_modulus(ROPE, frequency)
    assert np.abs(ratio) == pytest.approx(np.ones(3))
    assert np.angle(ratio) == pytest.approx(2.0 * np.pi * frequency * 2e-3)


def test_a_quick_branch_is_a_damper_and_a_slow_one_a_spring() -> None:
    quick = Material(100e9, branches=(MaxwellBranch(20e9, 1e-6),))
    assert viscous_damping(quick, 1.0) == pytest.approx(20e9 * 1e-6, rel=1e-9)
    assert storage_modulus(quick, 1.0) == pytest.approx(100e9, rel=1e-9)
    slow = Material(100e9, branches=(MaxwellBranch(20e9, 1e6),))
    assert storage_modulus(slow, 1.0) == pytest.approx(120e9, rel=1e-9)
    assert loss_modulus(slow, 1.0) < 1e5


def test_damping_is_equation_nine() -> None:
    frequency = np.array([0.1, 1.0, 10.0])
    eta = loss_factor(ROPE, frequency)
    expected = storage_modulus(ROPE, frequency) * eta / (2.0 * np.pi * frequency)
    assert viscous_damping(ROPE, frequency) == pytest.approx(expected)


def test_storage_and_loss_of_branches_obey_kramers_and_kronig() -> None:
    # Over ln(u) the singular point is met on both sides alike, so a symmetric grid gives the principal value.
    material, at = Material(0.0, branches=ROPE.branches), 0.8
    logs = np.linspace(-16.0, 16.0, 64000) + np.log(at)
    other = np.exp(logs)
    integrand = loss_modulus(material, other) * at**2 / (at**2 - other**2)
    dispersion = 2.0 / np.pi * np.sum(integrand) * (logs[1] - logs[0])
    assert storage_modulus(material, at) == pytest.approx(dispersion, rel=1e-3)
