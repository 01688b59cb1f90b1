"""Which effect explains the damping of a real platform's free modes: each by the linear plant, against 30 ring-downs.

The damping ratios of weak viscous damping are proportional to its coefficient, so that one linearisation of each run
serves any coefficient. Ratios scatter by factors, so that logarithms are compared.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from tautwire.linear.linear_plant import linearise
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.schema import EffectSetting, Robot
from tests.support.folders import SHARED_RECORDINGS

RINGDOWNS = SHARED_RECORDINGS / "real-ringdowns"
pytestmark = pytest.mark.skipif(not RINGDOWNS.is_dir(), reason="no shared recordings beside the project")
Array = NDArray[np.float64]

# Weak enough for ratios proportional to it; N s/m, N m s and Pa s, each for a platform of 1 kg.
WEAK = {"transverse_damping": 1e-3, "rotational_drag": 1e-4, "damping": 1e6}


@dataclass(frozen=True)
class FreeModes:
    """Measured damping ratios, those of each effect per unit of its coefficient, and the number of cables, by mode."""

    measured: Array
    per_unit: Mapping[str, Array]
    cables: Array

    def of(self, count: int) -> FreeModes:
        """Those of one number of cables."""
        chosen = self.cables == count
        per_unit = {name: ratios[chosen] for name, ratios in self.per_unit.items()}
        return FreeModes(self.measured[chosen], per_unit, self.cables[chosen])

    def coefficient(self, effect: str) -> float:
        """The median of the coefficients by which an effect alone gives the ratio of each mode."""
        return float(np.median(self.measured / self.per_unit[effect]))

    def scatter(self, computed: Array) -> float:
        """Standard deviation of the logarithm of measured over computed ratios."""
        return float(np.std(np.log(self.measured / computed)))


def weakly_damped(robot: Robot, effect: str) -> Robot:
    cables = robot.cable_numbers if effect != "rotational_drag" else ()
    return robot.with_effect(EffectSetting(effect, {"damping": WEAK[effect]}, cables))


def free_modes(numbers: range, effects: tuple[str, ...]) -> FreeModes:
    runs = [run for run in json.loads((RINGDOWNS / "ringdowns.json").read_text()) if run["run"] in numbers]
    measured: list[float] = []
    cables: list[int] = []
    per_unit: dict[str, list[float]] = {effect: [] for effect in effects}
    for run in runs:
        declared = read_robot(RINGDOWNS / f"grab-{run['cables']}.toml")
        start, orientation = (tuple(run[key]) for key in ("start", "start_orientation"))
        robot = replace(declared, platform=replace(declared.platform, start=start, start_orientation=orientation))
        shown = [index for index, ratio in enumerate(run["measured_damping_ratio"]) if ratio is not None]
        measured += [run["measured_damping_ratio"][index] for index in shown]
        cables += [run["cables"]] * len(shown)
        for effect in effects:
            ratios = linearise(weakly_damped(robot, effect), swing=0.0).modes.damping_ratios / WEAK[effect]
            per_unit[effect] += ratios[shown].tolist()
    return FreeModes(np.array(measured), {key: np.array(each) for key, each in per_unit.items()}, np.array(cables))


@pytest.fixture(scope="module")
def modes() -> FreeModes:
    return free_modes(range(1, 61), tuple(WEAK))


def test_transverse_damping_of_one_size_gives_the_measured_damping_of_four_and_three_cables() -> None:
    chosen = free_modes(range(35, 39, 2), ("transverse_damping",))
    assert set(chosen.cables) == {3, 4}
    # N s/m for each kilogram: half to three times the one that fits all runs.
    coefficients = chosen.measured / chosen.per_unit["transverse_damping"]
    assert np.all((coefficients > 0.01) & (coefficients < 0.15))


@pytest.mark.validate
def test_transverse_damping_alone_keeps_its_size_with_any_number_of_cables(modes: FreeModes) -> None:
    assert modes.measured.size == 74
    sizes = [modes.of(count).coefficient("transverse_damping") for count in (4, 3, 2)]
    assert sizes == pytest.approx([0.037, 0.039, 0.047], rel=0.03)
    assert modes.coefficient("transverse_damping") == pytest.approx(0.039, rel=0.03)
    # Stretching ropes would need thousands of times the damping with two cables that they need with three.
    assert modes.of(2).coefficient("damping") > 300.0 * modes.of(3).coefficient("damping")
    assert modes.of(3).coefficient("damping") > 1e10


@pytest.mark.validate
def test_what_each_effect_leaves_of_the_scatter_is_as_documented(modes: FreeModes) -> None:
    left = {name: modes.scatter(ratios) for name, ratios in modes.per_unit.items()}
    assert modes.scatter(np.ones(74)) == pytest.approx(0.60, abs=0.01)
    assert left["transverse_damping"] == pytest.approx(0.59, abs=0.01)
    assert left["rotational_drag"] == pytest.approx(0.76, abs=0.01)
    assert left["damping"] > 3.0

    def mean_square(logarithms: Array) -> float:
        transverse, rotational = np.exp(logarithms)
        computed = transverse * modes.per_unit["transverse_damping"] + rotational * modes.per_unit["rotational_drag"]
        return float(np.mean(np.log(modes.measured / computed) ** 2))

    both = minimize(mean_square, np.log([0.03, 1e-3]), method="Nelder-Mead")
    assert np.exp(both.x) == pytest.approx([0.030, 0.0012], rel=0.05)
    assert np.sqrt(both.fun) == pytest.approx(0.53, abs=0.01)
