"""H-infinity loop shaping: the map between sampled and continuous, and a loop whose best norm is known."""

from __future__ import annotations

import control
import numpy as np
import pytest

from tautwire.control.hinf_loop_shaping import NORM_FACTOR, synthesise_controller, to_continuous, to_sampled

PERIOD = 0.01


def some_system() -> control.StateSpace:
    random = np.random.default_rng(1)
    A = random.standard_normal((4, 4))
    return control.ss(
        0.9 * A / np.max(np.abs(np.linalg.eigvals(A))),
        random.standard_normal((4, 2)),
        random.standard_normal((3, 4)),
        random.standard_normal((3, 2)),
        PERIOD,
    )


def test_map_to_continuous_keeps_each_frequency_response() -> None:
    system = some_system()
    for omega in (0.1, 30.0, 250.0):
        warped = 2.0 / PERIOD * np.tan(0.5 * PERIOD * omega)
        expected = system(np.exp(1j * PERIOD * omega))
        assert to_continuous(system)(1j * warped) == pytest.approx(expected)


def test_maps_undo_each_other() -> None:
    system = some_system()
    back = to_sampled(to_continuous(system), PERIOD)
    for name in "ABCD":
        assert getattr(back, name) == pytest.approx(getattr(system, name), abs=1e-12)
    assert back.dt == PERIOD


@pytest.mark.parametrize(("pole", "gain"), ((0.0, 1.0), (1.0, 0.01), (1.0, 1e-5)), ids=("integrator", "100", "1e5"))
def test_a_first_order_plant_gets_the_norm_that_the_textbook_gives_it(pole: float, gain: float) -> None:
    # k / (s - p): its smallest four-block norm is sqrt(1 + X Z), of two Riccati equations; sampled it hardly differs.
    norm = np.hypot(1.0, (pole + np.hypot(pole, gain)) / gain)
    process = control.ss(pole, gain, 1.0, 0.0)
    plant = to_sampled(process, PERIOD)
    controller = synthesise_controller(plant, control.ss([], [], [], 1.0))
    continuous = to_continuous(controller)
    loop = control.feedback(1.0, -process * continuous)
    omega = np.geomspace(1e-3, 1e3, 500)
    s, k, g = loop(1j * omega), continuous(1j * omega), process(1j * omega)
    blocks = np.abs(s) * np.sqrt((1.0 + np.abs(k) ** 2) * (1.0 + np.abs(g) ** 2))
    assert norm < np.max(blocks) < 1.01 * NORM_FACTOR * norm
    assert np.max(np.abs(control.feedback(plant, controller, 1).poles())) < 1.0


def test_lightly_damped_mode_is_damped_not_cancelled() -> None:
    mode = control.sample_system(control.ss([[0, 1], [-100, -0.1]], [[0], [1]], [[0, 10]], 0), PERIOD)
    controller = synthesise_controller(mode, control.ss([], [], [], 1.0))
    poles = control.feedback(mode, controller, 1).poles()
    assert np.max(np.abs(poles)) < np.exp(-0.1 * 10.0 * PERIOD)
