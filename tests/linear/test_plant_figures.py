from io import BytesIO

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from tautwire.errors import InputError
from tautwire.linear import bode_figure, linearise, modes_along, modes_along_figure, pole_figure
from tests.support.robots import example, paper_robot

PATH = np.array([[28.86, 0.0, 5.0], [26.0, 0.1, 6.0], [24.0, 0.2, 7.0]])


def drawn(figure: Figure) -> int:
    """Bytes of the figure as a picture."""
    picture = BytesIO()
    figure.savefig(picture)
    return len(picture.getvalue())


def test_the_bode_diagram_draws_the_frequency_response() -> None:
    system = linearise(example("caroca")).system
    figure = bode_figure(system, "winch_speed_1", ["position_x", "tension_1"], np.geomspace(1.0, 20.0, 50))
    gains, phases = figure.axes[:2]
    curves = [line for line in gains.lines if len(line.get_xdata()) == 50]
    assert len(curves) == 2
    for line, target in zip(curves, ("position_x", "tension_1"), strict=True):
        expected = np.abs(system[target, "winch_speed_1"](2j * np.pi * np.asarray(line.get_xdata())))
        assert np.asarray(line.get_ydata()) == pytest.approx(expected, rel=1e-6)
    assert [text.get_text() for text in gains.get_legend().get_texts()] == ["position_x", "tension_1"]
    assert phases.get_xlabel() == "Frequency [Hz]"
    assert drawn(figure) > 10_000


def test_the_phase_begins_within_half_a_turn() -> None:
    figure = bode_figure(linearise(example("caroca")).system, "winch_speed_1", "tension_1")
    (phase,) = [line for line in figure.axes[1].lines if len(line.get_xdata()) > 100]
    assert np.asarray(phase.get_ydata())[0] == pytest.approx(90.0, abs=1.0)


def test_poles_and_zeros_of_a_channel_and_what_lies_beyond() -> None:
    figure = pole_figure(linearise(example("caroca")).system, "winch_speed_1", "position_x")
    (axes,) = figure.axes
    low, high = axes.get_ylim()
    assert low < -50.15 and high > 50.15
    # The zero of the ropes' viscosity is at -E / c.
    assert "zeros beyond: -1022" in figure.get_suptitle()
    assert drawn(figure) > 5_000


def test_poles_of_the_whole_plant() -> None:
    figure = pole_figure(linearise(paper_robot(damping=4e8)).system)
    marked = {(round(x, 3), round(y, 2)) for line in figure.axes[0].lines for x, y in line.get_xydata()}
    poles = linearise(paper_robot(damping=4e8)).system.poles()
    assert {(round(p.real, 3), round(p.imag, 2)) for p in poles if abs(p) > 1.0} <= marked


def test_modes_along_a_path_for_two_moduli() -> None:
    runs = {
        name: modes_along(paper_robot(4e8, modulus=modulus), PATH)
        for name, modulus in (("quasi-static", 102.2e9), ("dynamic", 134.8e9))
    }
    figure = modes_along_figure(runs)
    upper, lower = figure.axes
    assert len(upper.lines) == len(lower.lines) == 6
    assert np.asarray(upper.lines[3].get_ydata()) == pytest.approx(runs["dynamic"].frequencies[:, 0])
    assert lower.get_xlabel() == "distance travelled, m"
    assert drawn(figure) > 10_000


@pytest.mark.validate
def test_no_figure_is_shown() -> None:
    before = plt.get_fignums()
    drawn(bode_figure(linearise(paper_robot()).system, "winch_speed_1", "tension_1"))
    drawn(modes_along_figure(modes_along(paper_robot(), PATH, times=np.arange(3.0))))
    assert plt.get_fignums() == before


def test_an_unknown_signal_is_refused() -> None:
    with pytest.raises(InputError, match="no output"):
        bode_figure(linearise(paper_robot()).system, "winch_speed_1", "speed")
