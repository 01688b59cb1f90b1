"""A rope on a drum: material is conserved, and each law is right in one direction."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.paper.drum_winding import DrumWinding, ExactReel, LinearReel, LogarithmicReel, follow_path
from tautwire.paper.paper_parameters import read_parameters
from tautwire.robot.trajectory import Line
from tests.support.robots import paper_robot

STRAIN = 4e-4
STEPS = np.linspace(0.0, 20.0, 400)[1:]


def test_rope_reeled_in_takes_its_strain_with_it_and_comes_off_with_it() -> None:
    drum = DrumWinding()
    for wound in STEPS:
        drum.wind(float(wound), STRAIN)
    assert drum.material[-1] == pytest.approx(20.0 / (1.0 + STRAIN), rel=1e-14)
    for wound in STEPS[::-1]:
        drum.wind(float(wound) - STEPS[0], strain=-0.01)
    assert drum.material[-1] == pytest.approx(0.0, abs=1e-13), "the strain of the span does not count on the way out"


def test_rope_from_before_the_start_comes_off_as_tight_as_at_the_start() -> None:
    drum = DrumWinding()
    drum.wind(-7.0, STRAIN)
    assert drum.material[-1] == -7.0


def test_rope_wound_in_turns_of_two_strains_comes_off_last_on_first() -> None:
    drum = DrumWinding()
    drum.wind(5.0, 0.0)
    drum.wind(8.0, 0.5)
    assert drum.material[-1] == pytest.approx(5.0 + 2.0)
    drum.wind(5.0, 0.0)
    assert drum.material[-1] == pytest.approx(5.0)


def test_logarithmic_law_is_right_reeling_in_and_the_linear_one_paying_out() -> None:
    held = {}
    for sign in (1.0, -1.0):
        reels = ExactReel(70.0), LogarithmicReel(70.0), LinearReel(70.0)
        for wound in sign * STEPS:
            for reel in reels:
                reel.wind(float(wound), STRAIN)
        held[sign] = [reel.unstrained_length(sign * 20.0, STRAIN) for reel in reels]
    exact, logarithmic, linear = held[1.0]
    # 1 / (1 + e) and exp(-e) differ by half of e squared.
    assert logarithmic == pytest.approx(exact, abs=20.0 * STRAIN**2)
    assert linear - exact == pytest.approx(-20.0 * STRAIN, rel=1e-3)
    exact, logarithmic, linear = held[-1.0]
    assert linear == pytest.approx(exact, abs=1e-12)
    assert logarithmic - exact == pytest.approx(-20.0 * STRAIN, rel=1e-3)


@pytest.mark.parametrize("law", ["exact", "logarithmic", "linear"])
def test_platform_hangs_where_its_ropes_carry_it(law: str) -> None:
    robot = paper_robot(modulus=102.2e9)
    path = Line(robot.platform.start, (28.0, 2.0, 8.0), 5.0)
    run = follow_path(robot, path, np.linspace(0.0, 5.0, 51), law)
    spans = np.array(robot.anchors) - run.position[-1]
    pulled = run.tension[-1] @ (spans / np.linalg.norm(spans, axis=1)[:, None])
    assert pulled == pytest.approx([0.0, 0.0, 300.0 * 9.8], abs=1e-6)
    assert run.position[0] == pytest.approx(robot.platform.start, abs=1e-12)


def test_slow_helix_has_the_elongations_of_the_independent_simulator() -> None:
    corrected = read_parameters("corrected")
    robot, path = corrected.robots["three"], corrected.helices["three"]
    time = np.linspace(0.0, 50.0, 401)
    runs = {law: follow_path(robot, path, time, law) for law in ("logarithmic", "linear")}
    gap = np.abs(runs["linear"].elongation - runs["logarithmic"].elongation)
    # tests/rig/test_paper_robot.py: 2.86 mm at 39 s and 12.0 % at 27.5 s, with all dynamics.
    assert np.interp(39.0, time, gap[:, 1]) == pytest.approx(2.86e-3, rel=0.02)
    share = gap[:, 0] / np.maximum(np.abs(runs["logarithmic"].elongation[:, 0]), 1e-9)
    assert np.interp(27.5, time, share) == pytest.approx(0.12, rel=0.02)
